"""Photo to character as a whole, on the golden panel (`tests.support.golden`).

The sample is that of the run that tests share. The others take minutes and need the real data: ``A2V_GOLDEN=1``.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from pipelines.engine.store import Store
from tests.support.golden import PEOPLE, differences, figures_of, stored_figures
from tests.support.whole_run import whole_run


@pytest.mark.parametrize("name", PEOPLE)
def test_a_character_is_the_golden_one(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    data, store = None, Store(whole_run().store)
    if name != "sample":
        store = Store(tmp_path / "store")
        if not os.environ.get("A2V_GOLDEN"):
            pytest.skip("takes a minute per person; set A2V_GOLDEN=1")
        data = request.getfixturevalue("data_dir")
    found = figures_of(name, data, store, tmp_path)
    assert differences(found, stored_figures()[name]) == []


def test_another_back_or_note_is_a_difference() -> None:
    """The comparison can fail: on the colors of the hidden side, a part, the size and a note."""
    stored = stored_figures()["sample"]
    assert differences(stored, stored) == []
    for name, change in (
        ("hidden", 12.0),
        ("visible", 4.0),
        ("size", 0.02),
        ("labels", 0.1),
        ("head", 30.0),
    ):
        changed = {**stored, name: np.asarray(stored[name], float) + change}
        assert [line.partition(":")[0] for line in differences(changed, stored)] == [name]
    assert differences({**stored, "notes": np.array('["other"]')}, stored)
