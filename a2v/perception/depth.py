"""Correct the detector's depths by mediapipe's systematic errors, learned from people whose depth
is known.

The detector's 3D keypoints are in the axes of the camera, which looks down on most people, and it
holds arms too far to the front: over studio photos their depths were 8 cm off on average, mostly
by a lean of 8 degrees. A linear map from all outputs of the detector (3D, 2D, confidences) to
the depths over the floor of a body model's landmarks removes a third to a half of the error.
`scripts/fit_depth_correction.py` made the shipped file, and prints the improvement on held-out
people.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from a2v.kinematics import best_scale
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.record import Record
from a2v.types import FloatArray

FILE = Path(__file__).resolve().parent / "data" / "depth_correction.npz"
HIPS = [LANDMARK_INDEX["left_hip"], LANDMARK_INDEX["right_hip"]]
N_FEATURES = 6 * 33


@dataclass(frozen=True, kw_only=True)
class DepthCorrection(Record):
    """A linear map of `detector_features`.

    Attributes
    ----------
    mean, scale : (198,) float32
        Mean and scale with which the features are standardized.
    weights : (198, 33) float32
    offset : (33,) float32
        Meters. ``standardized features @ weights + offset`` is added to the detector's depths.
    """

    mean: FloatArray
    scale: FloatArray
    weights: FloatArray
    offset: FloatArray

    def __post_init__(self) -> None:
        self._check("mean", (N_FEATURES,))
        self._check("scale", (N_FEATURES,))
        self._check("weights", (N_FEATURES, 33))
        self._check("offset", (33,))


@lru_cache(maxsize=1)
def load_depth_correction() -> DepthCorrection:
    """Load the shipped correction."""
    return DepthCorrection.load(FILE)


def picture_plane(keypoints: FloatArray, keypoints_3d: FloatArray) -> tuple[FloatArray, float]:
    """Return the keypoints in the picture plane, (33, 2), and the scale in pixels per meter.

    The keypoints are in the detector's meters from the middle of the hips, y up.

    Parameters
    ----------
    keypoints : (33, 3)
        u, v in pixels, confidence.
    keypoints_3d : (33, 3)
        Meters, y up.
    """
    pixels = keypoints[:, :2] * np.array([1.0, -1.0])
    scale = best_scale(
        keypoints_3d[:, :2].astype(np.float64), pixels, keypoints[:, 2].astype(np.float64) + 1e-6
    )
    hips = pixels[HIPS].mean(axis=0)
    return (pixels - hips) / max(scale, 1e-6), scale


def detector_features(keypoints: FloatArray, keypoints_3d: FloatArray) -> FloatArray:
    """Return all outputs of the detector (198,) float64, without the person's position and size."""
    plane, _ = picture_plane(keypoints, keypoints_3d)
    points = keypoints_3d - keypoints_3d[HIPS].mean(axis=0)
    features: FloatArray = np.concatenate([points.ravel(), plane.ravel(), keypoints[:, 2]]).astype(
        np.float64
    )
    return features


def put_upright(
    keypoints: FloatArray, keypoints_3d: FloatArray, correction: DepthCorrection | None = None
) -> FloatArray:
    """3D keypoints (33, 3) float32 in the frame of an upright orthographic camera, as
    `a2v.types.Subject` has them.

    x and y are those of the picture, z is corrected; meters from the middle of the hips. Unknown
    (NaN) ones, and ones that do not agree with the picture at all, are returned unchanged.

    Parameters
    ----------
    keypoints : (33, 3)
        u, v in pixels, confidence.
    keypoints_3d : (33, 3)
        The detector's, meters, y up, +z towards the camera.
    correction : DepthCorrection, optional
        Default: `load_depth_correction`.
    """
    points = keypoints_3d.astype(np.float32)
    if not np.isfinite(points).all():
        return points
    plane, scale = picture_plane(keypoints, keypoints_3d)
    if scale < 1.0:
        return points
    correction = correction or load_depth_correction()
    standard = np.clip(
        (detector_features(keypoints, keypoints_3d) - correction.mean) / correction.scale, -4, 4
    )
    change = standard @ correction.weights + correction.offset
    depth = points[:, 2] - points[HIPS, 2].mean() + change
    upright: FloatArray = np.concatenate([plane, depth[:, None]], axis=1).astype(np.float32)
    return upright
