"""Weights of an exported VAE, to train on: the inverse of `export.motion`.

An exported graph has the network's weights partly under other names, joined or transposed. So a
network whose weights are serial numbers is exported, and each number tells where its weight is.
"""

from __future__ import annotations

import copy
import math
import os
from pathlib import Path

import numpy as np
import torch
from onnx import numpy_helper
from torch import Tensor

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.lab.datasets import ActionDataset
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.vae import MotionVAE
from a2v.lab.untracing import read_described
from a2v.motion.card import StepCard, parse_card
from export.motion import step_model

HIDDEN = "posterior."
"""First part of the names of the weights that an export leaves out."""
MAX_BYTES = 64 << 20
"""Largest file that is read; the shipped ones have about one megabyte."""


def exported_weights(
    path: str | os.PathLike[str], dataset: ActionDataset, vae: VAESettings
) -> dict[str, Tensor]:
    """Return the weights of an exported VAE by their names in `MotionVAE`, at temperature 1.

    Large ones have the precision of halves. An export has no posterior: it begins as a copy of the
    prior, which has the same layers.

    Parameters
    ----------
    path : path
        An ``.onnx`` of `export_motion`.
    dataset, vae
        Of the training: the file's must have the same joints, actions and sizes.

    Raises
    ------
    InputError
        The file is no VAE of a2v, or has other layers.
    """
    stored, temperature = _stored(path)
    network = MotionVAE(dataset.skeleton, len(dataset.actions), vae)
    found = _places(network)
    named = {name: array for name, array in found.items() if name in stored}
    for name, places in found.items():
        if name not in named:  # numbered by the exporter: the only one of its shape that is left
            left = [
                other
                for other, array in stored.items()
                if other not in found and array.shape == places.shape
            ]
            stored[name] = stored[left[0]] if len(left) == 1 else np.empty(0, np.float32)
    total = sum(weight.numel() for weight in network.parameters())
    values = np.full(total, np.nan, np.float32)
    for name, places in found.items():
        if stored[name].shape != places.shape:
            raise _other_layers(path)
        values[places] = stored[name]
    weights, start = copy.deepcopy(network.state_dict()), 0
    for name, weight in network.named_parameters():
        part = values[start : start + weight.numel()]
        start += weight.numel()
        if not name.startswith(HIDDEN):
            if not np.isfinite(part).all():
                raise _other_layers(path)
            weights[name] = torch.from_numpy(part.reshape(weight.shape).copy())
    if "prior.logvar_net.bias" in weights:
        weights["prior.logvar_net.bias"] -= 2 * math.log(temperature)
    for name in weights:
        if name.startswith(HIDDEN) and (own := name.replace(HIDDEN, "prior.", 1)) in weights:
            weights[name] = weights[own].clone()
    return weights


def write_start(
    path: str | os.PathLike[str], folder: Path, dataset: ActionDataset, vae: VAESettings
) -> Path:
    """Write `exported_weights` as ``initial.pt`` into the folder of a training, as a checkpoint
    for `TrainSettings.initial`; return its path.

    Raises
    ------
    InputError
        See `exported_weights`.
    """
    content = {
        "model": exported_weights(path, dataset, vae),
        "generator": {},
        "made_with": {},
        "seconds": 0.0,
    }
    folder.mkdir(parents=True, exist_ok=True)
    with atomic_path(folder / "initial.pt") as temporary:
        torch.save(content, temporary)
    return folder / "initial.pt"


def _stored(path: str | os.PathLike[str]) -> tuple[dict[str, np.ndarray], float]:
    """Return the arrays of a file by their names before storage, and its temperature."""
    try:
        proto, said = read_described(path, limit=MAX_BYTES)
        arrays = {
            item.name.removesuffix("_half"): numpy_helper.to_array(item).astype(np.float32)
            for item in proto.graph.initializer
        }
        card = parse_card(said, Path(path))
    except InputError:
        raise
    except Exception as error:  # protobuf and onnx raise many kinds for another file
        raise InputError(
            f"{path} is not a motion model of a2v ({type(error).__name__}); give a checkpoint.pt "
            "or an exported VAE"
        ) from None
    if not isinstance(card, StepCard):
        raise InputError(f"{path} is a flow; give an exported VAE, or use a2v train flow")
    return arrays, card.temperature


def _places(network: MotionVAE) -> dict[str, np.ndarray]:
    """Return the indices of weights in each array of the exported graph, by the array's name."""
    numbered, start = copy.deepcopy(network), 0
    total = sum(weight.numel() for weight in network.parameters())
    with torch.no_grad():
        for weight in numbered.parameters():
            numbers = torch.arange(start + 1, start + 1 + weight.numel(), dtype=torch.float32)
            weight.copy_(numbers.view(weight.shape))  # whole numbers, exact below 2 ** 24
            start += weight.numel()
    places = {}
    for item in step_model(numbered.eval()).graph.initializer:
        array = numpy_helper.to_array(item)
        if array.dtype == np.float32 and array.size > 2:
            index = np.rint(array).astype(np.int64) - 1
            whole = (index + 1 == array).all() and len(np.unique(index)) == index.size
            if whole and index.min() >= 0 and index.max() < total:
                places[item.name] = index
    return places


def _other_layers(path: str | os.PathLike[str]) -> InputError:
    return InputError(
        f"initial: {path} has other layers than this training; give an exported VAE of the same "
        "data set and --vae settings, or a checkpoint.pt"
    )
