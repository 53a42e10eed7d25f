"""Carry motions of any skeleton over to the library's."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.animation.detail import FRONT
from a2v.animation.posture import table_of
from a2v.animation.source import LEANING, source_joints, source_leg_length, upright_rotmat
from a2v.geometry.vectors import unit
from a2v.kinematics import Skeleton, rotvec_to_rotmat, swing_between
from a2v.kinematics.from_joints import motion_of_joints
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.transforms import on_lengths
from a2v.motion.applications import on_skeleton
from a2v.motion.clips import RELAXED, clip_library
from a2v.types import FloatArray, Motion

SOLE = 0.012
"""Height in meters of a standing person's lowest joint above the ground, on the library's
skeleton."""


def on_clips_motion(motion: Motion) -> Motion:
    """Convert a clip of any skeleton to the library's (`on_clips_skeleton`)."""
    library = clip_library()
    joints = on_clips_skeleton(motion)
    return motion_of_joints(
        joints,
        library.skeleton,
        motion.fps,
        action=motion.action,
        seed=motion.seed,
        rest_offsets=library.rest_offsets,
        provenance=motion.provenance,
    )


def on_clips_skeleton(motion: Motion) -> FloatArray:
    """Convert a clip of any skeleton to the library's: joints (T, J, 3), meters.

    It has the library's bones, standing feet and neck, and relaxed hands.
    """
    library = clip_library()
    skeleton, lengths = library.skeleton, library.lengths
    source = source_joints(motion)
    if motion.skeleton in LEANING:
        rotmat = upright_rotmat(source, motion.fps)
        motion = dataclasses.replace(
            motion, joints=(motion.joints.astype(np.float64) @ rotmat.T).astype(np.float32)
        )
        source = source_joints(motion)
    idle = library.joints[library.index(RELAXED)]
    scale = source_leg_length(
        {
            name: idle[:, at]
            for name, at in canonical_joints(
                skeleton.joint_names, skeleton.parents.tolist()
            ).items()
        }
    ) / source_leg_length(source)
    joints = on_skeleton(
        dataclasses.replace(motion, joints=motion.joints * np.float32(scale)), skeleton, lengths
    ).astype(np.float64)
    joints = on_lengths(_standing(joints, skeleton, motion.skeleton), skeleton, lengths)
    joints = _with_details(joints, idle[0], skeleton)
    joints[..., 1] += SOLE - joints[..., 1].min()
    return joints


def _standing(joints: FloatArray, skeleton: Skeleton, data: str) -> FloatArray:
    """Turn feet and neck of joints (T, J, 3) by the difference between the standing poses of the
    skeleton of `data` and of the library."""
    table = table_of(data)
    found = canonical_joints(skeleton.joint_names, skeleton.parents.tolist())
    rest = _rest(skeleton)
    left = unit(
        (joints[:, found["left_hip"]] - joints[:, found["right_hip"]]) * np.array([1.0, 0.0, 1.0])
    )
    out = joints.copy()
    for bone, key in (("left_ankle", "dip"), ("right_ankle", "dip"), ("neck", "neck")):
        if key not in table:
            continue
        child = {"left_ankle": "left_foot", "right_ankle": "right_foot", "neck": "head"}[bone]
        own = rest[found[child]] - rest[found[bone]]
        angle = np.degrees(
            np.arctan2(own[1], np.hypot(own[0], own[2]))
            if key == "dip"
            else np.arctan2(own[2], own[1])
        )
        turn = rotvec_to_rotmat(
            np.deg2rad(table[key] - angle if key == "dip" else angle - table[key]) * left
        )
        moved = [at for at in range(skeleton.n_joints) if _hangs_on(at, found[bone], skeleton)]
        out[:, moved] = joints[:, found[bone], None] + np.einsum(
            "tab,tkb->tka", turn, joints[:, moved] - joints[:, found[bone], None]
        )
    return out


def _hangs_on(joint: int, on: int, skeleton: Skeleton) -> bool:
    """Return whether a joint is a descendant of another one."""
    at = int(skeleton.parents[joint])
    while at >= 0:
        if at == on:
            return True
        at = int(skeleton.parents[at])
    return False


def _rest(skeleton: Skeleton) -> FloatArray:
    offsets = clip_library().rest_offsets
    points = np.zeros_like(offsets)
    for joint in range(1, len(points)):
        points[joint] = points[skeleton.parents[joint]] + offsets[joint]
    return points


def _with_details(joints: FloatArray, relaxed: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Joints (T, J, 3) with fingers and face as in the pose `relaxed` (J, 3), turned with the
    forearms and the person."""
    names = skeleton.joint_names
    out = joints.copy()
    for side in ("l", "r"):
        elbow, wrist = names.index(f"lowerarm_{side}"), names.index(f"hand_{side}")
        fingers = [at for at in range(len(names)) if _hangs_on(at, wrist, skeleton)]
        turn = rotvec_to_rotmat(
            swing_between(
                np.broadcast_to(relaxed[wrist] - relaxed[elbow], joints[:, 0].shape),
                joints[:, wrist] - joints[:, elbow],
            )
        )
        out[:, fingers] = joints[:, wrist, None] + np.einsum(
            "tab,kb->tka", turn, relaxed[fingers] - relaxed[wrist]
        )
    head, front = names.index("head"), names.index(FRONT)
    found = canonical_joints(names, skeleton.parents.tolist())
    across = joints[:, found["left_hip"]] - joints[:, found["right_hip"]]
    yaw = -np.arctan2(across[:, 2], across[:, 0])
    out[:, front] = joints[:, head] + np.einsum(
        "tab,b->ta",
        rotvec_to_rotmat(yaw[:, None] * np.array([0.0, 1.0, 0.0])),
        relaxed[front] - relaxed[head],
    )
    return out
