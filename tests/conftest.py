"""Fixtures shared by every test."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real data (`A2V_DATA`, else ``../shared/data``); tests that need it skip without it."""
    folder = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real data not present: {folder} does not exist (set A2V_DATA)")
    return folder
