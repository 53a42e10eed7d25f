"""The limits that every reader of hostile files is held to."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import hostile
from tests.support.hostile import MEGABYTES, owes_a_sentence

NUMBERS = int(1.2 * MEGABYTES * 2**20 / 8)


@pytest.fixture(autouse=True)
def _not_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hostile, "TALLIES", {})


def test_memory_of_an_earlier_test_is_not_counted() -> None:
    del (numbers := [np.ones(NUMBERS)])[:]
    owes_a_sentence(lambda: numbers)


def test_memory_that_was_freed_again_is_counted() -> None:
    with pytest.raises(AssertionError):
        owes_a_sentence(lambda: np.ones(NUMBERS).sum() and None)
