"""Plan each foot between and during its contacts, and move the leg there by inverse kinematics."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.animation.contacts import ContactSettings, find_contacts
from a2v.animation.curves import bridged, eased, near, runs
from a2v.animation.rig import Rig
from a2v.kinematics import rotmat_to_rotvec, rotvec_to_rotmat, swing_between
from a2v.kinematics.skeleton import subtree
from a2v.types import BoolArray, FloatArray

_MARGIN = 0.003
"""Height of soles above the ground, meters: skinning moves them a little relative to their bones.
"""

_SLACK = 0.006
"""Largest miss of a stretched leg, meters, without lowering the pelvis: it is less visible than
bent knees."""


@dataclass(frozen=True, kw_only=True)
class FootPlan:
    """The planned motion of a foot: `ankle` (T, 3), additional rotation `extra` (T, 3, 3), toes
    bent by `toes` (T,) radians, and the frames in which it is `on` the ground (T,); `move` (T, 3)
    is the ankle's displacement, `height` (T,) the sole's height above the ground, `rise` (T,) the
    least height of a fast foot."""

    ankle: FloatArray
    extra: FloatArray
    toes: FloatArray
    on: BoolArray
    move: FloatArray
    rise: FloatArray
    height: FloatArray


def plan_foot(
    transforms: FloatArray,
    rig: Rig,
    side: str,
    fps: float,
    settings: ContactSettings,
    under: FloatArray | float = 0.0,
) -> FootPlan:
    """Plan one foot (`side`: "left" or "right") of bone transforms (T, B, 4, 4) whose surface is at
    height `under` (T,) above the ground y = 0."""
    frames, foot = len(transforms), rig.bones[f"{side}_ankle"]
    up = np.zeros((frames, 3))
    up[:, 1] = under
    rotmats, ankle = transforms[:, foot, :3, :3], transforms[:, foot, :3, 3] - up
    toe, offsets = rig.soles[side]  # in the foot's frame
    at_rest = offsets @ rig.rest[foot].T
    front, back = _halves(at_rest)
    ball = (
        rig.rest[foot].T @ (rig.joints[f"{side}_foot"] - rig.heads[foot])
        if f"{side}_foot" in rig.joints
        else offsets[front].mean(0)
    )
    heel = offsets[np.where(back, at_rest[:, 2], np.inf).argmin()]
    sole = offsets @ np.swapaxes(rotmats, 1, 2) + ankle[:, None]
    ball_height = float((rig.rest[foot] @ ball)[1] - at_rest[:, 1].min())
    # toes bend: the ball of the foot counts, or the toes where they are lower
    front_height = np.minimum(
        (rotmats @ ball + ankle)[:, 1] - ball_height, np.maximum(sole[:, front, 1].min(-1), -0.01)
    )
    toes_on = find_contacts(front_height, rotmats @ ball + ankle, fps, settings)
    heel_on = find_contacts(sole[:, back, 1].min(-1), rotmats @ heel + ankle, fps, settings)
    on = toes_on | heel_on
    extra = _flattened(rotmats @ rig.rest[foot].T, toes_on & heel_on, settings.blend * fps)
    new_rotmats = extra @ rotmats
    bend = _toe_bend(new_rotmats @ rig.rest[foot].T, toes_on, settings.blend * fps)
    placed = (
        _bent(offsets, toe, ball, rig.rest[foot], bend) @ np.swapaxes(new_rotmats, 1, 2)
        + ankle[:, None]
    )
    points = {True: new_rotmats @ ball + ankle, False: new_rotmats @ heel + ankle}
    move = np.full((frames, 3), np.nan)
    for start, end in runs(on):
        correction = np.zeros((end - start, 2))
        anchor = points[bool(toes_on[start])][start, ::2].copy()
        for i in range(1, end - start):
            t = start + i
            end_on = bool(toes_on[t])
            if end_on != bool(
                toes_on[t - 1]
            ):  # the foot rolls over: from here the other end is held
                anchor = points[end_on][t, ::2] + correction[i - 1]
            correction[i] = anchor - points[end_on][t, ::2]
        move[start:end, ::2] = correction - correction.mean(0)
    lowest = placed[..., 1].min(-1)
    move[on, 1] = _MARGIN - lowest[on]
    move = bridged(move)
    # without contact a foot does not sink below the ground, and a fast foot stays clear of it
    path = (points[True] + move)[:, ::2]
    speed = np.linalg.norm(np.diff(path, axis=0), axis=-1) * fps if frames > 1 else np.zeros(0)
    fastest = np.maximum(np.r_[speed, 0.0], np.r_[0.0, speed])
    rise = settings.clearance * np.clip((fastest - 0.3) / 0.2, 0, 1) * ~on
    rise = np.where(on, 0.0, eased(rise, 0.05 * fps)) if rise.any() else rise
    move[:, 1] = np.maximum(move[:, 1], _MARGIN - lowest)
    return FootPlan(
        ankle=ankle + move + up,
        extra=extra,
        toes=bend,
        on=on,
        move=move,
        rise=rise,
        height=lowest + move[:, 1],
    )


def _halves(points: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Return which points (K, 3) of a foot at rest are the sole of its front and of its back half.

    A foot that was saved on tiptoe touches the ground with one half. Of the other half the lowest
    points count; a foot without length is its own front and back.
    """
    ahead = points[:, 2] > 0.5 * (points[:, 2].min() + points[:, 2].max())

    def low(of: BoolArray) -> BoolArray:
        found: BoolArray = of & (points[:, 1] < points[of, 1].min() + 0.02)
        return found

    bottom = low(np.ones(len(points), bool))
    halves = []
    for half in (ahead, ~ahead):
        inside = bottom & half
        halves.append(inside if inside.any() else low(half if half.any() else bottom))
    return halves[0], halves[1]


