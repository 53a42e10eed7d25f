"""Orient arms and legs along the motion's bones; the plane of elbow or knee gives their twist."""

from __future__ import annotations

import numpy as np

from a2v.animation.posture import foot_pitch
from a2v.animation.task import Task
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import frame_along, unit
from a2v.kinematics import rotvec_to_rotmat, swing_between
from a2v.types import FloatArray

_ARM_REFERENCE = np.array([0.75, -0.35, 0.56])
"""Direction of a left arm in the middle of its range, where it is untwisted; an arm cannot reach
the opposite direction."""
_LEG_REFERENCE = np.array([0.08, -0.9, 0.43])
"""The same direction for a left leg."""


def orient_arm(rotmats: dict[int, FloatArray], task: Task, chest: FloatArray, side: str) -> None:
    """Add the rotations (T, 3, 3) of one arm's bones from rest, below a `chest` (T, 3, 3), to
    `rotmats`."""
    source, rig = task.source, task.rig
    shoulder, elbow, wrist = (source[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist"))
    rest_upper = rig.joints[f"{side}_elbow"] - rig.joints[f"{side}_shoulder"]
    rest_fore = rig.joints[f"{side}_wrist"] - rig.joints[f"{side}_elbow"]
    rest_axis = np.cross(unit(rest_upper), unit(rest_fore))
    if np.linalg.norm(rest_axis) < 0.15:  # a straight rest arm: elbows bend forward
        rest_axis = np.cross(unit(rest_upper), np.array([0.0, 0, 1]))
    mirror = np.array([1.0 if side == "left" else -1.0, 1, 1])
    upper, fore = unit(elbow - shoulder), unit(wrist - elbow)
    seen = np.cross(upper, fore)
    weight = smoothstep(np.linalg.norm(seen, axis=-1), 0.12, 0.5)
    expected = _transported(chest, upper, rest_upper, rest_axis, _ARM_REFERENCE * mirror)
    angle = _twist(upper, expected, seen, weight, task.twist_smoothing * task.fps)
    axis = _rotated(expected, upper, angle)
    _share_twist(
        rotmats, rig.chains[f"{side}_shoulder"], upper, expected, angle, rest_upper, rest_axis
    )
    forearm = frame_along(fore, axis) @ frame_along(rest_fore, rest_axis).T
    for bone in rig.chains[f"{side}_elbow"]:
        rotmats[bone] = forearm
    hand = forearm
    if f"{side}_hand" in source and f"{side}_hand" in rig.joints:
        rest_hand = rig.joints[f"{side}_hand"] - rig.joints[f"{side}_wrist"]
        local = np.einsum("tba,tb->ta", forearm, source[f"{side}_hand"] - wrist)
        # a hand in line with the forearm in the source is in line with it in the rig too
        straight = rotvec_to_rotmat(swing_between(rest_fore, rest_hand))
        swing = rotvec_to_rotmat(
            swing_between(np.broadcast_to(rest_hand, local.shape), local @ straight.T)
        )
        hand = forearm @ task.limited(swing, "wrist")
    rotmats[rig.bones[f"{side}_wrist"]] = hand


def orient_leg(rotmats: dict[int, FloatArray], task: Task, pelvis: FloatArray, side: str) -> None:
    """Add the rotations (T, 3, 3) of one leg's bones from rest, below a `pelvis` (T, 3, 3), to
    `rotmats`."""
    source, rig = task.source, task.rig
    hip, knee, ankle = (source[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
    rest_thigh = rig.joints[f"{side}_knee"] - rig.joints[f"{side}_hip"]
    rest_shin = rig.joints[f"{side}_ankle"] - rig.joints[f"{side}_knee"]
    rest_axis = np.array([1.0, 0, 0])
    mirror = np.array([1.0 if side == "left" else -1.0, 1, 1])
    thigh, shin = unit(knee - hip), unit(ankle - knee)
    bent = np.cross(thigh, shin)
    by_knee = smoothstep(np.linalg.norm(bent, axis=-1), 0.15, 0.5)
    expected = _transported(pelvis, thigh, rest_thigh, rest_axis, _LEG_REFERENCE * mirror)
    seen = unit(bent) * by_knee[:, None]
    weight = by_knee
    foot = unit(source[f"{side}_foot"] - ankle) if f"{side}_foot" in source else None
    if foot is not None:
        plane = np.cross(foot, shin)
        by_foot = smoothstep(np.linalg.norm(plane, axis=-1), 0.3, 0.8) * (1 - by_knee) * 0.7
        seen = seen + unit(plane) * by_foot[:, None]
        weight = by_knee + by_foot
    angle = _twist(thigh, expected, seen, weight, task.twist_smoothing * task.fps)
    axis = _rotated(expected, thigh, angle)
    _share_twist(rotmats, rig.chains[f"{side}_hip"], thigh, expected, angle, rest_thigh, rest_axis)
    lower = frame_along(shin, axis) @ frame_along(rest_shin, rest_axis).T
    for bone in rig.chains[f"{side}_knee"]:
        rotmats[bone] = lower
    sole = lower
    if foot is not None and f"{side}_foot" in rig.joints:
        rest_foot = rig.joints[f"{side}_foot"] - rig.joints[f"{side}_ankle"]
        axis = unit(axis - (axis * foot).sum(-1, keepdims=True) * foot)
        pitch = foot_pitch(source, side, task.posture, rest_foot, task.fps)
        sole = (
            rotvec_to_rotmat(axis * pitch)
            @ frame_along(foot, axis)
            @ frame_along(rest_foot, rest_axis).T
        )
        if task.limits:
            sole = lower @ task.limited(np.swapaxes(lower, 1, 2) @ sole, "ankle")
    rotmats[rig.bones[f"{side}_ankle"]] = sole


def _share_twist(
    rotmats: dict[int, FloatArray],
    chain: list[int],
    direction: FloatArray,
    expected: FloatArray,
    angle: FloatArray,
    rest: FloatArray,
    rest_axis: FloatArray,
) -> None:
    """Orient the bones of an upper limb: all along `direction`, the twist growing from the first
    bone to the last."""
    for place, bone in enumerate(chain):
        axis = _rotated(expected, direction, angle * ((place + 1) / len(chain)))
        rotmats[bone] = frame_along(direction, axis) @ frame_along(rest, rest_axis).T


def _transported(
    base: FloatArray,
    direction: FloatArray,
    rest: FloatArray,
    rest_axis: FloatArray,
    reference: FloatArray,
) -> FloatArray:
    """Bending axis (T, 3) that an untwisted limb along `direction` would have on a torso turned by
    `base`."""
    first = rotvec_to_rotmat(swing_between(unit(rest), unit(reference)))
    local = np.einsum("tba,tb->ta", base, direction)
    second = rotvec_to_rotmat(swing_between(np.broadcast_to(unit(reference), local.shape), local))
    axis = np.einsum("tab,tbc,c->ta", base, second, first @ rest_axis)
    across: FloatArray = unit(axis - (axis * direction).sum(-1, keepdims=True) * direction)
    return across


def _twist(
    direction: FloatArray, expected: FloatArray, seen: FloatArray, weight: FloatArray, width: float
) -> FloatArray:
    """Smooth angle (T,) about `direction` from the expected to the seen bending axis.

    Minimizes sum w |z - z_seen|^2 + width^2 |z_t+1 - z_t|^2 + a little |z - 1|^2 over unit-circle
    angles as complex numbers: frames without a bend (w = 0) follow their neighbors, and the
    reference if no frame has a bend.
    """
    from scipy.linalg import solveh_banded

    seen = seen - (seen * direction).sum(-1, keepdims=True) * direction
    size = np.linalg.norm(seen, axis=-1)
    seen = seen / np.maximum(size, 1e-12)[:, None]
    other = np.cross(direction, expected)
    observed = (seen * expected).sum(-1) + 1j * (seen * other).sum(-1)
    weight = np.where(size > 1e-9, weight, 0.0)
    rigid, prior = max(width, 1e-3) ** 2, 0.02
    frames = len(direction)
    diagonal = (
        weight
        + prior
        + rigid * np.r_[0.0, np.ones(frames - 1)]
        + rigid * np.r_[np.ones(frames - 1), 0.0]
    )
    banded = np.zeros((2, frames))
    banded[1] = diagonal
    banded[0, 1:] = -rigid
    right = weight * observed + prior
    both = np.stack([right.real, right.imag], -1)
    solution = solveh_banded(banded, both) if frames > 1 else both / diagonal[:, None]
    angle: FloatArray = np.arctan2(solution[:, 1], solution[:, 0])
    return angle


def _rotated(vectors: FloatArray, axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Rotate vectors (T, 3), which are perpendicular to the unit vectors `axis`, about these by
    `angle` (T,)."""
    turned: FloatArray = (
        vectors * np.cos(angle)[:, None] + np.cross(axis, vectors) * np.sin(angle)[:, None]
    )
    return turned
