"""Find out from landmarks whether legs are straight and upright."""

from __future__ import annotations

import numpy as np

from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import FloatArray


def leg_stance(
    side: str, pixels: FloatArray, confidence: FloatArray, points: FloatArray | None
) -> tuple[bool, bool]:
    """Return whether a leg looks straight, and whether it also looks upright, as a leg that carries
    weight.

    The thresholds were chosen by hand on photos of standing people.

    Parameters
    ----------
    side : str
        "left" or "right".
    pixels : (33, 2)
        BlazePose landmarks, u to the right, v downwards.
    confidence : (33,)
    points : (33, 3), optional
        The same in 3D, any unit, if they are usable.
    """
    hip, knee, ankle, shoulder = (
        LANDMARK_INDEX[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle", "shoulder")
    )
    if min(confidence[[hip, knee, ankle]]) < 0.3:
        return False, False

    def bend(positions: FloatArray) -> float:
        upper, lower = positions[knee] - positions[hip], positions[ankle] - positions[knee]
        cosine = upper @ lower / max(np.linalg.norm(upper) * np.linalg.norm(lower), 1e-9)
        return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))

    leg = pixels[ankle] - pixels[hip]
    straight = bend(pixels) < 15.0
    if points is not None and np.isfinite(points[[hip, knee, ankle]]).all():
        straight &= bend(points) < 35.0  # detectors bend straight legs by some twenty degrees
    # a leg that points at the camera is short compared with the trunk
    if confidence[shoulder] > 0.3:
        straight &= bool(
            np.linalg.norm(leg) > 1.15 * np.linalg.norm(pixels[hip] - pixels[shoulder])
        )
    upright = abs(leg[0]) < 0.3 * leg[1]
    return bool(straight), bool(straight and upright)
