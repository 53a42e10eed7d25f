"""Reading the checkpoints of PIFu and PIFuHD: tensors and plain values only, key by key."""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.io import shorten
from a2v.lab.checkpoints import load_tensors

State = Mapping[str, Tensor]


def read_state(path: str | Path, *, inside: str = "") -> dict[str, Tensor]:
    """Read the named tensors of a checkpoint as float32; only tensors, plain values and lists of
    options are unpickled.

    Parameters
    ----------
    inside : str
        The entry with the tensors; "" if the file has only tensors.

    Raises
    ------
    InputError
        The file is missing, holds code, is damaged, or lacks the entry.
    """
    try:
        with torch.serialization.safe_globals(
            [argparse.Namespace]
        ):  # PIFuHD stores its command line beside the weights
            content: Any = load_tensors(path)
    except InputError:
        raise
    # torch raises many kinds of errors for a file that it cannot or refuses to read
    except Exception:
        raise InputError(
            f"{path} cannot be read as a checkpoint: it is damaged, or holds more "
            "than tensors and plain values"
        ) from None
    if inside:
        content = content.get(inside) if isinstance(content, dict) else None
    if (
        not isinstance(content, dict)
        or not content
        or not all(isinstance(value, Tensor) for value in content.values())
    ):
        raise InputError(
            f"{path} holds no named tensors{f' under {inside!r}' if inside else ''}; "
            "is it another network's checkpoint?"
        )
    state = {str(name).removeprefix("module."): value for name, value in content.items()}
    return {
        name: value.float() if value.is_floating_point() else value for name, value in state.items()
    }


def part(state: State, prefix: str) -> dict[str, Tensor]:
    """Return the tensors whose names begin with `prefix`, by their names without it."""
    return {name[len(prefix) :]: value for name, value in state.items() if name.startswith(prefix)}


def numbers(state: State, pattern: str) -> list[int]:
    """Return the sorted distinct numbers that the group of `pattern` matches at the beginning of
    names."""
    return sorted({int(found[1]) for name in state if (found := re.match(pattern, name))})


def channels(state: State, name: str, axis: int) -> int:
    """Return the size of a tensor along an axis.

    Raises
    ------
    InputError
        It is missing or has no such axis.
    """
    if name not in state or state[name].ndim <= axis:
        raise InputError(f"the checkpoint lacks '{name}'; is it another network's?")
    return int(state[name].shape[axis])


def fill(module: nn.Module, state: State, what: str) -> None:
    """Set all tensors of a network, and check that all tensors of the file are used.

    Raises
    ------
    InputError
        A tensor is missing, has another shape, or belongs to no part of the network; the first is
        named.
    """
    wanted = {name: tuple(value.shape) for name, value in module.state_dict().items()}
    for name, shape in wanted.items():
        if name not in state:
            raise InputError(f"{what} lacks '{name}'; is it another network's checkpoint?")
        if tuple(state[name].shape) != shape:
            raise InputError(
                f"{what}: '{name}' has shape {tuple(state[name].shape)}; expected {shape}"
            )
        if not bool(torch.isfinite(state[name]).all()):
            raise InputError(f"{what}: '{name}' holds NaN or infinity")
    if unknown := sorted(set(state) - set(wanted)):
        raise InputError(
            f"{what} has '{shorten(unknown[0], 80)}', which this network does not "
            "have; is it another network's checkpoint?"
        )
    module.load_state_dict(dict(state), assign=True)
    module.eval()
