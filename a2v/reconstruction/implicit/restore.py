"""Networks of the implicit surface out of the ONNX files that ``export/reconstruction.py`` wrote, to go on training the shipped ones.

The export folds every batch normalisation into the convolution before it; here it comes back as one that changes nothing (`calibrate` gives it
the statistics of real activations, so that training starts from the same function).
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.reconstruction.implicit.model import COLORS_FILE, FIELD_FILE, MAPS_FILE

_HALF = "_half"
"""Ending of the names of weights that are stored as float16."""


def restore_networks(networks: nn.Module, folder: str | os.PathLike[str], stage: str) -> None:
    """Give fresh networks of a stage the weights of a folder with ``person_*.onnx``.

    Parameters
    ----------
    networks : Shape, Detail or Painter
        Of `a2v.reconstruction.implicit.training`, with the sizes of the files.
    folder : path
    stage : "shape", "detail" or "color"

    Raises
    ------
    InputError
        The files are none of ours, or of networks of other sizes.
    """
    _, maps = _read(Path(folder) / MAPS_FILE)
    prefix = {"shape": "shape", "detail": "detail", "color": "painter"}[stage]
    products = {
        "shape": (FIELD_FILE, "coarse.", "field."),
        "detail": (FIELD_FILE, "fine.", "field."),
        "color": (COLORS_FILE, "painter.", ""),
    }
    file, found, named = products[stage]
    weights = _perceptrons(Path(folder) / file, found, named)
    state = networks.state_dict()
    for name, module in networks.named_modules():
        if isinstance(module, nn.Conv2d):
            own = f"{prefix}.{name}"
            weights[f"{name}.weight"] = maps.get(f"{own}.weight{_HALF}", maps.get(f"{own}.weight"))
            if module.bias is not None:
                weights[f"{name}.bias"] = maps.get(f"{own}.bias")
        elif isinstance(module, nn.BatchNorm2d):
            before = f"{name.rpartition('.')[0]}.0"  # of each block: convolution, normalisation, activation
            ones = np.ones(module.num_features, np.float32)
            weights |= {f"{name}.weight": np.sqrt(ones + module.eps), f"{name}.bias": maps.get(f"{prefix}.{before}.weight_bias")}
            weights |= {f"{name}.running_mean": 0 * ones, f"{name}.running_var": ones}
    for name, value in state.items():
        if name.endswith("num_batches_tracked"):
            continue
        new = weights.get(name)
        if new is None or tuple(new.shape) != tuple(value.shape):
            raise InputError(
                f"{folder} holds no networks of these sizes ({stage}: {name}); give the same --network settings, or leave initial out"
            )
        state[name] = torch.from_numpy(np.array(new, np.float32))
    networks.load_state_dict(state)


@torch.no_grad()
def calibrate(networks: nn.Module, batches: Iterable[Any], forward: Any) -> None:
    """Give normalisations that change nothing the mean and variance of what reaches them; what the networks compute stays as it is.

    Parameters
    ----------
    networks : Module
        As `restore_networks` leaves it.
    batches : iterable
    forward : callable
        Runs the networks on a batch.
    """
    layers = [module for module in networks.modules() if isinstance(module, nn.BatchNorm2d)]
    sums: dict[nn.Module, list[Tensor]] = {layer: [] for layer in layers}

    def note(layer: nn.Module, given: tuple[Tensor, ...]) -> None:
        values = given[0].float()
        sums[layer].append(torch.stack([values.mean((0, 2, 3)), values.square().mean((0, 2, 3))]))

    hooks = [layer.register_forward_pre_hook(note) for layer in layers]
    networks.eval()
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


def _read(path: Path) -> tuple[Any, dict[str, np.ndarray]]:
    """The graph of an ONNX file, and every stored tensor by its name."""
    import onnx
    from onnx import numpy_helper

    if not path.is_file():
        raise InputError(f"{path} does not exist; give a run's folder or one with the person's ONNX files")
    graph = onnx.load(str(path)).graph
    return graph, {item.name: numpy_helper.to_array(item) for item in graph.initializer}


def _perceptrons(path: Path, prefix: str, named: str) -> dict[str, np.ndarray | None]:
    """Weights and biases of the linear layers whose bias begins with `prefix`, which `named` takes the place of.

    The exporter names biases after their layers and leaves the matrices before them nameless: each is the factor of the product that its
    bias is added to.
    """
    graph, constants = _read(path)
    makers = {output: node for node in graph.node for output in node.output}
    found: dict[str, np.ndarray | None] = {}
    for node in graph.node:
        bias = next((name for name in node.input if name.startswith(prefix) and name.endswith(".bias")), "")
        if node.op_type != "Add" or not bias:
            continue
        product = next(makers[name] for name in node.input if name in makers and makers[name].op_type == "MatMul")
        factor = product.input[1]
        if factor not in constants:  # stored as float16, and cast
            factor = makers[factor].input[0]
        layer = named + bias.removeprefix(prefix).removesuffix(".bias")
        found |= {f"{layer}.weight": constants[factor].T, f"{layer}.bias": constants[bias]}
    return found
