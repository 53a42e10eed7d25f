"""Exports to ONNX share PyTorch's table of operators, which takes half a second to make."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def one_table_of_operators() -> Iterator[None]:
    """Let PyTorch's exporter read the 500 functions of its table once for all exports of a run."""
    with pytest.MonkeyPatch.context() as patch:
        try:
            from torch.onnx._internal.exporter._registration import ONNXRegistry

            once = staticmethod(functools.cache(ONNXRegistry.from_torchlib))
            patch.setattr(ONNXRegistry, "from_torchlib", once)
        except (ImportError, AttributeError):  # another version of PyTorch has another place for it
            pass
        yield
