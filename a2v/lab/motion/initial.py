"""Initial weights of a flow's training: those of another run or of an exported flow, converted to
the new run's code and actions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from a2v.errors import InputError
from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.motion.flow import FlowNetwork
from a2v.lab.motion.windows import LinearCode, WindowCodec
from a2v.lab.untracing import read_described
from a2v.motion.card import WINDOW_FORMAT, parse_card
from a2v.types import FloatArray


class Start(NamedTuple):
    """A trained flow: weights by the names of `FlowNetwork`, its code, and its actions with their
    traits, or None if they are not known."""

    weights: dict[str, Tensor]
    codec: WindowCodec
    actions: tuple[str, ...] | None
    traits: tuple[str, ...] | None


def carry_over(
    path: str,
    network: FlowNetwork,
    codec: WindowCodec,
    features: int,
    actions: Sequence[str],
    traits: Sequence[Sequence[str]],
) -> WindowCodec:
    """Set the weights of `network` to those of another flow, rotated to the code of `codec`.

    A flow between rotated noise and rotated codes is the same flow: only the first and the last
    layer contain the rotation. Returns the codec with that flow's context. Actions and traits of an
    exported flow are matched by name; missing ones keep the weights of `network`.

    Parameters
    ----------
    path : str
        ``flow.pt`` of a run, or an exported ``.onnx``.
    features : int
        Numbers per frame.
    actions, traits
        Of `network`.

    Raises
    ------
    InputError
        The file has other sizes or windows, or, if it is a run's, other actions.
    """
    start = _exported(path) if Path(path).suffix == ".onnx" else _run(path, features)
    own = network.state_dict()
    weights = dict(start.weights)
    if start.actions is not None and start.traits is not None:
        weights["action.weight"] = _by_name(
            [*actions, None], [*start.actions, None], weights["action.weight"], own["action.weight"]
        )
        if "trait" in own:
            names = sorted({trait for item in traits for trait in item})
            weights["trait"] = _by_name(names, list(start.traits), weights["trait"], own["trait"])
    shapes, wanted = (
        {name: tuple(tensor.shape) for name, tensor in part.items()} for part in (weights, own)
    )
    theirs = start.codec
    if (
        shapes != wanted
        or len(theirs.window.mean) != len(codec.window.mean)
        or theirs.context_frames != codec.context_frames
    ):
        raise InputError(
            f"{path} has other sizes, actions or windows; give the same --flow "
            "settings, or leave initial out"
        )
    rotation = torch.from_numpy(codec.window.rotation_to(theirs.window).T.copy())
    changed = {"entry.weight": weights["entry.weight"] @ rotation} | {
        name: rotation.T @ weights[name] for name in ("exit.weight", "exit.bias")
    }
    network.load_state_dict(weights | changed)
    return WindowCodec(codec.window, theirs.context, codec.frames, codec.context_frames)


def stored_codec(content: Mapping[str, Any], features: int) -> WindowCodec:
    """Return the codec of a run's ``flow.pt``, with `features` numbers per frame."""
    return WindowCodec.from_arrays(
        {name: array.numpy() for name, array in content["codec"].items()}, features
    )


def _run(path: str, features: int) -> Start:
    content = read_checkpoint(path, ("averaged", "codec"))
    return Start(dict(content["averaged"]), stored_codec(content, features), None, None)


def _exported(path: str) -> Start:
    """Return an exported flow, with weights as rounded to bytes and halves, and codes of unit
    scale."""
    from onnx import numpy_helper

    proto, said = read_described(path)
    if said.get("format") != WINDOW_FORMAT:
        raise InputError(f"{path} is not a window flow of a2v; give a flow.pt or an exported flow")
    card = parse_card(said, Path(path))
    stored = {item.name: numpy_helper.to_array(item) for item in proto.graph.initializer}

    def read(name: str) -> FloatArray:
        if f"{name}_bytes" in stored:
            unpacked: FloatArray = (
                stored[f"{name}_bytes"].astype(np.float32) * stored[f"{name}_scale"]
            )
            return unpacked
        unpacked = (stored[f"{name}_half"] if f"{name}_half" in stored else stored[name]).astype(
            np.float32
        )
        return unpacked

    names = {
        name.removesuffix("_bytes").removesuffix("_half")
        for name in stored
        if name.startswith("network.") and not name.endswith("_scale")
    }
    weights = {name.removeprefix("network."): torch.from_numpy(read(name).copy()) for name in names}

    def code(mean: FloatArray, basis: FloatArray) -> LinearCode:
        return LinearCode(mean, basis, basis, np.ones(len(basis), np.float32))

    frames, context = int(said["window_frames"]), int(said["context_frames"])
    codec = WindowCodec(
        code(read("mean"), read("basis")),
        code(read("context_mean"), read("context_basis").T.copy()),
        frames,
        context,
    )
    traits = tuple(sorted({trait for own in card.traits for trait in own}))
    return Start(weights, codec, card.actions, traits)


def _by_name(
    wanted: Sequence[str | None], known: Sequence[str | None], rows: Tensor, own: Tensor
) -> Tensor:
    """Replace rows of `own` (len(wanted), C) by those of `rows` (len(known), C) with the same
    name."""
    made = own.clone()
    for at, name in enumerate(wanted):
        if name in known:
            made[at] = rows[known.index(name)]
    return made
