"""Each foot of a recording on its own floor: markers were not put on both feet alike, so that one
toe stands higher than the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.kinematics import Skeleton
from a2v.kinematics.limbs import bend_to, legs_of
from a2v.types import BoolArray, FloatArray

SLOW = 0.3
"""Meters a second under which a joint of a foot may stand."""

NEAR = 0.05
"""Meters over its own lowest level under which it may stand."""

LEAST_FRAMES = 6
"""Frames in which each foot stands, at least, for a clip to say how high its floors are."""

MOST_APART = 0.025
"""Meters by which a clip's floors may lie apart otherwise than its subject's do: more is a step,
not a marker."""


def standing(points: FloatArray, fps: float) -> BoolArray:
    """Frames (T,) in which a joint (T, 3) of a foot stands, by its own lowest level; meters."""
    if len(points) < 2:
        return np.zeros(len(points), dtype=bool)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1) * fps
    slower = np.minimum(np.r_[steps[0], steps], np.r_[steps, steps[-1]])
    on: BoolArray = (slower < SLOW) & (points[:, 1] < np.quantile(points[:, 1], 0.05) + NEAR)
    return on


def floors_apart(joints: FloatArray, skeleton: Skeleton, fps: float) -> FloatArray:
    """How much higher the first leg's ankle and toe stand than the second's (2,), meters; NaN where
    one of them hardly stands.

    Parameters
    ----------
    joints : (T, J, 3) float
        Meters, y up.
    """
    first, second = legs_of(skeleton)
    apart = np.full(2, np.nan)
    for part in (0, 1):
        feet = [joints[:, leg[2 + part]] for leg in (first, second)]
        on = [standing(foot, fps) for foot in feet]
        if min(int(flags.sum()) for flags in on) >= LEAST_FRAMES:
            levels = [
                float(np.median(foot[flags, 1])) for foot, flags in zip(feet, on, strict=True)
            ]
            apart[part] = levels[0] - levels[1]
    return apart


def level_feet(
    clips: Sequence[FloatArray], subjects: Sequence[str], skeleton: Skeleton, fps: Sequence[float]
) -> list[FloatArray]:
    """Clips whose feet stand equally high: of each joint of a foot, half of what lies between the
    floors is taken from one side and half given to the other.

    Parameters
    ----------
    clips : sequence of (T, J, 3) float32
        Meters, y up.
    subjects : sequence of str
        Of each clip: a clip whose feet hardly stand, or stand on steps, is levelled as its
        subject's others are.
    skeleton : Skeleton
    fps : sequence of float
        Of each clip.

    Returns
    -------
    list of (T, J, 3) float32
        Bones keep their lengths, knees and ankles give way.
    """
    apart = np.array(
        [floors_apart(clip, skeleton, rate) for clip, rate in zip(clips, fps, strict=True)]
    )
    owner = np.array(subjects)
    usual = {}
    for subject in set(subjects):
        known = apart[owner == subject]
        usual[subject] = np.array(
            [
                np.median(column[np.isfinite(column)]) if np.isfinite(column).any() else 0.0
                for column in known.T
            ]
        )
    levelled = []
    for clip, own, subject in zip(clips, apart, subjects, strict=True):
        trusted = np.isfinite(own) & (np.abs(np.nan_to_num(own) - usual[subject]) < MOST_APART)
        levelled.append(_shifted(clip, skeleton, np.where(trusted, own, usual[subject])))
    return levelled


def _shifted(joints: FloatArray, skeleton: Skeleton, apart: FloatArray) -> FloatArray:
    """Joints (T, J, 3) with the ankle and the toe of the first leg lowered, and those of the second
    raised, by half of `apart` (2,)."""
    moved = joints.astype(np.float64)
    for (hip, knee, ankle, toe), sign in zip(legs_of(skeleton), (-0.5, 0.5), strict=True):
        foot = moved[:, toe] - moved[:, ankle]
        up = np.array([0.0, 1.0, 0.0])
        moved[:, knee], moved[:, ankle] = bend_to(
            moved[:, hip], moved[:, knee], moved[:, ankle], moved[:, ankle] + sign * apart[0] * up
        )
        # the foot turns about the ankle, at its length
        length = np.linalg.norm(foot, axis=-1, keepdims=True)
        way = foot + sign * (apart[1] - apart[0]) * up
        moved[:, toe] = moved[:, ankle] + way * length / np.maximum(
            np.linalg.norm(way, axis=-1, keepdims=True), 1e-9
        )
    return moved.astype(np.float32)
