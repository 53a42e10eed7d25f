"""Lengthen the steps of faster motions instead of only making them more frequent."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.kinematics import skeleton_of
from a2v.kinematics.from_joints import with_joints
from a2v.kinematics.limbs import bend_to, legs_of
from a2v.types import FloatArray, Motion

LONGEST = 1.25
"""Largest factor on the length of steps, limited by the length of the legs."""

WALKS = 0.4
"""Speed in meters per second from which a body may travel; from twice this speed it certainly
does."""

AROUND_SECONDS = 0.25
"""Seconds (standard deviation) over which a body's travel is smoothed."""


def strides(speed: FloatArray) -> FloatArray:
    """Return the factor on the length of steps at a tempo of `speed` times the recorded one.

    It is the square root of `speed`: people divide tempo between the length and the frequency of
    steps.
    """
    longer: FloatArray = np.clip(np.sqrt(speed), 1.0, LONGEST)
    return longer


def lengthened(motion: Motion, stride: FloatArray) -> Motion:
    """Scale the steps of a clip or batch by `stride` (T,) where the person travels.

    The path of the root and those of the feet are scaled along it; bones keep their lengths.
    """
    if np.max(stride) <= 1:
        return motion
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    joints = motion.joints.astype(np.float64)
    way = np.diff(joints[..., 0, [0, 2]], axis=-2, append=0) * motion.fps
    way[..., -1, :] = way[..., -2, :]
    smooth = gaussian_filter1d(way, AROUND_SECONDS * motion.fps, axis=-2, mode="nearest")
    speed = np.linalg.norm(smooth, axis=-1, keepdims=True)
    ahead = smooth / np.maximum(speed, 1e-6)
    more = (stride[:, None] - 1) * np.clip(speed / WALKS - 1, 0, 1)
    moved = np.cumsum(more * way, axis=-2) / motion.fps
    moved = moved - moved[..., :1, :]
    feet = []
    for _, _, ankle, _ in legs_of(skeleton):
        off = joints[..., ankle, :][..., [0, 2]] - joints[..., 0, [0, 2]]
        target = joints[..., ankle, :].copy()
        target[..., [0, 2]] += moved + more * (off * ahead).sum(-1, keepdims=True) * ahead
        feet.append(target)
    joints[..., 0] += moved[..., None, 0]
    joints[..., 2] += moved[..., None, 1]
    for (hip, knee, ankle, toe), target in zip(legs_of(skeleton), feet, strict=True):
        foot = joints[..., toe, :] - joints[..., ankle, :]
        joints[..., knee, :], joints[..., ankle, :] = bend_to(
            joints[..., hip, :], joints[..., knee, :], joints[..., ankle, :], target
        )
        joints[..., toe, :] = joints[..., ankle, :] + foot
    return with_joints(motion, joints, skeleton)
