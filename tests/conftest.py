"""Fixtures shared by every test."""

from __future__ import annotations

import functools
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


EXPORTER = "torch.onnx._internal.exporter._registration"


@pytest.fixture(autouse=True)
def _one_registry() -> None:
    """Let PyTorch build the exporter's list of operators once per process, not at each export,
    where it takes 0.6 s."""
    registry = getattr(sys.modules.get(EXPORTER), "ONNXRegistry", None)
    if registry is not None and not hasattr(registry.from_torchlib, "cache_info"):
        registry.from_torchlib = staticmethod(functools.cache(registry.from_torchlib))
