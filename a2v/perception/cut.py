"""What the photo's lower edge cuts off: the person stands, with the trunk upright and hanging arms
as far as they are not visible either."""

from __future__ import annotations

import numpy as np

from a2v.kinematics.names import BLAZEPOSE, LANDMARK_INDEX
from a2v.types import FloatArray

_SEEN = 0.5
"""Confidence from which on a joint is visible."""
_GUESSED = 0.1
"""Confidence of the hips below which the detector has not understood the trunk either: the photo
ends at the chest."""
_TRUST = 0.7
"""Confidence of the joints that are made up."""
_SHOULDERS = 0.34
"""Distance of the landmarks of the shoulders, meters."""
_TRUNK = 1.45
"""Length of the trunk from the shoulders to the hips, in distances of the shoulders."""
_HIPS = 0.6
"""Distance of the hips, in distances of the shoulders."""
_FACE = 0.1
"""How far the face is in front of the shoulders, meters."""
_CHAINS = {
    "elbow": ("shoulder", np.array([0.1, -0.58, -0.04])),
    "wrist": ("elbow", np.array([0.02, -0.5, 0.1])),
    "knee": ("hip", np.array([0.0, -0.88, 0.02])),
    "ankle": ("knee", np.array([0.0, -0.86, -0.04])),
    "heel": ("ankle", np.array([0.0, -0.13, -0.09])),
    "foot_index": ("ankle", np.array([0.0, -0.16, 0.27])),
}
"""The joint before each joint of a limb, and the way from it, in lengths of the trunk: outward, up,
to the camera."""
_ARMS = ("elbow", "wrist")


def complete_standing(
    points: FloatArray, points_3d: FloatArray, height: int
) -> tuple[FloatArray, FloatArray]:
    """Let a person stand whose legs, and maybe hips and arms, lie below the picture.

    Detectors guess something for them, often somebody who sits.

    Parameters
    ----------
    points : (33, 3) float
        Landmarks in pixels, and their confidence; v down.
    points_3d : (33, 3) float
        Meters, y up, z toward the camera.
    height : int
        Of the picture, whose lower edge cuts the person off, pixels.
    """
    shoulders, hips = (
        [LANDMARK_INDEX[f"{side}_{joint}"] for side in ("left", "right")]
        for joint in ("shoulder", "hip")
    )
    points, points_3d = points.copy(), points_3d.copy()
    seen = (points[:, 2] > _SEEN) & (points[:, 1] < height)
    chest = points[hips, 2].max() < _GUESSED
    if chest:
        points, points_3d = _upright(points, shoulders, hips)
    trunk = points_3d[shoulders].mean(axis=0) - points_3d[hips].mean(axis=0)
    flat = points[shoulders, :2].mean(axis=0) - points[hips, :2].mean(axis=0)
    meters, across = float(np.linalg.norm(trunk)), float(np.linalg.norm(trunk[:2]))
    if not np.isfinite(meters) or across < 0.3 * meters:  # seen along the trunk
        return points, points_3d
    scale = float(np.linalg.norm(flat)) / across
    for side, sign in (("left", 1), ("right", -1)):
        whole = seen[LANDMARK_INDEX[f"{side}_ankle"]]
        for joint, (before, way) in _CHAINS.items():
            own, first = (LANDMARK_INDEX[f"{side}_{name}"] for name in (joint, before))
            if seen[own] or (not chest if joint in _ARMS else whole):
                continue
            step = meters * way * [sign, 1, 1]
            points_3d[own] = points_3d[first] + step
            points[own, :2] = points[first, :2] + scale * step[:2] * [1, -1]
            points[own, 2] = _TRUST
    return points, points_3d


def _upright(
    points: FloatArray, shoulders: list[int], hips: list[int]
) -> tuple[FloatArray, FloatArray]:
    """Landmarks (33, 3) in pixels and in meters of a person seen from the front whose shoulders and
    head alone are right."""
    points = points.copy()
    wide = points[shoulders[0], :2] - points[shoulders[1], :2]
    apart = max(float(np.linalg.norm(wide)), 1.0)
    middle = points[shoulders, :2].mean(axis=0) + np.array([0.0, _TRUNK * apart])
    points[hips, :2] = [middle + half * _HIPS * wide for half in (0.5, -0.5)]
    points[[*shoulders, *hips], 2] = _TRUST
    flat = (points[:, :2] - middle) * [1, -1] * _SHOULDERS / apart
    face = np.array([name in _FACE_NAMES for name in BLAZEPOSE])
    return points, np.column_stack([flat, _FACE * face])


_FACE_NAMES = frozenset(name for name in BLAZEPOSE[:11] if not name.endswith("ear"))
