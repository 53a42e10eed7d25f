"""Move limbs of plain joints to places: planted feet and held hands; knees and elbows bend.

On a person's rig feet are cleaned with heels, toes and soles (`a2v.animation.grounding`); here a
foot is an ankle and a toe.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from a2v.animation.curves import near
from a2v.kinematics import Skeleton, inverse_kinematics
from a2v.kinematics.foot_contacts import PLANT, PlantSettings
from a2v.kinematics.from_joints import with_joints
from a2v.kinematics.ground import heading, yaw_to_rotmat
from a2v.kinematics.limbs import bend_to, limb_of
from a2v.kinematics.planting import plant_feet
from a2v.motion.direction import Hold
from a2v.types import FloatArray, Motion

EASE_SECONDS = 0.3
"""Seconds over which a limb moves to its held place, and from it."""


def planted(
    motion: Motion, skeleton: Skeleton, *, settings: PlantSettings = PLANT, kept: Sequence[int] = ()
) -> Motion:
    """Plant the standing feet of a clip or batch (`a2v.kinematics.planting`); the frames `kept`
    keep their poses."""
    stays = None
    if len(kept):
        fixed = np.zeros(motion.frames, bool)
        fixed[list(kept)] = True
        stays = near(fixed, EASE_SECONDS * motion.fps)
    joints = plant_feet(motion.joints, skeleton, motion.fps, settings=settings, stays=stays)
    return with_joints(motion, joints, skeleton)


def hold_limbs(motion: Motion, skeleton: Skeleton, holds: Sequence[Hold]) -> Motion:
    """Move held hands and feet of a clip to their places, as far as the limbs reach; they arrive
    and leave within `EASE_SECONDS`."""
    joints = motion.joints.astype(np.float64)
    times = np.arange(len(joints)) / motion.fps
    for hold in holds:
        joint = skeleton.index(hold.joint)
        limb, on = (
            limb_of(skeleton, joint),
            (times >= hold.start - 1e-6) & (times <= hold.end + 1e-6),
        )
        if limb is not None and on.any():
            weight = near(on, EASE_SECONDS * motion.fps)[:, None]
            _reach(
                joints, limb, joint, weight * (held_at(hold, joints, skeleton) - joints[:, joint])
            )
    return _with_joints(motion, joints, skeleton)


def held_at(hold: Hold, joints: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Target places (T, 3) of a held joint in frames with `joints` (T, J, 3)."""
    if not hold.body:
        return np.broadcast_to(np.array(hold.at, np.float64), joints[:, 0].shape)
    placed: FloatArray = joints[:, 0] + yaw_to_rotmat(heading(joints, skeleton)) @ np.array(
        hold.at, np.float64
    )
    return placed


def _reach(joints: FloatArray, limb: tuple[int, int, int], joint: int, move: FloatArray) -> None:
    """Move the end of a limb, and its descendants, by `move` (T, 3), in place."""
    top, middle, end = limb
    new_middle, new_end = bend_to(
        joints[:, top], joints[:, middle], joints[:, end], joints[:, end] + move
    )
    if joint != end:
        joints[:, joint] += new_end - joints[:, end]
    joints[:, middle], joints[:, end] = new_middle, new_end


def _with_joints(motion: Motion, joints: FloatArray, skeleton: Skeleton) -> Motion:
    rotations = inverse_kinematics(joints, skeleton).astype(np.float32)
    return dataclasses.replace(motion, joints=joints.astype(np.float32), rotations=rotations)
