"""Motions of joints: the rotations follow by inverse kinematics."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from a2v.kinematics.skeleton import Skeleton
from a2v.kinematics.transforms import inverse_kinematics
from a2v.types import FloatArray, Motion


def motion_of_joints(joints: FloatArray, skeleton: Skeleton, fps: float, **told: Any) -> Motion:
    """Return the motion of joints (..., T, J, 3), meters, y up.

    `told` are further fields of `Motion`, such as ``action`` and ``provenance``.
    """
    return Motion(
        **_fields(joints, skeleton),
        fps=fps,
        parents=np.asarray(skeleton.parents),
        joint_names=skeleton.joint_names,
        **told,
    )


def with_joints(motion: Motion, joints: FloatArray, skeleton: Skeleton) -> Motion:
    """Replace the joints of `motion` by `joints` (..., T, J, 3), with their rotations and root."""
    return dataclasses.replace(motion, **_fields(joints, skeleton))


def _fields(joints: FloatArray, skeleton: Skeleton) -> dict[str, Any]:
    return {
        "joints": joints.astype(np.float32),
        "rotations": inverse_kinematics(joints, skeleton).astype(np.float32),
        "root": joints[..., 0, :].astype(np.float32),
    }
