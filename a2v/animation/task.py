"""The input of orienting the bones of a rig."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.animation.posture import Posture
from a2v.animation.rig import Rig
from a2v.kinematics import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.types import FloatArray

LIMITS = {"spine": 110.0, "neck": 60.0, "collar": 30.0, "wrist": 70.0, "ankle": 75.0}
"""Largest angle in degrees between a joint and its rest orientation."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """A clip and the rig that follows it.

    Attributes
    ----------
    source : dict of canonical joint to (T, 3) float64
        Meters at the body's size, upright.
    rig : Rig
    posture : Posture
        Posture of the motion's skeleton.
    fps : float
    limits : bool
        Keep joints within `LIMITS`.
    twist_smoothing : float
        Seconds: time constant of the smoothing of the limbs' twist.
    """

    source: dict[str, FloatArray]
    rig: Rig
    posture: Posture
    fps: float
    limits: bool
    twist_smoothing: float

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.source["pelvis"])

    def limited(self, rotmats: FloatArray, joint: str) -> FloatArray:
        """Rotations (T, 3, 3) from rest of a joint of `LIMITS`, kept within its range if `limits`
        is set."""
        return limited(rotmats, LIMITS[joint]) if self.limits else rotmats


def limited(rotmats: FloatArray, degrees: float) -> FloatArray:
    """Rotations (T, 3, 3) whose angles are softly limited to `degrees`."""
    rotvec = rotmat_to_rotvec(rotmats)
    angle = np.linalg.norm(rotvec, axis=-1, keepdims=True)
    limit = np.deg2rad(degrees)
    knee = 0.8 * limit  # identity up to there, then a smooth approach to the limit
    over = np.maximum(angle - knee, 0)
    soft = np.where(angle > knee, knee + (limit - knee) * np.tanh(over / (limit - knee)), angle)
    return rotvec_to_rotmat(rotvec * np.where(angle > 1e-9, soft / np.maximum(angle, 1e-9), 1.0))
