"""Apply a user's corrections to landmarks and mask. Positions are in pixels of the same picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from a2v.kinematics import best_scale
from a2v.kinematics.names import LANDMARK_INDEX, LIMB_BONES, LIMBS_BY_HEIGHT
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.perception.corrections import WAYS, Corrections, Stroke
from a2v.types import BoolArray, FloatArray

_NEAR = 0.05
"""A landmark that is moved by less keeps its depth; fraction of the person's height."""
_ALONG = {
    f"{side}_{joint}": tuple(f"{side}_{name}" for name in names)
    for side in ("left", "right")
    for joint, names in {
        "wrist": ("pinky", "index", "thumb"),
        "ankle": ("heel", "foot_index"),
    }.items()
}
"""Landmarks of a hand or a foot, which move along with its joint."""
_LEAST_DEPTH = 0.35
"""Least difference in depth between the ends of a limb whose side is given, as a fraction of its
length."""
_CORE = 0.7
"""Part of a stroke's radius within which the mask is certain; between it and the radius the photo's
edges count too."""


def draw_strokes(mask: FloatArray, strokes: Sequence[Stroke], *, core: bool = False) -> FloatArray:
    """Draw strokes, in pixels of the mask, into the mask (H, W) float32; with `core` only their
    inner part."""
    import cv2

    if not strokes:
        return mask
    drawn = mask
    for stroke in strokes:
        touched = np.zeros(mask.shape, np.uint8)
        radius = max(0.5, stroke.radius * (_CORE if core else 1.0))
        points = np.clip(np.round(np.array(stroke.points) * 8), -(2**28), 2**28).astype(np.int32)
        cv2.polylines(
            touched,
            [points[:, None]],
            False,
            1,
            max(1, min(round(2 * radius), 32767)),
            cv2.LINE_8,
            3,
        )
        for point in (points[0], points[-1]):
            cv2.circle(
                touched, (int(point[0]), int(point[1])), round(8 * radius), 1, -1, cv2.LINE_8, 3
            )
        drawn = np.where(touched > 0, np.float32(stroke.add), drawn)
    return np.asarray(drawn, np.float32)


def place_landmarks(points: FloatArray, corrections: Corrections) -> FloatArray:
    """Return the landmarks (33, 3), u, v and confidence, with the given ones set and certain.

    Hands and feet move along with wrists and ankles.
    """
    if not corrections.landmarks:
        return points
    placed = points.copy()
    for name, u, v in corrections.landmarks:
        step = np.array([u, v], points.dtype) - points[LANDMARK_INDEX[name], :2]
        placed[[LANDMARK_INDEX[other] for other in _ALONG.get(name, ())], :2] += step
    for name, u, v in corrections.landmarks:
        placed[LANDMARK_INDEX[name]] = (u, v, 1.0)
    return placed


def correct_landmarks(
    points: FloatArray, points_3d: FloatArray, corrections: Corrections
) -> tuple[FloatArray, FloatArray]:
    """Apply corrections to the landmarks in the picture and in space.

    A landmark that is moved far loses its depth, because the depth was measured at another point.
    The bones of `Corrections.limbs` are turned to the given side by their own depth, or by the
    depth that follows from their length in the picture. Landmarks beyond them move along.

    Parameters
    ----------
    points : (33, 3)
        u, v in pixels, confidence.
    points_3d : (33, 3)
        Meters, y up, +z towards the camera; NaN where unknown.

    Returns
    -------
    Both arrays with the corrections applied.
    """
    if not corrections.landmarks and not corrections.limbs:
        return points, points_3d
    placed = place_landmarks(points, corrections)
    space = points_3d.copy()
    known = np.isfinite(points_3d).all(axis=1)
    scale = 0.0
    if known.sum() >= 4:
        flat = points[:, :2] * np.array([1.0, -1.0])
        scale = best_scale(
            points_3d[known, :2].astype(np.float64),
            flat[known].astype(np.float64),
            points[known, 2].astype(np.float64) + 1e-6,
        )
    if scale > 1:
        step = (placed[:, :2] - points[:, :2]) / scale
        space[:, :2] += step * np.array([1.0, -1.0])
        space[np.hypot(*step.T) > _NEAR * TYPICAL_HEIGHT] = np.nan
    for name, way in (
        sorted(corrections.limbs, key=lambda limb: list(LIMB_BONES).index(limb[0]))
        if scale > 1
        else ()
    ):
        _turn(space, name, WAYS[way])
    return placed.astype(points.dtype), space.astype(points_3d.dtype)


def _turn(space: FloatArray, bone: str, sign: float) -> None:
    """Move the far end of a bone to the front (1) or the back (-1); `space` (33, 3) is changed.

    Landmarks beyond the far end move along.
    """
    near, far, *hanging = (LANDMARK_INDEX[name] for name in LIMB_BONES[bone])
    if not np.isfinite(space[[near, far]]).all():
        return
    along = space[far] - space[near]
    first, last = (name.split("_")[1] for name in LIMB_BONES[bone][:2])
    length = LIMBS_BY_HEIGHT[(first, last)] * TYPICAL_HEIGHT
    depth = abs(along[2])
    if along[2] * sign < 0 or depth < _LEAST_DEPTH * length:
        left = math.sqrt(max(0.0, length**2 - float(along[:2] @ along[:2])))
        depth = max(depth, left, _LEAST_DEPTH * length)
    space[[far, *hanging], 2] += space[near, 2] + sign * depth - space[far, 2]


def given_landmarks(corrections: Corrections) -> BoolArray | None:
    """Return a mask (33,) bool of the landmarks placed by the user; None if there are none."""
    if not corrections.landmarks:
        return None
    given = np.zeros(len(LANDMARK_INDEX), bool)
    given[[LANDMARK_INDEX[name] for name, _, _ in corrections.landmarks]] = True
    return given


def given_sides(corrections: Corrections) -> FloatArray | None:
    """Return the signs (8,) float32 of the depths of `LIMB_BONES` that the user has given.

    A sign is 0 if it is not given. Returns None if none is given.
    """
    if not corrections.limbs:
        return None
    ways = dict(corrections.limbs)
    return np.array([WAYS.get(ways.get(name, ""), 0.0) for name in LIMB_BONES], np.float32)
