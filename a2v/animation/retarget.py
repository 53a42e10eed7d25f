"""From the joints of any person's skeleton to the bones of a body's rig."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from a2v.animation.contacts import ContactSettings, clean_contacts
from a2v.animation.posture import Posture, foot_pitch, standing_posture, straightened, upright_back
from a2v.animation.rig import SIDES, Rig, rig_of, sole_points
from a2v.errors import InputError
from a2v.kinematics import rotmat_to_rotvec, rotvec_to_rotmat, swing_between
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.types import Body, FloatArray, Motion


@dataclass(frozen=True)
class RetargetSettings:
    """How a motion is put on a body.

    Attributes
    ----------
    raw : bool
        Skip the contact clean-up: feet may slide and sink as they do in the motion.
    align : bool
        Turn and move the motion so that in the first frame the person stands at x = z = 0 and faces +z.
    level : {"auto", "always", "never"}
        Whether to turn the motion upright by balance (`upright_turn`). "auto" does so for data sets that were reconstructed
        from tilted cameras (HumanAct12, NTU-VIBE) and trusts the vertical of motion capture.
    limits : bool
        Keep joints within a human's range.
    smoothing : float
        Width (standard deviation) in seconds of the symmetric Gaussian over the motion's joints; no lag. 0 for none.
    twist_smoothing : float
        Time constant in seconds of the smoothing of the limbs' twist.
    contacts : ContactSettings
        Detection and locking of foot contacts.
    """

    raw: bool = False
    align: bool = True
    level: str = "auto"
    limits: bool = True
    smoothing: float = 0.02
    twist_smoothing: float = 0.06
    contacts: ContactSettings = field(default_factory=ContactSettings)


_LIMITS = {"spine": 110.0, "neck": 60.0, "collar": 30.0, "wrist": 70.0}
_ARM_REFERENCE = np.array([0.75, -0.35, 0.56])  # left arm in the middle of its range: the antipode is out of reach
_LEG_REFERENCE = np.array([0.08, -0.9, 0.43])


def retarget(motion: Motion, body: Body, *, settings: RetargetSettings = RetargetSettings()) -> FloatArray:
    """Move a body's rig as a motion's joints move.

    Pelvis and chest are oriented by hips, spine and shoulders, the bend between them is shared out over the spine;
    arms, legs, feet, neck and hands take the motion's bone directions exactly; the twist of a limb comes from the plane
    of its bent elbow or knee (feet help straight legs) and fades to an untwisted reference, smoothly over time, where the
    limb is straight. The path over the ground is scaled by the ratio of leg lengths. Unless ``settings.raw``, foot contacts
    are found, locked and put on the ground (`clean_contacts`).

    Parameters
    ----------
    motion : Motion
        One clip, T frames, any skeleton whose joints `canonical_joints` recognises; any unit of length.
    body : Body
        Its rest pose stands upright and faces +z.
    settings : RetargetSettings

    Returns
    -------
    (T, B, 4, 4) float32
        World from bone, metres, y up; the ground is y = 0.

    Raises
    ------
    InputError
        The motion is a batch, or lacks a joint of the limbs, or has no size.
    """
    if settings.level not in ("auto", "always", "never"):
        raise InputError(f"level is '{settings.level}'; choose from auto, always, never")
    rig = rig_of(body)
    source = source_joints(motion)
    if settings.smoothing > 0:
        source = {name: _gaussian(points, settings.smoothing * motion.fps) for name, points in source.items()}
    scale = rig.leg_length / source_leg_length(source)
    source = {name: points * scale for name, points in source.items()}
    if settings.level == "always" or (settings.level == "auto" and motion.skeleton in ("humanact12", "ntu_vibe")):
        turn = upright_turn(source, motion.fps)
        source = {name: points @ turn.T for name, points in source.items()}
    if settings.align:
        source = _aligned(source)
    posture = standing_posture(motion)
    source = straightened(source, posture, rig)
    turns = _turns(source, rig, posture, motion.fps, settings)
    hips = 0.5 * (source["left_hip"] + source["right_hip"])
    transforms = _assemble(turns, hips, rig)
    if settings.raw:
        transforms[..., 1, 3] -= _floor(transforms, rig)
    else:
        transforms = clean_contacts(transforms, rig, motion.fps, settings.contacts)
    return transforms.astype(np.float32)


def source_joints(motion: Motion) -> dict[str, FloatArray]:
    """Canonical joints (T, 3) float64 of a clip, in its own units.

    Raises
    ------
    InputError
        A batch, or a skeleton without a person's joints.
    """
    if motion.batch:
        raise InputError(f"retarget takes one clip; this Motion is a batch of shape {motion.batch}: index it first")
    found = canonical_joints(motion.joint_names, motion.parents.tolist())
    if missing := missing_joints(found):
        raise InputError(
            f"the motion's skeleton '{motion.skeleton}' has no {', '.join(missing[:4])} among {', '.join(motion.joint_names[:8])}...; "
            "rename its joints to Mixamo's, CMU's or SMPL's names"
        )
    return {name: motion.joints[:, index].astype(np.float64) for name, index in found.items()}


def upright_turn(source: dict[str, FloatArray], fps: float) -> FloatArray:
    """Rotation (3, 3) that makes a standing person balanced, for motions whose vertical leans with the camera.

    Whoever stands still has the centre of mass over the feet: the mean direction from the feet to the centre of mass over
    upright frames in which the hips hardly move, turned to +y. At most 20 degrees; the identity without such frames.

    Parameters
    ----------
    source : dict of canonical joint to (T, 3)
        Metres, y roughly up.
    fps : float
    """
    hips, shoulders = _middle(source, "hip"), _middle(source, "shoulder")
    ankles = _middle(source, "ankle")
    feet = 0.4 * ankles + 0.6 * _middle(source, "foot") if "left_foot" in source and "right_foot" in source else ankles
    lean = 0.6 * hips + 0.4 * shoulders - feet
    speed = np.linalg.norm(np.gradient(hips, axis=0), axis=-1) * fps if len(hips) > 1 else np.zeros(len(hips))
    legs = np.mean([np.linalg.norm(source[f"{side}_hip"] - source[f"{side}_ankle"], axis=-1) for side in SIDES], axis=0)
    upright = (legs > 0.85 * source_leg_length(source)) & (_unit(lean)[:, 1] > np.cos(np.deg2rad(35)))
    still = np.exp(-((speed / 0.4) ** 2)) * upright
    if still.sum() < 0.25 * fps and still.sum() < 0.3 * len(hips):
        return np.eye(3)
    mean = (still[:, None] * _unit(lean)).sum(0)
    swing = swing_between(mean, np.array([0.0, 1.0, 0.0]))
    angle = float(np.linalg.norm(swing))
    return rotvec_to_rotmat(swing * min(1.0, np.deg2rad(20) / max(angle, 1e-9)))


def heading_turn(source: dict[str, FloatArray]) -> FloatArray:
    """Rotation (3, 3) about y that makes the first frame face +z, by hips and shoulders."""
    across = source["left_hip"][0] - source["right_hip"][0] + 0.5 * (source["left_shoulder"][0] - source["right_shoulder"][0])
    yaw = 0.0 if np.hypot(across[0], across[2]) < 1e-9 else float(np.arctan2(across[2], across[0]))
    return rotvec_to_rotmat(np.array([0.0, yaw, 0.0]))


def source_leg_length(source: dict[str, FloatArray]) -> float:
    """Median length of thigh plus shin in a clip, its units."""
    total = 0.0
    for side in SIDES:
        for a, b in (("hip", "knee"), ("knee", "ankle")):
            total += float(np.median(np.linalg.norm(source[f"{side}_{b}"] - source[f"{side}_{a}"], axis=-1))) / 2
    if total <= 1e-9:
        raise InputError("the motion's legs have no length; check its joints")
    return total


# ------------------------------------------------------------------------------------------------------------- turns


def _turns(source: dict[str, FloatArray], rig: Rig, posture: Posture, fps: float, settings: RetargetSettings) -> FloatArray:
    """World rotations (T, B, 3, 3) of the bones from their rest orientation."""
    frames = len(source["pelvis"])
    turns: dict[int, FloatArray] = {}
    pelvis, chest = _torso(source, rig, posture)
    if settings.limits:
        chest = pelvis @ _limited(np.swapaxes(pelvis, 1, 2) @ chest, _LIMITS["spine"])
    for bone in range(rig.bones["pelvis"] + 1):
        turns[bone] = pelvis
    bend = rotmat_to_rotvec(np.swapaxes(pelvis, 1, 2) @ chest)
    spine = rig.chains["spine"]
    for place, bone in enumerate(spine):
        turns[bone] = pelvis @ rotvec_to_rotmat(bend * ((place + 1) / len(spine)))
    if not spine:
        chest = pelvis
    back = upright_back(_middle(source, "shoulder") - _middle(source, "hip"), pelvis, posture, rig)
    for _ in range(3 if spine else 0):  # swing the spine so that the shoulders lie where they should from the hips
        heads = _heads(turns, rig, frames)
        now = 0.5 * (heads[rig.bones["left_shoulder"]] + heads[rig.bones["right_shoulder"]])
        now = now - 0.5 * (heads[rig.bones["left_hip"]] + heads[rig.bones["right_hip"]])
        swing = rotvec_to_rotmat(swing_between(now, back))
        for bone in spine:
            turns[bone] = swing @ turns[bone]
        chest = swing @ chest
    _collars(turns, source, rig, chest, settings)
    _head(turns, source, rig, chest, posture, settings)
    for side in SIDES:
        _arm(turns, source, rig, chest, side, fps, settings)
        _leg(turns, source, rig, pelvis, posture, side, fps, settings)
    stacked = np.zeros((frames, len(rig.parents), 3, 3))
    for bone, parent in enumerate(rig.parents):
        stacked[:, bone] = turns[bone] if bone in turns else stacked[:, parent]
    return stacked


def _torso(source: dict[str, FloatArray], rig: Rig, posture: Posture) -> tuple[FloatArray, FloatArray]:
    """World rotations (T, 3, 3) of pelvis and chest from rest."""
    hips, shoulders = _middle(source, "hip"), _middle(source, "shoulder")
    across_hips = source["left_hip"] - source["right_hip"]
    across_shoulders = source["left_shoulder"] - source["right_shoulder"]
    rest_hips, rest_shoulders = rig.middle("hip"), rig.middle("shoulder")
    rest_across = rig.joints["left_hip"] - rig.joints["right_hip"], rig.joints["left_shoulder"] - rig.joints["right_shoulder"]
    # the joint nearest to the middle of the back divides the torso; the rig's back is divided at the same height
    names = sorted(name for name in source if name.startswith("spine"))
    height = np.linalg.norm(shoulders - hips, axis=-1)
    best, share = "", 0.0
    for name in names:
        below = np.linalg.norm(source[name] - hips, axis=-1)
        fraction = float(np.median(below / np.maximum(below + np.linalg.norm(shoulders - source[name], axis=-1), 1e-9)))
        if 0.25 <= fraction <= 0.75 and (not best or abs(fraction - 0.5) < abs(share - 0.5)):
            best, share = name, fraction
    if not best or float(np.median(height)) < 1e-9:
        torso, rest_torso = shoulders - hips, rest_shoulders - rest_hips
        pelvis = _frame(across_hips, torso) @ _frame(rest_across[0], rest_torso).T
        chest = _frame(torso, across_shoulders) @ _frame(rest_torso, rest_across[1]).T
        return pelvis, chest
    lower, upper = source[best] - hips, shoulders - source[best]
    rest_lower, rest_upper = _neutral_back(posture, best, rig, share)
    pelvis = _frame(across_hips, lower) @ _frame(rest_across[0], rest_lower).T
    chest = _frame(upper, across_shoulders) @ _frame(rest_upper, rest_across[1]).T
    return pelvis, chest


def _neutral_back(posture: Posture, joint: str, rig: Rig, share: float) -> tuple[FloatArray, FloatArray]:
    """Directions of the lower and the upper back when the person stands upright and faces +z."""
    if joint in posture.back:
        return posture.back[joint]
    hips, shoulders = rig.middle("hip"), rig.middle("shoulder")
    back = np.stack([hips, *(rig.heads[bone] for bone in rig.chains["spine"][1:]), shoulders])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(back, axis=0), axis=1))])
    point = np.array([np.interp(share * along[-1], along, back[:, axis]) for axis in range(3)])
    return point - hips, shoulders - point


def _collars(turns: dict[int, FloatArray], source: dict[str, FloatArray], rig: Rig, chest: FloatArray, settings: RetargetSettings) -> None:
    frames = len(chest)
    middle = _middle(source, "shoulder")
    heads = _heads(turns, rig, frames)
    now = 0.5 * (heads[rig.bones["left_shoulder"]] + heads[rig.bones["right_shoulder"]])
    for side in SIDES:
        chain = rig.chains[f"{side}_collar"]
        if not chain:
            continue
        reach = source[f"{side}_shoulder"] - middle
        ratio = 0.5 * rig.length("left_shoulder", "right_shoulder") / max(float(np.median(np.linalg.norm(reach, axis=-1))), 1e-9)
        pivot = heads[chain[0]]
        swing = rotvec_to_rotmat(swing_between(heads[rig.bones[f"{side}_shoulder"]] - pivot, now + reach * ratio - pivot))
        if settings.limits:
            swing = _limited(swing, _LIMITS["collar"])
        for bone in chain:
            turns[bone] = swing @ chest


def _head(
    turns: dict[int, FloatArray], source: dict[str, FloatArray], rig: Rig, chest: FloatArray, posture: Posture, settings: RetargetSettings
) -> None:
    if "head" not in source or "head" not in rig.bones or not rig.chains["neck"]:
        return
    base = source["neck"] if "neck" in source else _middle(source, "shoulder")
    rest = rig.joints["head"] - rig.joints["neck"]
    local = np.einsum("tba,tb->ta", chest, source["head"] - base)
    swing = rotvec_to_rotmat(swing_between(np.broadcast_to(rest, local.shape), local))
    if settings.limits:
        swing = _limited(swing, _LIMITS["neck"])
    for bone in rig.chains["neck"]:
        turns[bone] = chest @ swing
    # the skull keeps the neutral angle between neck and face
    tilt = rotvec_to_rotmat(swing_between(rest if posture.neck is None else posture.neck, rest))
    turned = rotvec_to_rotmat(swing_between(np.broadcast_to(rest, local.shape), local @ tilt.T))
    turns[rig.bones["head"]] = chest @ (_limited(turned, _LIMITS["neck"]) if settings.limits else turned)


def _arm(
    turns: dict[int, FloatArray],
    source: dict[str, FloatArray],
    rig: Rig,
    chest: FloatArray,
    side: str,
    fps: float,
    settings: RetargetSettings,
) -> None:
    shoulder, elbow, wrist = (source[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist"))
    rest_upper = rig.joints[f"{side}_elbow"] - rig.joints[f"{side}_shoulder"]
    rest_fore = rig.joints[f"{side}_wrist"] - rig.joints[f"{side}_elbow"]
    rest_axis = np.cross(_unit(rest_upper), _unit(rest_fore))
    if np.linalg.norm(rest_axis) < 0.15:  # a straight rest arm: elbows bend forward
        rest_axis = np.cross(_unit(rest_upper), np.array([0.0, 0, 1]))
    mirror = np.array([1.0 if side == "left" else -1.0, 1, 1])
    upper, fore = _unit(elbow - shoulder), _unit(wrist - elbow)
    seen = np.cross(upper, fore)
    weight = _smoothstep(np.linalg.norm(seen, axis=-1), 0.12, 0.5)
    expected = _transported(chest, upper, rest_upper, rest_axis, _ARM_REFERENCE * mirror)
    angle = _twist(upper, expected, seen, weight, settings.twist_smoothing * fps)
    axis = _rotated(expected, upper, angle)
    _share_twist(turns, rig.chains[f"{side}_shoulder"], upper, expected, angle, rest_upper, rest_axis)
    forearm = _frame(fore, axis) @ _frame(rest_fore, rest_axis).T
    for bone in rig.chains[f"{side}_elbow"]:
        turns[bone] = forearm
    hand = forearm
    if f"{side}_hand" in source and f"{side}_hand" in rig.joints:
        rest_hand = rig.joints[f"{side}_hand"] - rig.joints[f"{side}_wrist"]
        local = np.einsum("tba,tb->ta", forearm, source[f"{side}_hand"] - wrist)
        # a hand that lies along the forearm in the source lies so in the rig too
        straight = rotvec_to_rotmat(swing_between(rest_fore, rest_hand))
        swing = rotvec_to_rotmat(swing_between(np.broadcast_to(rest_hand, local.shape), local @ straight.T))
        hand = forearm @ (_limited(swing, _LIMITS["wrist"]) if settings.limits else swing)
    turns[rig.bones[f"{side}_wrist"]] = hand


def _leg(
    turns: dict[int, FloatArray],
    source: dict[str, FloatArray],
    rig: Rig,
    pelvis: FloatArray,
    posture: Posture,
    side: str,
    fps: float,
    settings: RetargetSettings,
) -> None:
    hip, knee, ankle = (source[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
    rest_thigh = rig.joints[f"{side}_knee"] - rig.joints[f"{side}_hip"]
    rest_shin = rig.joints[f"{side}_ankle"] - rig.joints[f"{side}_knee"]
    rest_axis = np.array([1.0, 0, 0])
    mirror = np.array([1.0 if side == "left" else -1.0, 1, 1])
    thigh, shin = _unit(knee - hip), _unit(ankle - knee)
    bent = np.cross(thigh, shin)
    by_knee = _smoothstep(np.linalg.norm(bent, axis=-1), 0.15, 0.5)
    expected = _transported(pelvis, thigh, rest_thigh, rest_axis, _LEG_REFERENCE * mirror)
    seen = _unit(bent) * by_knee[:, None]
    weight = by_knee
    foot = _unit(source[f"{side}_foot"] - ankle) if f"{side}_foot" in source else None
    if foot is not None:
        plane = np.cross(foot, shin)
        by_foot = _smoothstep(np.linalg.norm(plane, axis=-1), 0.3, 0.8) * (1 - by_knee) * 0.7
        seen = seen + _unit(plane) * by_foot[:, None]
        weight = by_knee + by_foot
    angle = _twist(thigh, expected, seen, weight, settings.twist_smoothing * fps)
    axis = _rotated(expected, thigh, angle)
    _share_twist(turns, rig.chains[f"{side}_hip"], thigh, expected, angle, rest_thigh, rest_axis)
    lower = _frame(shin, axis) @ _frame(rest_shin, rest_axis).T
    for bone in rig.chains[f"{side}_knee"]:
        turns[bone] = lower
    turned = lower
    if foot is not None and f"{side}_foot" in rig.joints:
        rest_foot = rig.joints[f"{side}_foot"] - rig.joints[f"{side}_ankle"]
        axis = _unit(axis - (axis * foot).sum(-1, keepdims=True) * foot)
        pitch = foot_pitch(source, side, posture, rest_foot, fps)
        turned = rotvec_to_rotmat(axis * pitch) @ _frame(foot, axis) @ _frame(rest_foot, rest_axis).T
        if settings.limits:
            turned = lower @ _limited(np.swapaxes(lower, 1, 2) @ turned, 75.0)
    turns[rig.bones[f"{side}_ankle"]] = turned


# ------------------------------------------------------------------------------------------------------------- parts


def _share_twist(
    turns: dict[int, FloatArray],
    chain: list[int],
    direction: FloatArray,
    expected: FloatArray,
    angle: FloatArray,
    rest: FloatArray,
    rest_axis: FloatArray,
) -> None:
    """Turn the bones of an upper limb: all along `direction`, the twist growing from the first bone to the last."""
    for place, bone in enumerate(chain):
        axis = _rotated(expected, direction, angle * ((place + 1) / len(chain)))
        turns[bone] = _frame(direction, axis) @ _frame(rest, rest_axis).T


def _transported(base: FloatArray, direction: FloatArray, rest: FloatArray, rest_axis: FloatArray, reference: FloatArray) -> FloatArray:
    """Bending axis (T, 3) that an untwisted limb along `direction` would have on a torso turned by `base`."""
    first = rotvec_to_rotmat(swing_between(_unit(rest), _unit(reference)))
    local = np.einsum("tba,tb->ta", base, direction)
    second = rotvec_to_rotmat(swing_between(np.broadcast_to(_unit(reference), local.shape), local))
    axis = np.einsum("tab,tbc,c->ta", base, second, first @ rest_axis)
    across: FloatArray = _unit(axis - (axis * direction).sum(-1, keepdims=True) * direction)
    return across


def _twist(direction: FloatArray, expected: FloatArray, seen: FloatArray, weight: FloatArray, width: float) -> FloatArray:
    """Smooth angle (T,) about `direction` from the expected to the seen bending axis.

    Minimises sum w |z - z_seen|^2 + width^2 |z_t+1 - z_t|^2 + a little |z - 1|^2 over unit-circle angles as complex numbers:
    frames without a bend (w = 0) follow their neighbours, and the reference where there is none.
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
    diagonal = weight + prior + rigid * np.r_[0.0, np.ones(frames - 1)] + rigid * np.r_[np.ones(frames - 1), 0.0]
    banded = np.zeros((2, frames))
    banded[1] = diagonal
    banded[0, 1:] = -rigid
    right = weight * observed + prior
    both = np.stack([right.real, right.imag], -1)
    solution = solveh_banded(banded, both) if frames > 1 else both / diagonal[:, None]
    angle: FloatArray = np.arctan2(solution[:, 1], solution[:, 0])
    return angle


