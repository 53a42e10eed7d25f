"""Rotations, kinematic trees, forward and inverse kinematics; every function takes numpy arrays and
torch tensors."""

from a2v.kinematics.skeleton import (
    CMU,
    HUMANACT12,
    NTU_VIBE,
    SKELETONS,
    Skeleton,
    skeleton_from_parents,
    skeleton_of,
)
from a2v.kinematics.so3 import (
    hat,
    quat_multiply,
    quat_to_rotmat,
    quat_to_rotvec,
    rotmat_to_quat,
    rotmat_to_rotvec,
    rotvec_to_quat,
    rotvec_to_rotmat,
    slerp,
    swing_between,
)
from a2v.kinematics.transforms import (
    best_scale,
    bone_lengths,
    bone_vectors,
    bones_to_rotvecs,
    forward_kinematics,
    inverse_kinematics,
)

__all__ = [
    "CMU",
    "HUMANACT12",
    "NTU_VIBE",
    "SKELETONS",
    "Skeleton",
    "best_scale",
    "bone_lengths",
    "bone_vectors",
    "bones_to_rotvecs",
    "forward_kinematics",
    "hat",
    "inverse_kinematics",
    "quat_multiply",
    "quat_to_rotmat",
    "quat_to_rotvec",
    "rotmat_to_quat",
    "rotmat_to_rotvec",
    "rotvec_to_quat",
    "rotvec_to_rotmat",
    "skeleton_from_parents",
    "skeleton_of",
    "slerp",
    "swing_between",
]
