"""Tables by which users say which bone is which joint: every bone of a file on a line, the joint
before it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from a2v.errors import InputError
from a2v.io import atomic_path, brief, read_bytes
from a2v.kinematics.names import REQUIRED, canonical_joints
from a2v.kinematics.understand import understand
from a2v.types import FloatArray

MAX_BYTES = 4 << 20
OTHERS = (
    *("spine1", "spine2", "spine3", "neck", "head", "head_top"),
    *(f"left_{joint}" for joint in ("collar", "foot", "toes", "hand", "thumb")),
    *(f"right_{joint}" for joint in ("collar", "foot", "toes", "hand", "thumb")),
)
"""Joints that help, but may be missing."""
_HEAD = f"""# Which bone is which joint: change the first column ("-": none). Lines may be left out.
# needed: {", ".join(REQUIRED)}
# may be: {", ".join(OTHERS)}
"""


def write_bone_map(
    path: str | os.PathLike[str],
    names: Sequence[str],
    parents: Sequence[int],
    heads: FloatArray,
) -> None:
    """Write the hierarchy of the bones with the best guess of their joints, ready to be edited;
    written atomically.

    Parameters
    ----------
    path : path
    names : B str
    parents : B ints
        -1 for roots; parents first.
    heads : (B, 3) float
        Heads at rest, any unit.
    """
    found = understand(names, parents, heads)
    joints = canonical_joints(names, list(parents)) if found is None else found.joints
    known = {bone: joint for joint, bone in joints.items() if joint in (*REQUIRED, *OTHERS)}
    children: dict[int, list[int]] = {}
    for bone, parent in enumerate(parents):
        children.setdefault(parent, []).append(bone)
    lines, stack = [], [(bone, 0) for bone in reversed(children.get(-1, []))]
    while stack:
        bone, depth = stack.pop()
        lines.append(f"{known.get(bone, '-'):15}| {'. ' * depth}{_one_line(names[bone])}")
        stack += [(child, depth + 1) for child in reversed(children.get(bone, []))]
    with atomic_path(path) as temporary:
        temporary.write_text(_HEAD + "\n".join(lines) + "\n", encoding="utf-8")


def read_bone_map(path: str | os.PathLike[str], names: Sequence[str]) -> dict[str, int]:
    """Return the bone of each joint that a table names.

    Raises
    ------
    InputError
        A line has no "|", an unknown joint or bone, or a joint is named twice; the message names
        the line.
    """
    source = Path(path)
    text = read_bytes(source, limit=MAX_BYTES).decode("utf-8-sig", "replace")
    places: dict[str, list[int]] = {}
    for bone, name in enumerate(names):
        places.setdefault(_one_line(name), []).append(bone)
    found: dict[str, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        joint, bar, name = line.partition("|")
        joint, name = joint.strip(), name.strip()
        while name.startswith(". "):
            name = name[2:]
        if not bar:
            raise InputError(f"{source}:{number}: {brief(line)} has no |; expected JOINT | BONE")
        if name not in places:
            raise InputError(f"{source}:{number}: there is no bone {brief(name)}")
        bone = places[name].pop(0) if len(places[name]) > 1 else places[name][0]
        if joint == "-":
            continue
        if joint not in (*REQUIRED, *OTHERS):
            raise InputError(
                f"{source}:{number}: unknown joint {brief(joint)}; expected - or one of "
                f"{', '.join((*REQUIRED, *OTHERS))}"
            )
        if joint in found:
            raise InputError(f"{source}:{number}: {joint} is named twice")
        found[joint] = bone
    return found


def _one_line(name: str) -> str:
    """Return a bone's name as a table can hold it."""
    return " ".join(name.split()) or "(nameless)"
