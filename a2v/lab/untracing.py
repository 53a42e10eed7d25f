"""Recover weights from the ONNX graphs that `a2v.tracing` wrote, to continue training without a
checkpoint.

The export folds every batch normalization into the preceding convolution. Here it is restored as
one that changes nothing. `calibrate` sets its statistics to those of real activations, so that
training starts from the same function.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.io import read_bytes

_HALF = "_half"
"""Ending of the names of weights that are stored as float16."""
_FOLDED = ".weight_bias"
"""Ending of the name of the bias that a convolution got from the following normalization."""


def read_described(path: str | os.PathLike[str], *, limit: int = 1 << 30) -> tuple[Any, Any]:
    """Return an ONNX file of a2v, parsed, and the description in its metadata; {} without one.
    Files over `limit` bytes are refused."""
    import onnx

    proto = onnx.load_model_from_string(read_bytes(path, limit=limit))
    texts = (item.value for item in proto.metadata_props if item.key == "a2v")
    return proto, json.loads(next(texts, "{}"))


def read_weights(path: str | os.PathLike[str], names: Mapping[str, str]) -> dict[str, np.ndarray]:
    """Return the weights of a file by their names in torch.

    The exporter names biases after their layers and leaves the matrices unnamed. Each matrix is the
    factor of the product to which its bias is added.

    Parameters
    ----------
    path : path
    names : mapping
        Prefixes of names in the file and their replacements; other weights are left out.

    Raises
    ------
    InputError
        The file does not exist.
    """
    import onnx
    from onnx import numpy_helper

    if not Path(path).is_file():
        raise InputError(
            f"{path} does not exist; give a run's folder or one with ONNX files that a2v wrote"
        )
    graph = onnx.load_model_from_string(read_bytes(path)).graph
    constants = {item.name: numpy_helper.to_array(item) for item in graph.initializer}
    found = {name.removesuffix(_HALF): value for name, value in constants.items()}
    makers = {output: node for node in graph.node for output in node.output}
    for node in graph.node:
        bias = next(
            (name for name in node.input if name in constants and name.endswith("bias")), ""
        )
        product = next(
            (
                makers[name]
                for name in node.input
                if name in makers and makers[name].op_type == "MatMul"
            ),
            None,
        )
        if node.op_type == "Add" and bias and product is not None:
            factor = product.input[1]
            stored = (
                factor if factor in constants else makers[factor].input[0]
            )  # stored as float16, and cast
            found[f"{bias.removesuffix('bias')}weight"] = constants[stored].T
    return {
        new + name.removeprefix(old): np.array(value, np.float32)
        for name, value in found.items()
        for old, new in names.items()
        if name.startswith(old)
    }


def fill(network: nn.Module, weights: Mapping[str, np.ndarray], *, otherwise: str) -> None:
    """Set a network's weights to those of `read_weights`, in place.

    Raises
    ------
    InputError
        A weight is missing, or of another size; `otherwise` is the advice in the message.
    """
    weights = dict(weights)
    for name, module in network.named_modules():
        if isinstance(module, nn.BatchNorm2d):
            # of each block: convolution, normalization, activation
            before = f"{name.rpartition('.')[0]}.0"
            ones = np.ones(module.num_features, np.float32)
            weights |= {
                f"{name}.weight": np.sqrt(ones + module.eps),
                f"{name}.running_mean": 0 * ones,
                f"{name}.running_var": ones,
            }
            if before + _FOLDED in weights:
                weights[f"{name}.bias"] = weights[before + _FOLDED]
    state = network.state_dict()
    for name, value in state.items():
        if name.endswith("num_batches_tracked"):
            continue
        new = weights.get(name)
        if new is None or tuple(new.shape) != tuple(value.shape):
            raise InputError(f"no network of this kind and size ({name}); {otherwise}")
        state[name] = torch.from_numpy(np.ascontiguousarray(new)).to(value.device)
    network.load_state_dict(state)


@torch.no_grad()
def calibrate(network: nn.Module, batches: Iterable[Any], forward: Callable[[Any], Any]) -> None:
    """Give neutral normalizations the statistics of their inputs.

    The network computes the same function.

    Parameters
    ----------
    network : Module
        A network after `fill`.
    batches : iterable
    forward : callable
        Runs the network on a batch.
    """
    layers = [module for module in network.modules() if isinstance(module, nn.BatchNorm2d)]
    sums: dict[nn.Module, list[Tensor]] = {layer: [] for layer in layers}

    def note(layer: nn.Module, given: tuple[Tensor, ...]) -> None:
        values = given[0].float()
        sums[layer].append(torch.stack([values.mean((0, 2, 3)), values.square().mean((0, 2, 3))]))

    hooks = [layer.register_forward_pre_hook(note) for layer in layers]
    network.eval()
    for batch in batches:
        forward(batch)
    for hook in hooks:
        hook.remove()
    for layer in layers:
        mean, square = torch.stack(sums[layer]).mean(0)
        spread = (square - mean.square()).clamp(min=1e-6)
        assert layer.running_mean is not None
        assert layer.running_var is not None
        layer.bias.add_(mean)
        layer.weight.copy_(torch.sqrt(spread + layer.eps))
        layer.running_mean.copy_(mean)
        layer.running_var.copy_(spread)
