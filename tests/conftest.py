"""Fixtures shared by every test."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real data; tests are skipped without it.

    It is `A2V_DATA`, else ``../shared/data``.
    """
    folder = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real data not present: {folder} does not exist (set A2V_DATA)")
    return folder


@pytest.fixture(autouse=True)
def _threads() -> Iterator[None]:
    """Restore the number of PyTorch's threads after each test.

    With more threads, later tests of the same process would wait for the cores of other workers.
    """
    torch = sys.modules.get("torch")
    before = torch.get_num_threads() if torch else None
    yield
    if before and torch and torch.get_num_threads() != before:
        torch.set_num_threads(before)