def _assemble(turns: FloatArray, hips: FloatArray, rig: Rig) -> FloatArray:
    """World transforms (T, B, 4, 4) from bone turns and the path of the middle of the hips (T, 3)."""
    frames, count = turns.shape[:2]
    transforms = np.zeros((frames, count, 4, 4))
    transforms[..., 3, 3] = 1
    transforms[..., :3, :3] = turns @ rig.rest
    for bone, parent in enumerate(rig.parents):
        if parent >= 0:
            transforms[:, bone, :3, 3] = transforms[:, parent, :3, 3] + turns[:, parent] @ (rig.heads[bone] - rig.heads[parent])
    now = 0.5 * (transforms[:, rig.bones["left_hip"], :3, 3] + transforms[:, rig.bones["right_hip"], :3, 3])
    transforms[..., :3, 3] += (hips - now)[:, None]
    return transforms


def _floor(transforms: FloatArray, rig: Rig) -> float:
    """Height of the ground under a clip: where the soles are when they are low."""
    low = np.minimum(*(sole_points(transforms, rig, side)[..., 1].min(-1) for side in SIDES))
    return float(np.quantile(low, 0.1))


def _heads(turns: dict[int, FloatArray], rig: Rig, frames: int) -> list[FloatArray]:
    """Bone heads (T, 3) relative to the first bone's, for bones that turn as `turns` or with their parents."""
    heads: list[FloatArray] = []
    worn: list[FloatArray] = []
    for bone, parent in enumerate(rig.parents):
        if parent < 0:
            heads.append(np.zeros((frames, 3)))
        else:
            heads.append(heads[parent] + worn[parent] @ (rig.heads[bone] - rig.heads[parent]))
        worn.append(turns[bone] if bone in turns else worn[parent])
    return heads


