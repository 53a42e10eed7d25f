"""Export of PyTorch modules to ONNX graphs."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import onnx
    import torch
    from torch import nn

OPSET = 18


def to_onnx(
    graph: nn.Module,
    arguments: tuple[torch.Tensor, ...],
    inputs: Sequence[str],
    outputs: Sequence[str],
    sizes: Sequence[Mapping[int, Any] | None],
    *,
    fold_below: int | None = None,
) -> onnx.ModelProto:
    """Export `graph`, traced with example `arguments`, to ONNX.

    Parameters
    ----------
    inputs, outputs : names
    sizes : one entry an input
        ``{axis: torch.export.Dim}`` of the axes whose length stays free, or None.
    fold_below : int, optional
        Constant parts of the graph are computed here, except those with an input tensor of at least
        this many numbers. Default: the exporter's own choice.

    Raises
    ------
    RuntimeError
        `graph` fixes a length that should stay free. The exporter itself would not report that.
    """
    import onnxscript.optimizer
    import torch

    # messages about nodes that are not folded and about missing packages do not concern users
    loggers = [logging.getLogger(name) for name in ("onnxscript", "torch.onnx")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.ERROR)
    try:
        program = torch.onnx.export(
            graph,
            arguments,
            dynamo=True,
            opset_version=OPSET,
            input_names=list(inputs),
            output_names=list(outputs),
            dynamic_shapes=tuple(sizes),
            optimize=fold_below is None,
            verbose=False,
        )
        assert program is not None
        proto: onnx.ModelProto = program.model_proto
        if fold_below is not None:
            proto = onnxscript.optimizer.optimize(proto, input_size_limit=fold_below - 1)
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
    for name, item, free in zip(inputs, proto.graph.input, sizes, strict=True):
        for axis in free or {}:
            if not item.type.tensor_type.shape.dim[axis].dim_param:
                raise RuntimeError(
                    f"axis {axis} of the input '{name}' is fixed in the exported graph"
                )
    return proto
