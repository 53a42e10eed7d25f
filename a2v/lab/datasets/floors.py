"""A separate floor for each foot of a recording. Markers are placed differently on both feet, so
that one toe stands higher than the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.kinematics import Skeleton
from a2v.kinematics.limbs import bend_to, legs_of
from a2v.types import BoolArray, FloatArray

SLOW = 0.3
"""Speed below which a joint of a foot may stand, meters per second."""

NEAR = 0.05
"""Height over its own lowest level below which it may stand, meters."""

LEAST_FRAMES = 6
"""Smallest number of frames in which each foot must stand to determine the floors of a clip."""

MOST_APART = 0.025
"""Largest difference between the floors of a clip and those of its subject, meters. More is a step,
not a marker."""


def standing(points: FloatArray, fps: float) -> BoolArray:
    """Return the frames (T,) in which a joint (T, 3) of a foot stands, relative to its own lowest
    level; meters."""
    if len(points) < 2:
        return np.zeros(len(points), dtype=bool)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1) * fps
    slower = np.minimum(np.r_[steps[0], steps], np.r_[steps, steps[-1]])
    on: BoolArray = (slower < SLOW) & (points[:, 1] < np.quantile(points[:, 1], 0.05) + NEAR)
    return on


def floors_apart(joints: FloatArray, skeleton: Skeleton, fps: float) -> FloatArray:
    """Return how much higher the first leg's ankle and toe stand than the second's (2,), meters;
    NaN if one of them hardly stands.

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
    """Shift the feet of clips to the same height.

    Each joint of the higher foot is lowered by half the distance between the floors, and that of
    the lower foot is raised by the other half.

    Parameters
    ----------
    clips : sequence of (T, J, 3) float32
        Meters, y up.
    subjects : sequence of str
        Subject of each clip. A clip whose feet hardly stand, or stand on steps, is corrected like
        the other clips of its subject.
    skeleton : Skeleton
    fps : sequence of float
        Frame rate of each clip.

    Returns
    -------
    list of (T, J, 3) float32
        Bones keep their lengths; knees and ankles bend.
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
    """Lower ankle and toe of the first leg in joints (T, J, 3), and raise those of the second, by
    half of `apart` (2,)."""
    moved = joints.astype(np.float64)
    for (hip, knee, ankle, toe), sign in zip(legs_of(skeleton), (-0.5, 0.5), strict=True):
        foot = moved[:, toe] - moved[:, ankle]
        up = np.array([0.0, 1.0, 0.0])
        moved[:, knee], moved[:, ankle] = bend_to(
            moved[:, hip], moved[:, knee], moved[:, ankle], moved[:, ankle] + sign * apart[0] * up
        )
        # the foot turns about the ankle and keeps its length
        length = np.linalg.norm(foot, axis=-1, keepdims=True)
        way = foot + sign * (apart[1] - apart[0]) * up
        moved[:, toe] = moved[:, ankle] + way * length / np.maximum(
            np.linalg.norm(way, axis=-1, keepdims=True), 1e-9
        )
    return moved.astype(np.float32)
