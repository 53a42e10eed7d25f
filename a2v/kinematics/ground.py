"""Position and heading of a person on the ground, with and without the sway of steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.so3 import Array, namespace
from a2v.types import FloatArray, Motion

# : Standard deviation, seconds, of the Gaussian that smooths sway out of the path over the ground:
# a step takes about half a second.
SWAY_SECONDS = 0.35


@dataclass(frozen=True)
class GroundTrajectory:
    """Position and heading of a person on the ground in each frame.

    Attributes
    ----------
    position : (T, 2) float64
        x and z, meters.
    heading : (T,) float64
        Angle about +y from +z to the person's facing, radians, without jumps of a full turn.
    """

    position: FloatArray
    heading: FloatArray

    def smooth(self, fps: float, *, seconds: float = SWAY_SECONDS) -> GroundTrajectory:
        """Return the path without the sway of steps; its ends continue in their own direction."""
        return GroundTrajectory(
            smoothed(self.position, seconds * fps),
            smoothed(self.heading[:, None], seconds * fps)[:, 0],
        )

    def transforms(self) -> FloatArray:
        """World from ground (T, 4, 4) float64: y up, +z ahead, at height 0."""
        made = np.tile(np.eye(4), (len(self.heading), 1, 1))
        made[:, :3, :3] = yaw_to_rotmat(self.heading)
        made[:, [0, 2], 3] = self.position
        return made


def ground_trajectory(motion: Motion) -> GroundTrajectory:
    """Return the path of the root over the ground, including sway, and the heading by hips and
    shoulders.

    Raises
    ------
    InputError
        The motion is a batch, or the hips and shoulders of its skeleton are unknown.
    """
    if motion.batch:
        raise InputError(
            "a path over the ground needs one clip; this Motion is a batch: index it first"
        )
    return trajectory_of(
        motion.joints,
        motion.joint_names,
        motion.parents.tolist(),
        whose=f"skeleton '{motion.skeleton}'",
    )


def trajectory_of(
    joints: FloatArray, names: Sequence[str], parents: Sequence[int], *, whose: str
) -> GroundTrajectory:
    """`ground_trajectory` of the joints (T, J, 3) of a skeleton or the heads of a rig's bones;
    `whose` names it in errors.

    Raises
    ------
    InputError
        Hips and shoulders are not among the names.
    """
    found = canonical_joints(names, parents)
    pairs = [(f"left_{name}", f"right_{name}") for name in ("hip", "shoulder")]
    if missing := [name for pair in pairs for name in pair if name not in found]:
        raise InputError(
            f"the {whose} has no {missing[0].replace('_', ' ')}; so the person's facing is unknown"
        )
    places = joints.astype(np.float64)
    left = sum(
        (places[:, found[a]] - places[:, found[b]] for a, b in pairs), np.zeros_like(places[:, 0])
    )
    return GroundTrajectory(places[:, 0][:, [0, 2]], np.unwrap(np.arctan2(-left[:, 2], left[:, 0])))


class Sided(Protocol):
    """Interface with left and right hip and shoulder joints: a `Skeleton`, or a part of one."""

    @property
    def name(self) -> str:
        """Its name in messages."""

    @property
    def hips(self) -> tuple[int, int] | None:
        """Left and right hip."""

    @property
    def shoulders(self) -> tuple[int, int] | None:
        """Left and right shoulder."""


def left_of(joints: Array, skeleton: Sided) -> Array:
    """Return the vector (..., 3) to the left of a person (..., J, 3), by hips and shoulders.

    Raises
    ------
    InputError
        The hips and shoulders of the skeleton are unknown.
    """
    if skeleton.hips is None or skeleton.shoulders is None:
        raise InputError(
            f"skeleton '{skeleton.name}' does not say which joints are hips and shoulders"
        )
    (left_hip, right_hip), (left_shoulder, right_shoulder) = skeleton.hips, skeleton.shoulders
    left: Array = (
        joints[..., left_hip, :]
        - joints[..., right_hip, :]
        + joints[..., left_shoulder, :]
        - joints[..., right_shoulder, :]
    )
    return left


def heading(joints: FloatArray, skeleton: Sided) -> FloatArray:
    """Return the angle (...) about +y from +z to the facing of a person (..., J, 3), by hips and
    shoulders, radians.

    Raises
    ------
    InputError
        See `left_of`.
    """
    left = left_of(joints, skeleton)
    angle: FloatArray = np.arctan2(-left[..., 2], left[..., 0])
    return angle


def first_heading(joints: Array, skeleton: Sided) -> Array:
    """Return cosine and sine (..., 2) of the `heading` of the first frame of joints (..., T, J, 3),
    for numpy and torch.

    Raises
    ------
    InputError
        See `left_of`.
    """
    xp = namespace(joints)
    left = left_of(joints[..., 0, :, :], skeleton)
    flat = xp.stack([left[..., 0], -left[..., 2]], -1)
    length = xp.sqrt((flat * flat).sum(-1))[..., None]
    direction: Array = flat / xp.where(length < 1e-8, xp.ones_like(length), length)
    return direction


def face_forward(joints: Array, heading: Array) -> Array:
    """Turn joints (..., T, J, 3) with a `heading` (..., 2) about +y so that they face +z.

    A heading of (cos, -sin) does the inverse.
    """
    xp = namespace(joints)
    cos, sin = heading[..., 0][..., None, None], heading[..., 1][..., None, None]
    x, z = joints[..., 0], joints[..., 2]
    turned: Array = xp.stack([cos * x - sin * z, joints[..., 1], cos * z + sin * x], -1)
    return turned


def yaw_to_rotmat(yaw: FloatArray) -> FloatArray:
    """Return the rotations (..., 3, 3) about +y by angles (...), radians: +z goes to (sin, 0,
    cos)."""
    made = np.zeros((*np.shape(yaw), 3, 3))
    made[..., 0, 0], made[..., 0, 2] = np.cos(yaw), np.sin(yaw)
    made[..., 1, 1] = 1
    made[..., 2, 0], made[..., 2, 2] = -np.sin(yaw), np.cos(yaw)
    return made


def smoothed(points: FloatArray, sigma: float) -> FloatArray:
    """Smooth a path (T, n) by a Gaussian of standard deviation `sigma` frames, without lag; a
    straight path does not change."""
    from scipy.ndimage import gaussian_filter1d

    if sigma < 0.15 or len(points) < 3:
        return points
    # linear extension beyond the ends, so that neither end is pulled inward
    pad = min(len(points) - 1, int(4 * sigma) + 1)
    before = 2 * points[0] - points[pad:0:-1]
    after = 2 * points[-1] - points[-2 : -pad - 2 : -1]
    smooth: FloatArray = gaussian_filter1d(np.concatenate([before, points, after]), sigma, axis=0)[
        pad : pad + len(points)
    ]
    return smooth
