"""Guess what files of motions do not specify: whether the skeleton is a person's, its unit and its
upward axis."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.io import shorten
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.types import FloatArray

UNITS: dict[str, float] = {
    "meters": 1.0,
    "centimeters": 0.01,
    "millimeters": 0.001,
    "inches": 0.0254,
    "feet": 0.3048,
    "decimeters": 0.1,
    "CMU units": 0.0254 / 0.45,
}
"""Meters of one unit of length, by name; CMU's skeletons are in inches divided by 0.45."""


@dataclass
class Bone:
    """A bone of a file.

    Attributes
    ----------
    name : str
    parent : int
        -1 for the root; parents come first.
    line : int
        Of the file, from 1; 0 where files have no lines.
    """

    name: str
    parent: int
    line: int = 0

    def at(self, source: str) -> str:
        """Return the place in the file `source`, for messages."""
        return f"{source}:{self.line}" if self.line else source


def clip_number(source: str | os.PathLike[str], clip: str, count: int) -> int:
    """Return the number, from 0, by which `clip` names one of `count` motions; 0 without a name.

    Raises
    ------
    InputError
        There is no such motion.
    """
    if not clip:
        return 0
    if clip.isdecimal() and len(clip) < 8 and int(clip) < count:
        return int(clip)
    there = f"{count} motions: choose 0 to {count - 1}" if count > 1 else "one motion: leave it out"
    raise InputError(f"{source} has no motion '{shorten(clip)}'; it has {there}")


def demand_person(
    source: str, bones: Sequence[Bone], canonical: dict[str, int], names: Sequence[str]
) -> None:
    """Refuse a skeleton without the joints of a person.

    Parameters
    ----------
    source : str
        Name of the file in messages.
    bones : sequence of Bone
        All of the file.
    canonical : dict of str to int
        Result of `canonical_joints` for `names`.
    names : sequence of str
        Joints that stand apart from their parent.

    Raises
    ------
    InputError
        It names the file, the line and the joint.
    """
    missing = missing_joints(canonical)
    if not missing:
        return
    # the missing joint may have a known name, but be merged because its bone has no length
    every = canonical_joints([bone.name for bone in bones], [bone.parent for bone in bones])
    for name in missing:
        if name in every:
            bone = bones[every[name]]
            raise InputError(
                f"{bone.at(source)}: joint '{bone.name}' ({name.replace('_', ' ')}) has a bone of "
                "zero length"
            )
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    if {"left_wrist", "right_wrist"} <= set(every) and not any(
        f"{side}_{joint}" in every
        for side in ("left", "right")
        for joint in ("hip", "knee", "ankle")
    ):
        raise InputError(
            f"{bones[0].at(source)}: the skeleton is an upper body: no hips, knees or "
            "ankles; expected a whole person: export the motion with its legs"
        )
    raise InputError(
        f"{bones[0].at(source)}: unknown joints: no "
        f"{', '.join(name.replace('_', ' ') for name in missing[:4])}"
        f"{' ...' if len(missing) > 4 else ''} among {listed}; rename them to Mixamo's, CMU's or "
        "SMPL's names, or name them with --motion-bone-map FILE, which writes the table first"
    )


def demand_limbs(
    source: str, bones: Sequence[Bone], local: FloatArray, canonical: dict[str, int]
) -> None:
    """Refuse arms and legs without a length, and bones of impossible proportions.

    Parameters
    ----------
    source : str
        Name of the file in messages.
    bones : sequence of J Bone
        Joints that stand apart from their parent.
    local : (T, J, 3) float
        Positions of the joints in their parents, the file's units.
    canonical : dict of str to int
        Indices into `bones` (`canonical_joints`).

    Raises
    ------
    InputError
        It names the file, the line and the joint.
    """
    length = np.linalg.norm(np.median(local, axis=0), axis=-1)
    limbs = [
        canonical[f"{side}_{joint}"]
        for side in ("left", "right")
        for joint in ("knee", "ankle", "elbow", "wrist")
    ]
    middle = float(np.median(length[limbs]))
    for index in limbs:
        if length[index] < 0.02 * middle:
            bone = bones[index]
            raise InputError(
                f"{bone.at(source)}: joint '{bone.name}' has a bone of (nearly) zero length"
            )
    for index, bone in enumerate(bones):
        if index and length[index] > 20 * middle:
            raise InputError(
                f"{bone.at(source)}: the bone of '{bone.name}' is "
                f"{length[index] / middle:.0f} times as long as a limb"
            )


