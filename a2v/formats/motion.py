"""Motions from files of other systems: BVH, DeepMimic's text and our own ``.npz``."""

from __future__ import annotations

import os
from pathlib import Path

from a2v.errors import InputError
from a2v.formats.bvh import read_bvh
from a2v.formats.deepmimic import read_deepmimic
from a2v.kinematics.resample import resample_motion
from a2v.types import Motion


def read_motion(path: str | os.PathLike[str], *, fps: float | None = None, action: str = "") -> Motion:
    """Read a motion by its file's suffix.

    Parameters
    ----------
    path : path
        ``.bvh`` (`read_bvh`), ``.npz`` (`Motion.save`) or ``.txt``/``.json`` (DeepMimic's ``Frames``).
    fps : float or None
        Resample to this rate; None keeps the file's.
    action : str
        Name to store where the file has none; the file's stem without it.

    Raises
    ------
    InputError
        Unknown suffix or unreadable file; the message names it (and the line, where the format has lines).
    """
    source = Path(path)
    suffix = source.suffix.lower()
    name = action or source.stem
    if suffix == ".bvh":
        return read_bvh(source, fps=fps, action=name)
    if suffix == ".npz":
        motion = Motion.load(source)
    elif suffix in (".txt", ".json"):
        motion = read_deepmimic(source, action=name)
    else:
        raise InputError(f"{source}: unknown kind of motion '{suffix or 'without suffix'}'; expected .bvh, .npz or DeepMimic's .txt")
    return motion if fps is None else resample_motion(motion, fps)