def _aligned(source: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Turn about y and move so that frame 0 faces +z above the origin."""
    turn = heading_turn(source)
    start = 0.5 * (source["left_hip"][0] + source["right_hip"][0]) * np.array([1.0, 0, 1])
    return {name: (points - start) @ turn.T for name, points in source.items()}


def _middle(source: dict[str, FloatArray], joint: str) -> FloatArray:
    return 0.5 * (source[f"left_{joint}"] + source[f"right_{joint}"])


def _unit(vectors: FloatArray) -> FloatArray:
    result: FloatArray = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
    return result


def _frame(first: FloatArray, second: FloatArray) -> FloatArray:
    """Rotations (..., 3, 3) whose first column is along `first` and whose second is as near as can be to `second`."""
    x = _unit(first)
    z = _unit(np.cross(x, second))
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _rotated(vectors: FloatArray, axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Vectors (T, 3) perpendicular to unit `axis` turned about it by `angle` (T,)."""
    turned: FloatArray = vectors * np.cos(angle)[:, None] + np.cross(axis, vectors) * np.sin(angle)[:, None]
    return turned


def _limited(turns: FloatArray, degrees: float) -> FloatArray:
    """Rotations (T, 3, 3) whose angle is softly kept under `degrees`."""
    rotvec = rotmat_to_rotvec(turns)
    angle = np.linalg.norm(rotvec, axis=-1, keepdims=True)
    limit = np.deg2rad(degrees)
    knee = 0.8 * limit  # identity up to there, then a smooth approach to the limit
    over = np.maximum(angle - knee, 0)
    soft = np.where(angle > knee, knee + (limit - knee) * np.tanh(over / (limit - knee)), angle)
    return rotvec_to_rotmat(rotvec * np.where(angle > 1e-9, soft / np.maximum(angle, 1e-9), 1.0))


def _smoothstep(values: FloatArray, low: float, high: float) -> FloatArray:
    t = np.clip((values - low) / (high - low), 0, 1)
    result: FloatArray = t * t * (3 - 2 * t)
    return result


def _gaussian(points: FloatArray, sigma: float) -> FloatArray:
    from scipy.ndimage import gaussian_filter1d

    if sigma < 0.15 or len(points) < 3:
        return points
    # linear extension beyond the ends, so that neither end is pulled inwards
    pad = min(len(points) - 1, int(4 * sigma) + 1)
    before = 2 * points[0] - points[pad:0:-1]
    after = 2 * points[-1] - points[-2 : -pad - 2 : -1]
    smooth: FloatArray = gaussian_filter1d(np.concatenate([before, points, after]), sigma, axis=0)[pad : pad + len(points)]
    return smooth