def keep_clear(plan: FootPlan, other: FootPlan) -> FootPlan:
    """Keep a fast foot clear of the ground, except the lower of the two: one foot must stand."""
    share = np.clip((plan.height - other.height + 0.03) / 0.04, 0, 1)
    up = np.maximum(plan.rise * share + _MARGIN - plan.height, 0)[:, None] * np.array(
        [0.0, 1.0, 0.0]
    )
    return dataclasses.replace(plan, ankle=plan.ankle + up, move=plan.move + up)


def _toe_bend(rotmats: FloatArray, toes_on: BoolArray, width: float) -> FloatArray:
    """Return the angle (T,) by which toes bend up relative to the foot, so that they stay level
    while the heel is raised."""
    forward = rotmats[:, :, 2]
    dip = np.arcsin(np.clip(-forward[:, 1], -1, 1))
    bend: FloatArray = np.clip(dip, 0, np.deg2rad(50)) * near(toes_on, width)
    return bend


def _bent(
    offsets: FloatArray, toe: BoolArray, ball: FloatArray, rest: FloatArray, bend: FloatArray
) -> FloatArray:
    """Points of a foot (T, K, 3) in its bone's frame with the toes bent up about the ball of the
    foot."""
    axis = rest.T @ np.array([1.0, 0, 0])
    bent = rotvec_to_rotmat(-bend[:, None] * axis)
    points = np.tile(offsets, (len(bend), 1, 1))
    # toes turn about their roots, at the height of the ball
    points[:, toe] = (offsets[toe] - ball) @ np.swapaxes(bent, 1, 2) + ball
    return points


def carry_pelvis(plans: dict[str, FootPlan], fps: float, settings: ContactSettings) -> FloatArray:
    """Return the displacement (T, 3) of the pelvis that moves it along with the standing feet, so
    that legs keep their bend."""
    from scipy.ndimage import gaussian_filter1d

    weights = {side: near(plan.on, settings.blend * fps) for side, plan in plans.items()}
    total = sum(weights.values())
    mean = (
        sum(weights[side][:, None] * plan.move for side, plan in plans.items())
        / np.maximum(total, 1e-9)[:, None]
    )
    mean[total < 1e-3] = np.nan
    smooth: FloatArray = gaussian_filter1d(
        bridged(mean), 0.5 * settings.blend * fps, axis=0, mode="nearest"
    )
    return smooth


def _flattened(rotmats: FloatArray, flat: BoolArray, width: float) -> FloatArray:
    """Extra rotations (T, 3, 3) that lay a foot (rotated by `rotmats` from rest) flat, with one
    heading per contact."""
    frames = len(rotmats)
    forward = rotmats[:, :, 2]
    heading = np.unwrap(np.arctan2(forward[:, 0], forward[:, 2]))
    steady = heading.copy()
    for start, end in runs(flat):
        steady[start:end] = np.median(heading[start:end])
    gap = np.where(flat, steady - heading, np.nan)[:, None]
    heading = heading + bridged(gap)[:, 0] * near(flat, width)
    zero = np.zeros(frames)
    level = rotvec_to_rotmat(np.stack([zero, heading, zero], -1))
    # only feet that are already nearly flat are laid flat
    lean = rotmat_to_rotvec(level @ np.swapaxes(rotmats, 1, 2))
    angle = np.linalg.norm(lean, axis=-1)
    ease = near(flat, width) * np.clip((np.deg2rad(60) - angle) / np.deg2rad(25), 0, 1)
    return rotvec_to_rotmat(lean * ease[:, None])


