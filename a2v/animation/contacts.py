"""Feet that stand still on the ground: contact detection, locking and ground alignment by two-bone inverse kinematics."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass

import numpy as np

from a2v.animation.rig import SIDES, Rig, joints_of, place, sole_points
from a2v.kinematics import rotmat_to_rotvec, rotvec_to_rotmat, swing_between
from a2v.types import BoolArray, FloatArray

_MARGIN = 0.003
"""Metres that soles stay over the ground: skinning moves them a little against their bones."""


_SLACK = 0.006
"""Metres by which a stretched leg may miss its place before the pelvis comes down: less is not seen, bent knees are."""


@dataclass(frozen=True)
class ContactSettings:
    """When a foot counts as standing, and how gently it is held.

    Attributes
    ----------
    height_on, height_off : float
        Metres of heel or toes over the ground under which a contact starts, and over which it ends.
    speed_on, speed_off : float
        Metres a second: likewise.
    clearance : float
        Metres of air under a foot that moves fast (over 0.5 m/s) without a contact.
    blend : float
        Seconds over which a foot turns flat and a pelvis is lowered.
    shortest : float
        Seconds; shorter contacts are dropped, shorter gaps are filled.
    flight : float
        Seconds: whoever touches nothing for longer does not jump but drifts, and is brought back to the ground; 0 never does.
    follow_ground : float
        Seconds over which a slowly drifting ground level is followed (HumanAct12's floors are not level); 0 for a rigid one.
    """

    height_on: float = 0.04
    height_off: float = 0.075
    speed_on: float = 0.45
    speed_off: float = 0.9
    clearance: float = 0.03
    blend: float = 0.12
    shortest: float = 0.09
    flight: float = 0.8
    follow_ground: float = 0.5


def clean_contacts(transforms: FloatArray, rig: Rig, fps: float, settings: ContactSettings = ContactSettings()) -> FloatArray:
    """Put a retargeted clip on the ground and keep its standing feet where they are.

    1. The ground level is found under the body's lowest points and followed where it drifts; then finely under the standing feet.
    2. Heel and toes are in contact while they are low and slow (with hysteresis).
    3. A foot in contact turns flat where heel and toes both touch; its touching end is held at one place, the heel handing
       over to the toes as the foot rolls. Between contacts the correction runs smoothly from one to the next.
    4. Body parts under the ground lift the pelvis, the standing feet carry it along, legs too short to reach lower it; all smoothly.
    5. Toes bend while the heel is raised; a fast foot keeps clear of the ground. Thigh and shin follow by two-bone inverse kinematics in the knee's own plane.

    Parameters
    ----------
    transforms : (T, B, 4, 4) float64
        World from bone, metres, y up.
    rig : Rig
    fps : float
    settings : ContactSettings

    Returns
    -------
    (T, B, 4, 4) float64
        The ground is y = 0.
    """
    transforms = transforms.copy()
    transforms[..., 1, 3] -= _ground(transforms, rig, fps, settings)[:, None]
    transforms[..., 1, 3] -= _drift(transforms, rig, fps, settings)[:, None]
    transforms[..., 1, 3] += _lift(transforms, rig, fps, settings)[:, None]
    left, right = (_plan_foot(transforms, rig, side, fps, settings) for side in SIDES)
    plans = dict(zip(SIDES, (_cleared(left, right), _cleared(right, left)), strict=True))
    pelvis = _carried(plans, fps, settings)
    transforms[..., :3, 3] += pelvis[:, None]
    transforms[..., 1, 3] += _lift(transforms, rig, fps, settings)[:, None]
    drop = np.zeros(len(transforms))
    for side in SIDES:
        drop = np.maximum(drop, _needed_drop(transforms, rig, side, plans[side].ankle))
    transforms[..., 1, 3] -= _eased(drop, 0.5 * settings.blend * fps)[:, None]
    for side in SIDES:
        _reach(transforms, rig, side, plans[side])
    return transforms


@dataclass(frozen=True)
class _Plan:
    """What a foot should do: `ankle` (T, 3), additional turn `extra` (T, 3, 3), toes bent by `toes` (T,) radians, and in
    which frames it is `on` the ground (T,); `move` (T, 3) is the ankle's displacement, `height` (T,) the sole's over the ground,
    `rise` (T,) what a fast foot should have at least."""

    ankle: FloatArray
    extra: FloatArray
    toes: FloatArray
    on: BoolArray
    move: FloatArray
    rise: FloatArray
    height: FloatArray


def find_contacts(
    heights: FloatArray,
    points: FloatArray,
    fps: float,
    settings: ContactSettings = ContactSettings(),
) -> BoolArray:
    """Frames (T,) in which a point stands on the ground, by height and speed with hysteresis.

    Parameters
    ----------
    heights : (T,) float
        Metres over the ground.
    points : (T, 3) float
        Positions, metres, whose speed counts.
    fps : float
    """
    speed = _speed(points, fps)
    sure = (heights < settings.height_on) & (speed < settings.speed_on)
    maybe = (heights < settings.height_off) & (speed < settings.speed_off)
    on = np.zeros(len(heights), dtype=bool)
    for start, end in _runs(maybe):
        inside = np.flatnonzero(sure[start:end])
        if len(inside):  # from the first sure frame on until it is clearly over
            on[start + inside[0] : end] = True
    least = max(1, round(settings.shortest * fps))
    for start, end in _runs(~on):
        if start > 0 and end < len(on) and end - start <= least and (heights[start:end] < settings.height_off).all():
            on[start:end] = True
    for start, end in _runs(on):
        if end - start < min(least, len(on)):
            on[start:end] = False
    return on


def _ground(transforms: FloatArray, rig: Rig, fps: float, settings: ContactSettings) -> FloatArray:
    """Level (T,) of the ground under a clip whose root may rise or sink slowly, as generated ones do.

    Nobody flies for longer than `ContactSettings.flight`: the lower envelope (a morphological opening) of the body's lowest point, smoothed.
    """
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d, minimum_filter1d

    soles = np.minimum(*(sole_points(transforms, rig, side)[..., 1].min(-1) for side in SIDES))
    if settings.flight <= 0:
        return np.full(len(transforms), np.quantile(soles, 0.1))
    lowest = np.minimum(soles, place(rig.skin, transforms)[..., 1].min(-1))
    reach = max(1, round(settings.flight * fps))
    envelope = maximum_filter1d(minimum_filter1d(lowest, reach, mode="nearest"), reach, mode="nearest")
    smooth: FloatArray = gaussian_filter1d(envelope, reach / 2, mode="nearest")
    level: FloatArray = smooth + float(np.quantile(soles - smooth, 0.1))
    return level


def _drift(transforms: FloatArray, rig: Rig, fps: float, settings: ContactSettings) -> FloatArray:
    """Level (T,) of the ground under slow, low feet, followed over `follow_ground` seconds."""
    frames = len(transforms)
    if settings.follow_ground <= 0:
        return np.zeros(frames)
    joints = joints_of(transforms, rig)
    total, weight = np.zeros(frames), np.full(frames, 1e-3)
    for side in SIDES:
        height = sole_points(transforms, rig, side)[..., 1].min(-1)
        slow = np.minimum(_speed(joints[f"{side}_ankle"], fps), _speed(joints[f"{side}_foot"], fps))
        sure = np.exp(-((slow / settings.speed_on) ** 2)) * (np.abs(height) < 0.1)
        total += sure * height
        weight += sure
    # the foot that stands lower is the one on the ground: weigh by evidence, smooth both
    from scipy.ndimage import gaussian_filter1d

    sigma = settings.follow_ground * fps
    smooth: FloatArray = gaussian_filter1d(total, sigma, mode="nearest") / gaussian_filter1d(weight, sigma, mode="nearest")
    return smooth


def _lift(transforms: FloatArray, rig: Rig, fps: float, settings: ContactSettings) -> FloatArray:
    """How far (T,) body parts other than the legs sink below the ground, eased in time."""
    feet = set()
    for side in SIDES:
        feet |= _below(rig, rig.bones[f"{side}_ankle"])
    bones, points = rig.skin
    rest = ~np.isin(bones, list(feet))
    at_rest = np.einsum("kab,kb->ka", rig.rest[bones], points) + rig.heads[bones]
    rest &= at_rest[:, 1] > max(rig.joints[f"{side}_ankle"][1] for side in SIDES) + 0.12  # the ankles go with the feet
    if not rest.any():
        return np.zeros(len(transforms))
    lowest = place((bones[rest], points[rest]), transforms)[..., 1].min(-1)
    return _eased(np.maximum(0.002 - lowest, 0), settings.blend * fps)


def _plan_foot(transforms: FloatArray, rig: Rig, side: str, fps: float, settings: ContactSettings) -> _Plan:
    frames, foot = len(transforms), rig.bones[f"{side}_ankle"]
    turn, ankle = transforms[:, foot, :3, :3], transforms[:, foot, :3, 3]
    toe, offsets = rig.soles[side]  # in the foot's frame
    at_rest = offsets @ rig.rest[foot].T
    bottom = at_rest[:, 1] < at_rest[:, 1].min() + 0.02
    middle = 0.5 * (at_rest[:, 2].min() + at_rest[:, 2].max())
    front, back = bottom & (at_rest[:, 2] > middle), bottom & (at_rest[:, 2] <= middle)
    ball = rig.rest[foot].T @ (rig.joints[f"{side}_foot"] - rig.heads[foot]) if f"{side}_foot" in rig.joints else offsets[front].mean(0)
    heel = offsets[np.where(bottom, at_rest[:, 2], np.inf).argmin()]
    sole = offsets @ np.swapaxes(turn, 1, 2) + ankle[:, None]
    ball_height = float((rig.rest[foot] @ ball)[1] - at_rest[:, 1].min())
    # toes give way: what counts is the ball of the foot, or the toes where they are the lower
    front_height = np.minimum((turn @ ball + ankle)[:, 1] - ball_height, np.maximum(sole[:, front, 1].min(-1), -0.01))
    toes_on = find_contacts(front_height, turn @ ball + ankle, fps, settings)
    heel_on = find_contacts(sole[:, back, 1].min(-1), turn @ heel + ankle, fps, settings)
    on = toes_on | heel_on
    extra = _flattened(turn @ rig.rest[foot].T, toes_on & heel_on, settings.blend * fps)
    new_turn = extra @ turn
    bend = _toe_bend(new_turn @ rig.rest[foot].T, toes_on, settings.blend * fps)
    placed = _bent(offsets, toe, ball, rig.rest[foot], bend) @ np.swapaxes(new_turn, 1, 2) + ankle[:, None]
    points = {True: new_turn @ ball + ankle, False: new_turn @ heel + ankle}
    move = np.full((frames, 3), np.nan)
    for start, end in _runs(on):
        correction = np.zeros((end - start, 2))
        anchor = points[bool(toes_on[start])][start, ::2].copy()
        for i in range(1, end - start):
            t = start + i
            end_on = bool(toes_on[t])
            if end_on != bool(toes_on[t - 1]):  # the foot rolls over: the other end is held from here
                anchor = points[end_on][t, ::2] + correction[i - 1]
            correction[i] = anchor - points[end_on][t, ::2]
        move[start:end, ::2] = correction - correction.mean(0)
    lowest = placed[..., 1].min(-1)
    move[on, 1] = _MARGIN - lowest[on]
    move = _bridged(move)
    # off the ground nothing sinks, and what moves fast keeps clear of it
    path = (points[True] + move)[:, ::2]
    speed = np.linalg.norm(np.diff(path, axis=0), axis=-1) * fps if frames > 1 else np.zeros(0)
    fastest = np.maximum(np.r_[speed, 0.0], np.r_[0.0, speed])
    rise = settings.clearance * np.clip((fastest - 0.3) / 0.2, 0, 1) * ~on
    rise = np.where(on, 0.0, _eased(rise, 0.05 * fps)) if rise.any() else rise
    move[:, 1] = np.maximum(move[:, 1], _MARGIN - lowest)
    return _Plan(ankle + move, extra, bend, on, move, rise, lowest + move[:, 1])


def _cleared(plan: _Plan, other: _Plan) -> _Plan:
    """The plan with its fast foot kept clear of the ground, but not the lower one of two: somebody has to stand."""
    share = np.clip((plan.height - other.height + 0.03) / 0.04, 0, 1)
    up = np.maximum(plan.rise * share + _MARGIN - plan.height, 0)[:, None] * np.array([0.0, 1.0, 0.0])
    return dataclasses.replace(plan, ankle=plan.ankle + up, move=plan.move + up)


def _toe_bend(turn: FloatArray, toes_on: BoolArray, width: float) -> FloatArray:
    """Angle (T,) by which toes bend up against the foot so that they stay level while the heel is raised."""
    forward = turn[:, :, 2]
    dip = np.arcsin(np.clip(-forward[:, 1], -1, 1))
    bend: FloatArray = np.clip(dip, 0, np.deg2rad(50)) * _near(toes_on, width)
    return bend


def _bent(offsets: FloatArray, toe: BoolArray, ball: FloatArray, rest: FloatArray, bend: FloatArray) -> FloatArray:
    """Points of a foot (T, K, 3) in its bone's frame with the toes bent up about the ball of the foot."""
    axis = rest.T @ np.array([1.0, 0, 0])
    turns = rotvec_to_rotmat(-bend[:, None] * axis)
    points = np.tile(offsets, (len(bend), 1, 1))
    # toes turn about their roots, at the height of the ball
    points[:, toe] = (offsets[toe] - ball) @ np.swapaxes(turns, 1, 2) + ball
    return points


def _carried(plans: dict[str, _Plan], fps: float, settings: ContactSettings) -> FloatArray:
    """Displacement (T, 3) of the pelvis that carries it along with the standing feet, so that legs keep their bend."""
    from scipy.ndimage import gaussian_filter1d

    weights = {side: _near(plan.on, settings.blend * fps) for side, plan in plans.items()}
    total = sum(weights.values())
    mean = sum(weights[side][:, None] * plan.move for side, plan in plans.items()) / np.maximum(total, 1e-9)[:, None]
    mean[total < 1e-3] = np.nan
    smooth: FloatArray = gaussian_filter1d(_bridged(mean), 0.5 * settings.blend * fps, axis=0, mode="nearest")
    return smooth


def _flattened(turn: FloatArray, flat: BoolArray, width: float) -> FloatArray:
    """Extra rotations (T, 3, 3) that lay a foot (turned by `turn` from rest) flat, with one heading a contact."""
    frames = len(turn)
    forward = turn[:, :, 2]
    heading = np.unwrap(np.arctan2(forward[:, 0], forward[:, 2]))
    steady = heading.copy()
    for start, end in _runs(flat):
        steady[start:end] = np.median(heading[start:end])
    gap = np.where(flat, steady - heading, np.nan)[:, None]
    heading = heading + _bridged(gap)[:, 0] * _near(flat, width)
    zero = np.zeros(frames)
    level = rotvec_to_rotmat(np.stack([zero, heading, zero], -1))
    # only feet that are nearly flat anyway are laid flat
    lean = rotmat_to_rotvec(level @ np.swapaxes(turn, 1, 2))
    angle = np.linalg.norm(lean, axis=-1)
    ease = _near(flat, width) * np.clip((np.deg2rad(60) - angle) / np.deg2rad(25), 0, 1)
    return rotvec_to_rotmat(lean * ease[:, None])


def _needed_drop(transforms: FloatArray, rig: Rig, side: str, ankle: FloatArray) -> FloatArray:
    """How far (T,) the pelvis must come down for the leg to reach `ankle`."""
    hip = transforms[:, rig.bones[f"{side}_hip"], :3, 3]
    longest = 0.9998 * (rig.length(f"{side}_hip", f"{side}_knee") + rig.length(f"{side}_knee", f"{side}_ankle"))
    gap = ankle - hip
    flat = (gap[:, ::2] ** 2).sum(-1)
    reach = np.sqrt(np.maximum(longest**2 - flat, (0.3 * longest) ** 2))
    needed: FloatArray = np.clip(-gap[:, 1] - reach - _SLACK, 0, 0.3)
    return needed


def _reach(transforms: FloatArray, rig: Rig, side: str, plan: _Plan) -> None:
    """Two-bone inverse kinematics, in place: bring ankle, foot and toes to where `plan` has them."""
    target, extra = plan.ankle, plan.extra
    hip_bone, knee_bone, foot = (rig.bones[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
    hip, knee, ankle = (transforms[:, bone, :3, 3].copy() for bone in (hip_bone, knee_bone, foot))
    upper, lower = np.linalg.norm(knee - hip, axis=-1), np.linalg.norm(ankle - knee, axis=-1)
    old, new = ankle - hip, target - hip
    swing = rotvec_to_rotmat(swing_between(old, new))
    last = rig.chains[f"{side}_hip"][-1]
    side_axis = (transforms[:, last, :3, :3] @ rig.rest[last].T)[:, :, 0]  # at rest knees bend about the left-pointing axis
    bend = np.cross(knee - hip, ankle - knee)
    sine = np.linalg.norm(bend, axis=-1) / np.maximum(upper * lower, 1e-12)
    weight = np.clip((sine - 0.05) / 0.2, 0, 1)[:, None]
    axis = weight * bend / np.maximum(np.linalg.norm(bend, axis=-1, keepdims=True), 1e-12) + (1 - weight) * side_axis
    axis = np.einsum("tab,tb->ta", swing, axis)
    direction = new / np.maximum(np.linalg.norm(new, axis=-1, keepdims=True), 1e-12)
    axis -= (axis * direction).sum(-1, keepdims=True) * direction
    axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-12)
    distance = np.clip(np.linalg.norm(new, axis=-1), np.abs(upper - lower) + 1e-4, upper + lower - 1e-6)
    cosine = (upper**2 + distance**2 - lower**2) / (2 * upper * distance)
    opening = np.arccos(np.clip(cosine, -1, 1))
    thigh = rotvec_to_rotmat(-opening[:, None] * axis)
    new_knee = hip + np.einsum("tab,tb->ta", thigh, direction) * upper[:, None]
    new_ankle = hip + direction * distance[:, None]
    thigh_turn = rotvec_to_rotmat(swing_between(np.einsum("tab,tb->ta", swing, knee - hip), new_knee - hip)) @ swing
    shin_turn = rotvec_to_rotmat(swing_between(np.einsum("tab,tb->ta", thigh_turn, ankle - knee), new_ankle - new_knee)) @ thigh_turn
    below_knee, below_foot = _below(rig, knee_bone), _below(rig, foot)
    for bone in _below(rig, hip_bone):
        if bone in below_foot:
            turn, pivot, to = extra, ankle, new_ankle
        elif bone in below_knee:
            turn, pivot, to = shin_turn, knee, new_knee
        else:
            turn, pivot, to = thigh_turn, hip, hip
        arm = transforms[:, bone, :3, 3] - pivot
        transforms[:, bone, :3, 3] = np.einsum("tab,tb->ta", turn, arm) + to
        transforms[:, bone, :3, :3] = turn @ transforms[:, bone, :3, :3]
    across = (transforms[:, foot, :3, :3] @ rig.rest[foot].T)[:, :, 0]
    bend = rotvec_to_rotmat(-plan.toes[:, None] * across)
    for root in (bone for bone in below_foot if int(rig.parents[bone]) == foot):
        pivot = transforms[:, root, :3, 3].copy()
        for bone in _below(rig, root):
            transforms[:, bone, :3, 3] = np.einsum("tab,tb->ta", bend, transforms[:, bone, :3, 3] - pivot) + pivot
            transforms[:, bone, :3, :3] = bend @ transforms[:, bone, :3, :3]


def _below(rig: Rig, bone: int) -> set[int]:
    """`bone` and all bones that hang on it."""
    found = {bone}
    for other in range(bone + 1, len(rig.parents)):
        if int(rig.parents[other]) in found:
            found.add(other)
    return found


def _speed(points: FloatArray, fps: float) -> FloatArray:
    """Speed (T,) in metres a second: the slower of the steps before and after a frame, so that a contact keeps its ends."""
    if len(points) < 2:
        return np.zeros(len(points))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1) * fps
    slower: FloatArray = np.minimum(np.r_[steps[0], steps], np.r_[steps, steps[-1]])
    return slower


def _runs(flags: BoolArray) -> list[tuple[int, int]]:
    """Runs of True as (first, one past the last)."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False].astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _bridged(values: FloatArray) -> FloatArray:
    """Fill NaN rows (T, C): smoothly from one filled row to the next, constant beyond the ends, zero without any."""
    known = np.flatnonzero(np.isfinite(values[:, 0]))
    if len(known) == 0:
        return np.zeros_like(values)
    out = values.copy()
    out[: known[0]], out[known[-1] + 1 :] = values[known[0]], values[known[-1]]
    for a, b in itertools.pairwise(known):
        if b - a > 1:
            t = (np.arange(a + 1, b) - a)[:, None] / (b - a)
            out[a + 1 : b] = values[a] + (values[b] - values[a]) * (t * t * (3 - 2 * t))
    return out


def _near(flags: BoolArray, width: float) -> FloatArray:
    """1 on flags, easing to 0 over `width` frames around them."""
    from scipy.ndimage import distance_transform_edt

    if not flags.any():
        return np.zeros(len(flags))
    t = np.clip(1 - distance_transform_edt(~flags) / max(width + 1, 1.0), 0, 1)
    eased: FloatArray = t * t * (3 - 2 * t)
    return eased


def _eased(values: FloatArray, width: float) -> FloatArray:
    """A smooth curve (T,) that is nowhere under `values`: widened by a maximum filter, then smoothed."""
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d

    if values.max(initial=0.0) <= 0:
        return np.zeros(len(values))
    half = max(1, round(width))
    wide = maximum_filter1d(values, 2 * half + 1, mode="nearest")
    smooth: FloatArray = gaussian_filter1d(wide, half / 2, mode="nearest", truncate=2.0)
    upper: FloatArray = np.maximum(smooth, values)
    return upper
