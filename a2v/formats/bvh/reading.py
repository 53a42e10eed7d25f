"""Read BVH: convert the file's transforms to the world, with our axes and unit."""

from __future__ import annotations

import dataclasses
import os

import numpy as np

from a2v.formats.bvh.parsing import POSITION_AXES, ROTATION_AXES, BvhFile, parse_bvh
from a2v.formats.recording import Recording, motion_of
from a2v.io import read_bytes, reading
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.resample import resample_motion
from a2v.types import FloatArray, Motion

MAX_BYTES = 512 << 20


def read_bvh(
    path: str | os.PathLike[str] | bytes,
    *,
    fps: float | None = None,
    units: str | float | None = None,
    up: str | None = None,
    person: bool = True,
    action: str = "",
    name: str = "BVH text",
) -> Motion:
    """Read a BVH file.

    Channels and rotations may have any order. Position channels on any joint replace its OFFSET, as
    in Blender and MotionBuilder. End Sites become joints ``<parent>_end``. Joints at the place of
    their parent (zero offset, such as CMU's ``LHipJoint``) are merged into it. A root that carries
    only the pelvis (MotionBuilder's ``Reference``) becomes part of the pelvis's path.
    ``motion.provenance["notes"]`` lists what was read although it breaks the format (`parse_bvh`).

    Parameters
    ----------
    path : path, or the text or bytes of a file
    fps : float or None
        Resample to this rate (`resample_motion`); None keeps the file's.
    units : name in `UNITS`, meters per unit, or None
        None guesses from the person's height; ``motion.provenance["units"]`` and ``["scale"]``
        contain the choice.
    up : {"x", "y", "z", "-x", "-y", "-z"} or None
        The file's upward axis; None guesses (see ``provenance["up"]``).
    person : bool
        Require the joints of a person in a known naming scheme (`canonical_joints`); False accepts
        any skeleton.
    action : str
        Stored in the motion.
    name : str
        Name of text or bytes in messages.

    Returns
    -------
    Motion
        Meters, y up. Rotations are in the chain convention and keep the file's twists about the
        bones.

    Raises
    ------
    InputError
        The file is missing, empty, truncated, inconsistent, not finite, of absurd size or not a
        person; the message names the file and the line.
    """
    recording = read_bvh_bones(path, name=name)
    motion = motion_of(recording, units=units, up=up, person=person, action=action)
    return motion if fps is None else resample_motion(motion, fps)


def read_bvh_bones(path: str | os.PathLike[str] | bytes, *, name: str = "BVH text") -> Recording:
    """Read the moving bones of a BVH file, in its axes and units; see `read_bvh`."""
    text, source = _read_text(path, name)
    with reading(source, "BVH file that can be read"):
        file, dropped = _without_rest_frame(parse_bvh(text, source))
    local, world, rotmats = _transforms(file)
    return Recording(
        source=source,
        bones=file.nodes,
        local=local,
        world=world,
        rotmats=rotmats,
        fps=_fps(file.frame_time),
        notes=file.notes,
        facts={"dropped_rest_frame": dropped},
    )


def _read_text(path: str | os.PathLike[str] | bytes, name: str) -> tuple[str, str]:
    if isinstance(path, bytes):
        return _decode(path), name
    if isinstance(path, str) and ("\n" in path or path.lstrip().startswith("HIERARCHY")):
        return path, name
    return _decode(read_bytes(path, limit=MAX_BYTES, empty=True)), os.fspath(path)


def _decode(data: bytes) -> str:
    """Decode a file: UTF-8, with or without a byte-order mark, else Latin-1, which accepts every
    byte."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _transforms(file: BvhFile) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions of every joint in its parent (T, N, 3), in the world (T, N, 3), and world rotations
    (T, N, 3, 3); the file's units and axes."""
    local, turned = _local_transforms(file)
    world, rotmats = np.zeros_like(local), np.zeros_like(turned)
    for j, node in enumerate(file.nodes):
        if node.parent < 0:
            world[:, j], rotmats[:, j] = local[:, j], turned[:, j]
        else:
            before = rotmats[:, node.parent]
            world[:, j] = world[:, node.parent] + np.einsum("tij,tj->ti", before, local[:, j])
            rotmats[:, j] = before @ turned[:, j]
    return local, world, rotmats


def _local_transforms(file: BvhFile) -> tuple[FloatArray, FloatArray]:
    """Translations (T, N, 3) and rotations (T, N, 3, 3) of every joint in its parent."""
    frames, n = len(file.values), len(file.nodes)
    local = np.zeros((frames, n, 3))
    rotmats = np.tile(np.eye(3), (frames, n, 1, 1))
    for j, node in enumerate(file.nodes):
        local[:, j] = node.offset if node.offset is not None else 0.0
        for place, channel in enumerate(node.channels or ()):
            values = file.values[:, node.first + place]
            if channel in POSITION_AXES:
                local[:, j, POSITION_AXES[channel]] = values
            else:
                axis = np.zeros((frames, 3))
                axis[:, ROTATION_AXES[channel]] = np.deg2rad(values)
                rotmats[:, j] = rotmats[:, j] @ rotvec_to_rotmat(axis)
    return local, rotmats


def _fps(frame_time: float) -> float:
    """Frames per second; files give the usual rates with few digits (.0083333 is 120)."""
    fps = 1.0 / frame_time
    return float(round(fps)) if round(fps) and abs(fps / round(fps) - 1) < 2e-4 else fps


def _without_rest_frame(file: BvhFile) -> tuple[BvhFile, bool]:
    """Drop the first frame if it is the rest pose; return the file and whether it was dropped.
    CMU's conversions start with a T-pose."""
    columns = [
        node.first + place
        for node in file.nodes
        for place, name in enumerate(node.channels or ())
        if name in ROTATION_AXES
    ]
    values = file.values
    if len(values) > 2 and columns:  # nearly all zeros, and a jump to the next frame
        steps = np.abs((np.diff(values[:3, columns], axis=0) + 180) % 360 - 180).max(axis=1)
        if (values[0, columns] == 0).mean() > 0.8 and steps[0] > max(25.0, 4 * steps[1]):
            return dataclasses.replace(file, values=values[1:]), True
    return file, False
