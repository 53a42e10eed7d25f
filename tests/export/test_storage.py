"""Tracing to ONNX must not silently fix sizes."""

from __future__ import annotations

import onnx
import pytest
import torch
from torch import Tensor, nn

from a2v.tracing import to_onnx


class Halves(nn.Module):
    """Splits twice its input in two: by `chunk`, which fixes the length, or by a free shape."""

    def __init__(self, fixed: bool) -> None:
        super().__init__()
        self.fixed = fixed

    def forward(self, x: Tensor) -> Tensor:
        """Return the difference of the halves."""
        both = torch.cat([x, 2 * x])
        first, second = both.chunk(2) if self.fixed else both.reshape(2, -1, x.shape[1]).unbind()
        return first - second


def trace(fixed: bool) -> onnx.ModelProto:
    """A graph with a free batch."""
    return to_onnx(
        Halves(fixed), (torch.randn(2, 3),), ["x"], ["y"], [{0: torch.export.Dim("batch", min=1)}]
    )


def test_a_fixed_length_is_refused():
    with pytest.raises(RuntimeError, match="axis 0 of the input 'x' is fixed"):
        trace(fixed=True)


def test_a_free_length_stays_free_and_nothing_is_said_of_folding(caplog):
    graph = trace(fixed=False).graph
    assert [
        dim.dim_param or dim.dim_value for dim in graph.input[0].type.tensor_type.shape.dim
    ] == ["batch", 3]
    assert not [record for record in caplog.records if "constant folding" in record.message]


def test_weights_are_only_folded_below_the_limit():
    layer = nn.Sequential(nn.Linear(40, 40, bias=False), nn.Linear(40, 40, bias=False))

    class Joined(nn.Module):
        """Compute both layers as one product."""

        def __init__(self) -> None:
            super().__init__()
            self.layer = layer

        def forward(self, x: Tensor) -> Tensor:
            """Compute the layers one after the other."""
            return x @ (self.layer[1].weight @ self.layer[0].weight).T

    sizes = [{0: torch.export.Dim("batch", min=1)}]
    large, small = (
        to_onnx(Joined(), (torch.randn(2, 40),), ["x"], ["y"], sizes, fold_below=limit)
        for limit in (1024, 10_000)
    )
    products = [
        sum(node.op_type in ("MatMul", "Gemm") for node in proto.graph.node)
        for proto in (large, small)
    ]
    assert products == [2, 1]
