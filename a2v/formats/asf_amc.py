"""Acclaim's ASF (a skeleton) and AMC (its motion), the formats of the recordings of the CMU
database.

A bone's rotation from rest is ``C M C^-1`` after its parent's. C turns the world's axes to the
bone's (``axis``), and M is the frame's rotation in these. Both have Euler angles about x first,
then y, then z. Positions are in inches over the file's ``length``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.io import shorten
from a2v.kinematics import rotvec_to_rotmat, skeleton_from_parents
from a2v.kinematics.from_joints import motion_of_joints
from a2v.types import FloatArray, Motion

METRES_PER_INCH = 0.0254
MAX_BONES = 200
"""Largest number of bones in a file."""
MAX_FRAMES = 200_000
"""Largest number of frames in a file."""


@dataclass(frozen=True)
class Bone:
    """A bone of an ASF file: its direction at rest, length (the file's unit), axes (degrees) and
    the rotations in a frame."""

    name: str
    direction: FloatArray
    length: float
    axis: FloatArray
    dof: tuple[str, ...]
    parent: int = -1


@dataclass(frozen=True)
class AsfSkeleton:
    """The bones of an ASF file, parents first, and the meters per unit; parent -1 is the root."""

    bones: tuple[Bone, ...]
    meters: float
    root_order: tuple[str, ...]


def parse_asf(text: str, source: str) -> AsfSkeleton:
    """Read a skeleton; `source` is its name in messages.

    Raises
    ------
    InputError
        The text is not an ASF, or a bone is damaged.
    """
    sections: dict[str, list[list[str]]] = {}
    current: list[list[str]] = []
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if words and words[0].startswith(":"):
            current = sections.setdefault(words[0][1:].lower(), [])
        elif words:
            current.append(words)
    if not {"root", "bonedata", "hierarchy"} <= set(sections):
        raise InputError(
            f"{source}: expected the sections :root, :bonedata and :hierarchy of an ASF file"
        )
    try:
        units = {
            words[0].lower(): words[1] for words in sections.get("units", []) if len(words) > 1
        }
        meters = METRES_PER_INCH / float(units.get("length", 1.0))
        radians = units.get("angle", "deg").lower().startswith("rad")
        root = {words[0].lower(): words[1:] for words in sections["root"]}
        bones = _bones(sections["bonedata"], radians)
        return AsfSkeleton(
            _in_order(sections["hierarchy"], bones),
            meters,
            tuple(word.lower() for word in root["order"]),
        )
    except (KeyError, ValueError, IndexError, ZeroDivisionError) as error:
        raise InputError(
            f"{source}: a part of the skeleton is damaged ({shorten(error, 80)})"
        ) from None


def _bones(lines: list[list[str]], radians: bool) -> dict[str, Bone]:
    bones: dict[str, Bone] = {}
    facts: dict[str, list[str]] = {}
    for words in lines:
        if words[0] == "begin":
            facts = {}
        elif words[0] == "end":
            axis = np.array([float(value) for value in facts["axis"][:3]])
            bones[facts["name"][0]] = Bone(
                facts["name"][0],
                np.array([float(value) for value in facts["direction"]]),
                float(facts["length"][0]),
                np.degrees(axis) if radians else axis,
                tuple(word.lower() for word in facts.get("dof", ())),
            )
        else:
            facts[words[0].lower()] = words[1:]
    if not 1 <= len(bones) <= MAX_BONES:
        raise ValueError(f"{len(bones)} bones")
    return bones


def _in_order(lines: list[list[str]], bones: dict[str, Bone]) -> tuple[Bone, ...]:
    """Return the bones, parents first, each with the position of its parent."""
    children = {words[0]: words[1:] for words in lines if words[0] not in ("begin", "end")}
    found: list[Bone] = []
    waiting = [(name, -1) for name in children["root"]]
    while waiting:
        name, parent = waiting.pop(0)
        if len(found) >= len(bones):
            raise ValueError("a bone has two parents")
        bone = bones[name]
        found.append(Bone(bone.name, bone.direction, bone.length, bone.axis, bone.dof, parent))
        waiting += [(child, len(found) - 1) for child in children.get(name, [])]
    return tuple(found)


def read_amc(
    amc: str, asf: str, *, fps: float = 120.0, action: str = "", name: str = "AMC text"
) -> Motion:
    """Read a recording together with its skeleton.

    Parameters
    ----------
    amc, asf : str
        Contents of the two files.
    fps : float
        AMC files do not hold a frame rate. Most of CMU's have 120, some 60.
    action : str
    name : str
        Name in messages.

    Returns
    -------
    Motion
        Meters, y up. There is a joint at the end of each bone whose length is not zero. It has
        the name of the bone that begins there.

    Raises
    ------
    InputError
        A file is damaged, or the two files do not belong together.
    """
    skeleton = parse_asf(asf, f"{name}'s skeleton")
    values = _frames(amc, skeleton, name)
    order = skeleton.root_order
    root = values["root"]
    place = {word: root[:, at] for at, word in enumerate(order)}
    origin = np.stack([place[word] for word in ("tx", "ty", "tz")], axis=-1)
    turned = _euler(np.stack([place[word] for word in ("rx", "ry", "rz")], axis=-1))
    rotmats: list[FloatArray] = []
    tails: list[FloatArray] = []
    for bone in skeleton.bones:
        axes = _euler(bone.axis[None])[0]
        angles = np.zeros((len(root), 3))
        for at, word in enumerate(bone.dof):
            if word in ("rx", "ry", "rz"):
                angles[:, "xyz".index(word[1])] = values[bone.name][:, at]
        before = turned if bone.parent < 0 else rotmats[bone.parent]
        rotmats.append(before @ axes @ _euler(angles) @ axes.T)
        start = origin if bone.parent < 0 else tails[bone.parent]
        tails.append(start + rotmats[-1] @ (bone.direction * bone.length))
    return _motion(skeleton, origin, tails, fps, action)


def _motion(
    skeleton: AsfSkeleton, origin: FloatArray, tails: list[FloatArray], fps: float, action: str
) -> Motion:
    bones = skeleton.bones
    children = [
        [child for child in range(len(bones)) if bones[child].parent == at]
        for at in range(len(bones))
    ]
    kept = [at for at, bone in enumerate(bones) if bone.length > 1e-6]
    place = {at: joint for joint, at in enumerate(kept, 1)}
    parents, names, rest = [-1], ["root"], [np.zeros(3)]
    for at in kept:
        above = bones[at].parent
        while above >= 0 and above not in place:
            above = bones[above].parent
        parents.append(place.get(above, 0))
        below = [bones[child].name for child in children[at] if bones[child].length > 1e-6]
        central = [child for child in below if child.endswith("neck")]
        names.append(
            "neck" if central and len(below) > 1 else below[0] if below else f"{bones[at].name}_end"
        )
        rest.append(bones[at].direction * bones[at].length * skeleton.meters)
    joints = np.stack([origin, *(tails[at] for at in kept)], axis=1) * skeleton.meters
    offsets = np.stack(rest)
    tree = skeleton_from_parents(parents, names, offsets)
    return motion_of_joints(joints, tree, float(fps), action=action, rest_offsets=offsets)


def _frames(text: str, skeleton: AsfSkeleton, source: str) -> dict[str, FloatArray]:
    """Return the numbers (T, D) of each bone."""
    widths = {"root": len(skeleton.root_order)} | {
        bone.name: len(bone.dof) for bone in skeleton.bones if bone.dof
    }
    found: dict[str, list[list[float]]] = {name: [] for name in widths}
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith(("#", ":")) or words[0].isdigit():
            continue
        try:
            numbers = [float(word) for word in words[1:]]
            if len(numbers) != widths[words[0]]:
                raise ValueError(f"{len(numbers)} numbers")
        except (ValueError, KeyError):
            raise InputError(
                f"{source}:{number}: expected a bone of the skeleton with its numbers, found "
                f"'{shorten(line, 60)}'"
            ) from None
        found[words[0]].append(numbers)
    counts = {len(rows) for rows in found.values()}
    if len(counts) != 1 or not 1 <= (frames := counts.pop()) <= MAX_FRAMES:
        raise InputError(
            f"{source}: bones have different numbers of frames, or none; the file is truncated"
        )
    arrays = {name: np.array(rows, np.float64).reshape(frames, -1) for name, rows in found.items()}
    if not all(np.isfinite(array).all() for array in arrays.values()):
        raise InputError(f"{source}: a number is not finite")
    return arrays


def _euler(degrees: FloatArray) -> FloatArray:
    """Return rotations (T, 3, 3) about x, then y, then z by angles (T, 3), degrees."""
    turns = [rotvec_to_rotmat(np.radians(degrees[:, at, None]) * np.eye(3)[at]) for at in range(3)]
    whole: FloatArray = turns[2] @ turns[1] @ turns[0]
    return whole
