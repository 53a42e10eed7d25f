"""One store for the whole test run, so that the sample's character is computed once and not by every test."""

from __future__ import annotations

import os
import shutil
import tempfile

import pytest

pytest_plugins = ["tests.support.characters", "tests.support.dressed", "tests.support.glb"]


def pytest_configure(config: pytest.Config) -> None:
    """The controlling process makes the folder; workers and the programs that tests start inherit it."""
    os.environ.setdefault("A2V_SMALL", "1")  # notebooks run at their small size
    if "A2V_CACHE" not in os.environ and not hasattr(config, "workerinput"):
        config.stash[_MADE] = os.environ["A2V_CACHE"] = tempfile.mkdtemp(prefix="a2v-tests-")


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove what was made."""
    if made := config.stash.get(_MADE, None):
        os.environ.pop("A2V_CACHE", None)
        shutil.rmtree(made, ignore_errors=True)


_MADE = pytest.StashKey[str]()