def choose_scale(
    source: str,
    offsets: FloatArray,
    parents: Sequence[int],
    canonical: dict[str, int],
    units: str | float | None,
    person: bool,
) -> tuple[float, str]:
    """Choose the meters per unit of the file, and the name of the unit.

    Parameters
    ----------
    source : str
        Name of the file in messages.
    offsets : (J, 3) float
        Bones at rest, the file's units.
    parents : sequence of J int
    canonical : dict of str to int
        `canonical_joints`.
    units : name in `UNITS`, meters per unit, or None
        None: the unit that gives the person a plausible height.
    person : bool
        Whether the skeleton is known to be a person's; its height must then be plausible.

    Raises
    ------
    InputError
        Unknown or unusable units, or a skeleton without a size.
    """
    if isinstance(units, str):
        if units not in UNITS:
            raise InputError(f"unknown units '{units}'; choose from {', '.join(UNITS)}")
        return UNITS[units], units
    if units is not None:
        if not (math.isfinite(units) and units > 0):
            raise InputError(f"units is {units}; expected meters per unit, a positive number")
        return float(units), "given"
    height = _height(offsets, parents, canonical)
    if height <= 0:
        raise InputError(f"{source}: the skeleton has no size; its bones have zero length")
    if not person:
        likely = {
            name: abs(math.log(height * meters / TYPICAL_HEIGHT)) for name, meters in UNITS.items()
        }
        best = min(likely, key=likely.__getitem__)
        return UNITS[best], best
    likely = {
        name: abs(math.log(height * meters / 1.65))
        for name, meters in UNITS.items()
        if 0.9 <= height * meters <= 2.4
    }
    if not likely:
        return (
            TYPICAL_HEIGHT / height,
            f"unknown: a height of {height:.4g} scaled to {TYPICAL_HEIGHT:g} m",
        )
    best = min(likely, key=likely.__getitem__)
    return UNITS[best], best


def _height(offsets: FloatArray, parents: Sequence[int], canonical: dict[str, int]) -> float:
    """Rough height of the person in the file's units, from bone lengths."""
    length = np.linalg.norm(offsets, axis=-1)

    def reach(joint: int, start: int) -> float:
        total = 0.0
        while joint not in (start, -1, 0):
            total += float(length[joint])
            joint = int(parents[joint])
        return total

    legs = [
        reach(canonical[f"{s}_ankle"], canonical[f"{s}_hip"])
        for s in ("left", "right")
        if {f"{s}_ankle", f"{s}_hip"} <= set(canonical)
    ]
    top = canonical.get("head", canonical.get("neck", canonical.get("left_shoulder", 0)))
    trunk = reach(top, canonical.get("pelvis", 0))
    return (float(np.mean(legs)) + trunk) * 1.17 if legs else float(length.sum())


def guess_up_axis(
    offsets: FloatArray, parents: Sequence[int], canonical: dict[str, int], joints: FloatArray
) -> str:
    """Guess the upward axis, "x" to "-z": that of the rest pose, unless the person stands along
    another axis in the motion.

    Parameters
    ----------
    offsets : (J, 3) float
        Bones at rest.
    parents : sequence of J int
    canonical : dict of str to int
        `canonical_joints`.
    joints : (T, J, 3) float
        Positions, any unit.
    """
    top = canonical.get("head", canonical.get("neck"))
    if top is None or "left_ankle" not in canonical or "right_ankle" not in canonical:
        return "y"
    rest = np.zeros_like(offsets)
    for j in range(1, len(offsets)):
        rest[j] = rest[parents[j]] + offsets[j]
    feet = [canonical["left_ankle"], canonical["right_ankle"]]
    standing = rest[top] - rest[feet].mean(0)
    moving = np.mean(joints[:, top] - joints[:, feet].mean(1), axis=0)
    size = float(np.linalg.norm(standing)) or 1.0
    in_rest, in_motion = int(np.argmax(np.abs(standing))), int(np.argmax(np.abs(moving)))
    upright = abs(moving[in_motion]) > 0.75 * size
    # A person who lies down also points along another axis, but then the pelvis is not a leg's
    # length above zero along it.
    legs = float(np.linalg.norm(rest[feet].mean(0)))
    high = float(np.median(joints[:, 0, in_motion])) * np.sign(moving[in_motion])
    if in_rest != in_motion and upright and 0.6 * legs < high < 1.5 * legs:
        axis, sign = in_motion, np.sign(moving[in_motion])
    elif abs(standing[in_rest]) > 0.5 * size:
        axis, sign = in_rest, np.sign(standing[in_rest])
        if in_rest == in_motion and upright and not _on_hands(joints[..., in_rest] * sign, legs):
            sign = np.sign(moving[in_motion])  # the root turns the whole rest pose
    else:
        axis, sign = (in_motion, np.sign(moving[in_motion])) if upright else (1, 1.0)
    return ("" if sign > 0 else "-") + "xyz"[axis]


def _on_hands(heights: FloatArray, leg: float) -> bool:
    """Whether a person upside down is in a handstand: `heights` (T, J) of the joints along the rest
    pose's upward axis have the pelvis, the first, well above zero and the lowest near zero."""
    pelvis, lowest = np.median(heights[:, 0]), np.median(heights.min(axis=1))
    return bool(pelvis > 0.6 * leg and abs(lowest) < 0.4 * leg)


def y_up_rotmat(axis: str) -> FloatArray:
    """Rotation (3, 3) float64 that takes `axis` to +y; z up turns about x, so that -y becomes +z
    (front in z-up systems).

    Raises
    ------
    InputError
        `axis` is not one of x, y, z, -x, -y, -z.
    """
    table: dict[str, list[list[int]]] = {
        "y": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        "x": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
        "-y": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
        "-z": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        "-x": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]],
    }
    if axis not in table:
        raise InputError(f"unknown up axis '{axis}'; choose from {', '.join(table)}")
    return np.asarray(table[axis], dtype=np.float64)
