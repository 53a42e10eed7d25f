"""Body parts: a coarse label for every vertex, from the bones that move it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.errors import InputError
from a2v.types import BoolArray, FloatArray, IntArray

PARTS: tuple[str, ...] = (
    "head",
    "neck",
    "torso",
    "left_upper_arm",
    "left_lower_arm",
    "left_hand",
    "right_upper_arm",
    "right_lower_arm",
    "right_hand",
    "left_thigh",
    "left_shin",
    "left_foot",
    "right_thigh",
    "right_shin",
    "right_foot",
)
"""Names of the parts; `Body.parts` indexes into them."""

PART_NEIGHBORS: tuple[tuple[str, str], ...] = (
    ("head", "neck"),
    ("neck", "torso"),
    *((f"{side}_upper_arm", "torso") for side in ("left", "right")),
    *((f"{side}_upper_arm", f"{side}_lower_arm") for side in ("left", "right")),
    *((f"{side}_lower_arm", f"{side}_hand") for side in ("left", "right")),
    *((f"{side}_thigh", "torso") for side in ("left", "right")),
    *((f"{side}_thigh", f"{side}_shin") for side in ("left", "right")),
    *((f"{side}_shin", f"{side}_foot") for side in ("left", "right")),
)
"""Pairs of parts that are joined."""

_STEMS = {
    "head": "head",
    "jaw": "head",
    "eye": "head",
    "neck": "neck",
    "root": "torso",
    "pelvis": "torso",
    "spine": "torso",
    "clavicle": "torso",
    "shoulder": "torso",
    "upperarm": "upper_arm",
    "lowerarm": "lower_arm",
    "wrist": "hand",
    "finger": "hand",
    "metacarpal": "hand",
    "upperleg": "thigh",
    "lowerleg": "shin",
    "foot": "foot",
    "toe": "foot",
}


# SMPL's names have the side in front
_JOINT_STEMS = {
    "hip": "thigh",
    "knee": "shin",
    "ankle": "foot",
    "foot": "foot",
    "collar": "torso",
    "shoulder": "upper_arm",
    "elbow": "lower_arm",
    "wrist": "hand",
    "hand": "hand",
    "index": "hand",
    "middle": "hand",
    "pinky": "hand",
    "ring": "hand",
    "thumb": "hand",
    "eye": "head",
}


def part_of_bone(name: str) -> int:
    """Index into `PARTS` of the bone `name` of Anny, or of the joint of that name of the SMPL
    family.

    Raises
    ------
    InputError
        No rule for that name.
    """
    stem, _, letter = name.partition(".")
    side, stems = "left" if letter == "L" else "right", _STEMS
    if name.startswith(("left_", "right_")):
        (side, _, stem), stems = name.partition("_"), _JOINT_STEMS
    for start, part in stems.items():
        if stem.startswith(start):
            full = f"{side}_{part}"
            return PARTS.index(full if full in PARTS else part)
    raise InputError(
        f"bone '{name}' belongs to no known body part; expected names that start with "
        f"{', '.join(_STEMS)}"
    )


def parts_of_bones(bone_names: Sequence[str], weights: FloatArray) -> IntArray:
    """Return the part (V,) int8 of each vertex: that with the largest sum of weights (V, B)."""
    of_bone = np.array([part_of_bone(name) for name in bone_names])
    held = np.stack([weights[:, of_bone == part].sum(axis=1) for part in range(len(PARTS))], axis=1)
    parts: IntArray = held.argmax(axis=1).astype(np.int8)
    return parts


def on_parts(parts: IntArray, *names: str) -> BoolArray:
    """Return a mask (V,) of the points on the named parts.

    `parts` (V,) are indices into `PARTS`.
    """
    return np.asarray(np.isin(parts, [PARTS.index(name) for name in names]))