def needed_drop(transforms: FloatArray, rig: Rig, side: str, ankle: FloatArray) -> FloatArray:
    """Return the distance (T,) by which the pelvis must come down for the leg to reach `ankle`."""
    hip = transforms[:, rig.bones[f"{side}_hip"], :3, 3]
    longest = 0.9998 * (
        rig.length(f"{side}_hip", f"{side}_knee") + rig.length(f"{side}_knee", f"{side}_ankle")
    )
    gap = ankle - hip
    flat = (gap[:, ::2] ** 2).sum(-1)
    reach = np.sqrt(np.maximum(longest**2 - flat, (0.3 * longest) ** 2))
    needed: FloatArray = np.clip(-gap[:, 1] - reach - _SLACK, 0, 0.3)
    return needed


def reach_plan(transforms: FloatArray, rig: Rig, side: str, plan: FootPlan) -> None:
    """Move ankle, foot and toes to `plan` by two-bone inverse kinematics, in place."""
    target, extra = plan.ankle, plan.extra
    hip_bone, knee_bone, foot = (rig.bones[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
    hip, knee, ankle = (transforms[:, bone, :3, 3].copy() for bone in (hip_bone, knee_bone, foot))
    upper, lower = np.linalg.norm(knee - hip, axis=-1), np.linalg.norm(ankle - knee, axis=-1)
    old, new = ankle - hip, target - hip
    swing = rotvec_to_rotmat(swing_between(old, new))
    last = rig.chains[f"{side}_hip"][-1]
    side_axis = (transforms[:, last, :3, :3] @ rig.rest[last].T)[
        :, :, 0
    ]  # at rest knees bend about the left-pointing axis
    bend = np.cross(knee - hip, ankle - knee)
    sine = np.linalg.norm(bend, axis=-1) / np.maximum(upper * lower, 1e-12)
    weight = np.clip((sine - 0.05) / 0.2, 0, 1)[:, None]
    axis = (
        weight * bend / np.maximum(np.linalg.norm(bend, axis=-1, keepdims=True), 1e-12)
        + (1 - weight) * side_axis
    )
    axis = np.einsum("tab,tb->ta", swing, axis)
    direction = new / np.maximum(np.linalg.norm(new, axis=-1, keepdims=True), 1e-12)
    axis -= (axis * direction).sum(-1, keepdims=True) * direction
    axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-12)
    distance = np.clip(
        np.linalg.norm(new, axis=-1), np.abs(upper - lower) + 1e-4, upper + lower - 1e-6
    )
    cosine = (upper**2 + distance**2 - lower**2) / (2 * upper * distance)
    opening = np.arccos(np.clip(cosine, -1, 1))
    thigh = rotvec_to_rotmat(-opening[:, None] * axis)
    new_knee = hip + np.einsum("tab,tb->ta", thigh, direction) * upper[:, None]
    new_ankle = hip + direction * distance[:, None]
    thigh_rotmats = (
        rotvec_to_rotmat(swing_between(np.einsum("tab,tb->ta", swing, knee - hip), new_knee - hip))
        @ swing
    )
    shin_rotmats = (
        rotvec_to_rotmat(
            swing_between(
                np.einsum("tab,tb->ta", thigh_rotmats, ankle - knee), new_ankle - new_knee
            )
        )
        @ thigh_rotmats
    )
    below_knee, below_foot = subtree(rig.parents, knee_bone), subtree(rig.parents, foot)
    for bone in subtree(rig.parents, hip_bone):
        if bone in below_foot:
            rotmats, pivot, to = extra, ankle, new_ankle
        elif bone in below_knee:
            rotmats, pivot, to = shin_rotmats, knee, new_knee
        else:
            rotmats, pivot, to = thigh_rotmats, hip, hip
        arm = transforms[:, bone, :3, 3] - pivot
        transforms[:, bone, :3, 3] = np.einsum("tab,tb->ta", rotmats, arm) + to
        transforms[:, bone, :3, :3] = rotmats @ transforms[:, bone, :3, :3]
    across = (transforms[:, foot, :3, :3] @ rig.rest[foot].T)[:, :, 0]
    bend = rotvec_to_rotmat(-plan.toes[:, None] * across)
    for root in (bone for bone in below_foot if int(rig.parents[bone]) == foot):
        pivot = transforms[:, root, :3, 3].copy()
        for bone in subtree(rig.parents, root):
            transforms[:, bone, :3, 3] = (
                np.einsum("tab,tb->ta", bend, transforms[:, bone, :3, 3] - pivot) + pivot
            )
            transforms[:, bone, :3, :3] = bend @ transforms[:, bone, :3, :3]
