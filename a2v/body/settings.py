"""Settings of the fit of a body."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.stature import TYPICAL_HEIGHT

LEAST_DISTANCE = 0.8
"""Smallest distance of a camera that shows a whole person, meters."""


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """Settings of the fit of the body to the photo.

    Lengths called *relative* are fractions of the person's height. The defaults were chosen by
    hand; ``python -m benchmarks.fit`` and ``tests/body/test_photos.py`` measure their effect.

    Attributes
    ----------
    model : str
        "anny", or the ``.npz`` file of an SMPL, SMPL-H or SMPL-X model: the fit itself always runs
        on Anny and is then carried over.
    keypoint_sigma : float
        Expected error of a keypoint, relative.
    keypoint_robust : float
        Scale of the Geman-McClure penalty of keypoints, relative: errors far larger count as
        outliers.
    depth_weight : float
        Weight of the detector's 3D keypoints, used for the depth along each limb only.
    depth_sigma : float
        Expected error of that depth, relative.
    dense_weight : float
        Weight of the position at which the body map shows a point of the body.
    dense_depth_weight : float
        Weight of the depth at which the body map shows a point of the body.
    dense_pixels : int
        Number of pixels of the body map that are sampled.
    silhouette_weight : float
        Weight of the silhouette; 0 leaves it out.
    silhouette_sigma : float
        Expected error of the silhouette, relative.
    silhouette_robust : float
        Geman-McClure scale of the silhouette, relative.
    silhouette_size : int
        Longer side of the raster on which silhouettes are compared, pixels.
    height : float
        The person's standing height, meters; one photo does not show it.
    height_sigma : float
        Uncertainty of that height, meters.
    distance : float, optional
        Distance from the camera to the person, meters; 0 for an orthographic camera. By default it
        follows from the photo's focal length, or is a usual distance.
    distance_weight : float
        Weight of the estimated distance. It counts if the distance is uncertain and the person
        stands, because the fit then changes the distance.
    pose_weight : float
        Weight of the prior on pose, in the fit to the photo alone.
    shape_weight : float
        Weight of the prior on shape.
    feet_weight : float
        Weight of flat feet and straight legs for people who stand.
    collision_weight : float
        Weight of limbs that intersect the torso or each other.
    surface_weight : float
        Weight of the surface term (Eq. 17), both ways.
    surface_robust : float
        Geman-McClure scale of the surface distance, meters.
    joints_weight : float
        λ_j of Eq. 15.
    prior_weight : float
        λ_r of Eq. 15: the Gaussian mixture over poses (Eq. 18).
    starts : int
        Number of recorded poses from which a fit restarts if it looks wrong: this many that
        resemble the landmarks, then this many that fill the mask. 0 turns off these restarts and
        those of single limbs.
    rounds : int
        Largest number of rounds with the silhouette or the surface. Each round updates the
        correspondences.
    steps : int
        Largest number of L-BFGS iterations of a round. The gradient stops it before.
    tolerance : float
        Stop when a round changes no unknown by more than this share of its own uncertainty.
    seed : int
        Seed of the choice of sampled vertices.
    """

    model: str = "anny"
    keypoint_sigma: float = 0.012
    keypoint_robust: float = 0.05
    depth_weight: float = 6.0
    depth_sigma: float = 0.04
    dense_weight: float = 3.0
    dense_depth_weight: float = 3.0
    dense_pixels: int = 500
    silhouette_weight: float = 1.0
    silhouette_sigma: float = 0.012
    silhouette_robust: float = 0.04
    silhouette_size: int = 256
    height: float = TYPICAL_HEIGHT
    height_sigma: float = 0.04
    distance: float | None = None
    distance_weight: float = 3.0
    pose_weight: float = 1.0
    shape_weight: float = 1.0
    feet_weight: float = 1.0
    collision_weight: float = 1.0
    surface_weight: float = 1.0
    surface_robust: float = 0.05
    joints_weight: float = 2.0
    prior_weight: float = 0.2
    starts: int = 5
    rounds: int = 30
    steps: int = 100
    tolerance: float = 0.01
    seed: int = 0

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):
            value = getattr(self, item.name)
            if isinstance(value, float) and not (np.isfinite(value) and value >= 0):
                raise InputError(
                    f"FitSettings.{item.name} is {value}; expected a number of at least 0"
                )
        if self.distance is not None and 0 < self.distance < LEAST_DISTANCE:
            raise InputError(
                f"FitSettings.distance is {self.distance}; expected at least {LEAST_DISTANCE} "
                "meters, or 0 for an orthographic camera"
            )
        if not 0 <= self.dense_pixels <= 4096:
            raise InputError(f"FitSettings.dense_pixels is {self.dense_pixels}; expected 0 to 4096")
        if not 0 <= self.starts <= 100:
            raise InputError(f"FitSettings.starts is {self.starts}; expected 0 to 100")
        if self.rounds < 0 or self.steps < 1 or not 32 <= self.silhouette_size <= 2048:
            raise InputError(
                "FitSettings needs rounds >= 0, steps >= 1 and silhouette_size from 32 to 2048"
            )
