"""Orientations of bones in the world, from and to the rotation vectors of the chain convention (Eq.
6)."""

from __future__ import annotations

import numpy as np

from a2v.kinematics.skeleton import Skeleton, skeleton_of
from a2v.kinematics.so3 import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.kinematics.transforms import forward_kinematics, inverse_kinematics
from a2v.types import FloatArray, Motion

_OFF = 5e-5
"""Largest distance of joints from the forward kinematics of their rotations, meters. Rounding to
float32 gives less; a clip with only joints gives more."""


def rotvecs_of(motion: Motion, skeleton: Skeleton) -> tuple[FloatArray, FloatArray]:
    """Return rotation vectors whose forward kinematics give a motion's joints, and the lengths of
    its bones.

    Parameters
    ----------
    motion : Motion
        One clip or a batch; its own rotations are used if they fit, which they do not for a clip
        with only joints.
    skeleton : Skeleton
        Skeleton of `motion`.

    Returns
    -------
    rotvecs : (..., T, J, 3) float64
        Chain convention, radians.
    lengths : (..., T, J) float64
        Meters.
    """
    joints = motion.joints.astype(np.float64)
    lengths = np.linalg.norm(joints - joints[..., np.maximum(motion.parents, 0), :], axis=-1)
    rotvecs = motion.rotations.astype(np.float64)
    if (
        np.abs(forward_kinematics(rotvecs, joints[..., 0, :], lengths, skeleton) - joints).max()
        > _OFF
    ):
        rotvecs = inverse_kinematics(joints, skeleton)
    return rotvecs, lengths


def bone_rotmats(motion: Motion) -> FloatArray:
    """World rotations (T, J, 3, 3) of the bones of a clip: entry j turns the skeleton's rest
    direction to bone j's."""
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    local = rotvec_to_rotmat(rotvecs_of(motion, skeleton)[0])
    world = np.tile(np.eye(3), (motion.frames, len(motion.parents), 1, 1))
    for chain in skeleton.chains:
        for place in range(1, len(chain)):
            world[:, chain[place]] = (
                world[:, chain[place - 1]] if place > 1 else np.eye(3)
            ) @ local[:, chain[place]]
    return world


def rotmats_to_chain(rotmats: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Rotation vectors (T, J, 3) relative to the previous bone of the chain, from world rotations
    of bones (T, J, 3, 3)."""
    rotvecs = np.zeros((*rotmats.shape[:2], 3))
    for chain in skeleton.chains:
        for place in range(1, len(chain)):
            now = rotmats[:, chain[place]]
            if place > 1:
                now = np.swapaxes(rotmats[:, chain[place - 1]], -1, -2) @ now
            rotvecs[:, chain[place]] = rotmat_to_rotvec(now)
    return rotvecs
