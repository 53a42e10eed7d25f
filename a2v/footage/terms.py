"""Compare a body with a piece of film: the terms of the fit of `a2v.footage.fit`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.evidence import SEGMENT_ENDS
from a2v.body.terms import geman_mcclure, robust_sum
from a2v.footage.figure import NAMES
from a2v.footage.track import Track
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.types import FloatArray

if TYPE_CHECKING:
    from torch import Tensor

_KEYPOINT = 0.012
"""Expected error of a landmark, relative to the height."""
_ROBUST = 0.05
_DEPTH = 0.05
"""Expected error of a bone's depth, relative to the height."""
_DEPTH_WEIGHT = 2.0
_SLIDE = 0.04
"""Expected speed of a standing foot, meters per second."""
_SLIDE_WEIGHT = 0.3
_GROUND_WEIGHT = 0.3
_LEVEL = 0.02
"""Expected error of the height of a standing sole, meters."""
SOLE = 0.02
"""Height of the landmarks of heel and toes above the sole, meters."""
SOLES = np.array(
    [
        [LANDMARK_INDEX[f"{side}_{part}"] for part in ("heel", "foot_index")]
        for side in ("left", "right")
    ]
)
_FEET = [
    NAMES.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("ankle", "foot")
]


class Evidence:
    """A track as tensors, and the terms that compare a body with it."""

    def __init__(self, track: Track, points: FloatArray):
        import torch

        def tensor(values: FloatArray) -> Tensor:
            return torch.from_numpy(np.ascontiguousarray(values, np.float64))

        self.pixels, self.weights, self.heights = (
            tensor(track.pixels),
            tensor(track.weights),
            tensor(track.heights),
        )
        self.yaw, self.tilt, self.focal = tensor(track.yaw), tensor(track.tilt), track.focal
        self.times = track.times
        self.depths = tensor(
            (points[:, SEGMENT_ENDS[:, 1], 2] - points[:, SEGMENT_ENDS[:, 0], 2]) / TYPICAL_HEIGHT
        )
        self.depth_weights = tensor(track.confidence[:, SEGMENT_ENDS].min(axis=-1))

    def heading(self, points: Tensor) -> Tensor:
        """Rotate points (T, n, 3) of the world to the heading of the camera of their frame."""
        import torch

        cosine, sine = self.yaw.cos()[:, None], self.yaw.sin()[:, None]
        x, y, z = points.unbind(-1)
        return torch.stack([cosine * x - sine * z, y, sine * x + cosine * z], dim=-1)

    def seen(self, landmarks: Tensor, tilt: Tensor) -> Tensor:
        """Return the cost (T,) of landmarks (T, 33, 3): their positions in the picture and the
        depths of bones."""
        import torch

        x, y, z = self.heading(landmarks).unbind(-1)
        down = (self.tilt + tilt)[:, None]
        ahead = (-y * down.sin() - z * down.cos()).clamp_min(0.3)
        up = y * down.cos() - z * down.sin()
        square = (
            self.focal * torch.stack([x, -up], dim=-1) / ahead[..., None] - self.pixels
        ).square().sum(-1) / self.heights[:, None] ** 2
        cost: Tensor = robust_sum(square, weights=self.weights, scale=_ROBUST) / _KEYPOINT**2
        along = z[:, SEGMENT_ENDS[:, 1]] - z[:, SEGMENT_ENDS[:, 0]]
        along = (
            along * (self.focal / ahead.detach().mean(dim=1, keepdim=True)) / self.heights[:, None]
        )
        gap = (along - self.depths).square()
        return (
            cost
            + _DEPTH_WEIGHT
            * robust_sum(gap, weights=self.depth_weights, scale=3 * _DEPTH)
            / _DEPTH**2
        )


@dataclass(frozen=True)
class Stands:
    """Contacts of the feet, and the height of the ground.

    Attributes
    ----------
    held : (T, 4)
        Confidence that ankle and toes stand, left and right.
    ground : float
        Height of the ground, meters.
    """

    held: FloatArray
    ground: float


def footing(
    joints: Tensor, marks: Tensor, times: FloatArray, stands: tuple[Tensor, float]
) -> Tensor:
    """Penalize feet in contact that slide or are above the ground, and feet below it."""
    import torch

    held, ground = stands
    steps = torch.from_numpy(np.diff(times))[:, None]
    speed = (joints[1:, _FEET] - joints[:-1, _FEET]).norm(dim=-1) / steps
    cost = (
        torch.minimum(held[1:], held[:-1]) * geman_mcclure((speed / _SLIDE).square(), 10.0)
    ).sum() * _SLIDE_WEIGHT
    over = marks[:, SOLES, 1] - ground - SOLE  # (T, 2, 2)
    stood = held.reshape(-1, 2, 2).amax(dim=-1)
    cost = (
        cost
        + _GROUND_WEIGHT * (stood * geman_mcclure((over.amin(dim=-1) / _LEVEL).square(), 5.0)).sum()
    )
    return cost + _GROUND_WEIGHT * (over.clamp(max=0) / _LEVEL).square().sum()


def pseudo_huber(square: Tensor) -> Tensor:
    """Return 2 (√(1 + x²) - 1) of x²: quadratic for small values and linear for large ones."""
    return 2 * ((1 + square).sqrt() - 1)


def acceleration(values: Tensor, times: FloatArray) -> Tensor:
    """Return second differences (T - 2, ...) of values (T, ...) at `times` (T,), which may be
    uneven."""
    import torch

    steps = torch.from_numpy(np.diff(times)).reshape(-1, *[1] * (values.ndim - 1))
    speed = (values[1:] - values[:-1]) / steps
    found: Tensor = 2 * (speed[1:] - speed[:-1]) / (steps[1:] + steps[:-1])
    return found
