"""Limbs of plain joints that reach for a place: feet that stand still, hands that are held. Knees and elbows give way.

The pipeline cleans feet on a person's rig, with heels, toes and soles (`a2v.animation.grounding`); here a foot is an ankle and a toe.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.animation.contacts import ContactSettings, find_contacts
from a2v.animation.curves import bridged, near, runs
from a2v.kinematics import Skeleton, inverse_kinematics
from a2v.kinematics.ground import heading, yaw_to_rotmat
from a2v.motion.wishes import Hold
from a2v.types import BoolArray, FloatArray, IntArray, Motion

#: When an ankle or a toe counts as standing: wider than on a rig, as steered feet slide while they should stand.
CONTACTS = ContactSettings(height_on=0.05, height_off=0.08, speed_on=0.7, speed_off=1.1)
PACE_SHARE = 0.9
"""Share of the pace that a standing foot may slide with on a path, before it is held: feet of people who run round a bend slide with them."""
REACH = 0.999
"""Share of a limb's length that is its longest."""
SMOOTH_SECONDS = 0.05
"""Of what moves a foot: a contact begins and ends without a jerk."""
EASE_SECONDS = 0.3
"""Over which a limb goes to where it is held, and from there."""


def limb_of(skeleton: Skeleton, joint: int) -> tuple[int, int, int] | None:
    """Shoulder, elbow and wrist, or hip, knee and ankle, that bring a joint (one of the last two of its chain) to a place; else None."""
    tops = (*(skeleton.hips or ()), *(skeleton.shoulders or ()))
    chain = next((chain for chain in skeleton.chains if joint in chain[-2:] and len(chain) > 3), None)
    if chain is None or chain[-4] not in tops:
        return None
    return chain[-4], chain[-3], chain[-2]


def lock_feet(motion: Motion, skeleton: Skeleton, *, kept: Sequence[int] = (), pace: float = 0.0, settings: ContactSettings = CONTACTS) -> Motion:
    """A clip whose feet stay where they stand: each contact at its middle place, corrections smooth between; bones keep their lengths.

    The root keeps its path, and the frames `kept` their poses. On a path that is taken at `pace`, metres a second, feet count as standing
    up to `PACE_SHARE` of that. A skeleton whose feet are no ends of limbs is left as it is.
    """
    faster = max(1.0, PACE_SHARE * pace / settings.speed_on)
    settings = dataclasses.replace(settings, speed_on=faster * settings.speed_on, speed_off=faster * settings.speed_off)
    joints = motion.joints.astype(np.float64)
    fixed = np.zeros(len(joints), bool)
    fixed[list(kept)] = True
    for toe in skeleton.feet:
        limb = limb_of(skeleton, toe)
        if limb is not None and toe not in limb:
            _reach(joints, limb, toe, _correction(joints[:, [limb[2], toe]], motion.fps, fixed, settings))
    return _with_joints(motion, joints, skeleton)


def hold_limbs(motion: Motion, skeleton: Skeleton, holds: Sequence[Hold]) -> Motion:
    """A clip whose held hands and feet are where they shall be, as far as limbs reach; they get there and leave within `EASE_SECONDS`."""
    joints = motion.joints.astype(np.float64)
    times = np.arange(len(joints)) / motion.fps
    for hold in holds:
        joint = skeleton.index(hold.joint)
        limb, on = limb_of(skeleton, joint), (times >= hold.start - 1e-6) & (times <= hold.end + 1e-6)
        if limb is not None and on.any():
            weight = near(on, EASE_SECONDS * motion.fps)[:, None]
            _reach(joints, limb, joint, weight * (held_at(hold, joints, skeleton) - joints[:, joint]))
    return _with_joints(motion, joints, skeleton)


def held_at(hold: Hold, joints: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Where a held joint shall be (T, 3) in frames with `joints` (T, J, 3)."""
    if not hold.body:
        return np.broadcast_to(np.array(hold.at, np.float64), joints[:, 0].shape)
    placed: FloatArray = joints[:, 0] + yaw_to_rotmat(heading(joints, skeleton)) @ np.array(hold.at, np.float64)
    return placed


def _reach(joints: FloatArray, limb: tuple[int, int, int], joint: int, move: FloatArray) -> None:
    """Move the end of a limb, and what hangs on it, by `move` (T, 3), in place."""
    top, middle, end = limb
    new_middle, new_end = bend_to(joints[:, top], joints[:, middle], joints[:, end], joints[:, end] + move)
    if joint != end:
        joints[:, joint] += new_end - joints[:, end]
    joints[:, middle], joints[:, end] = new_middle, new_end


def _with_joints(motion: Motion, joints: FloatArray, skeleton: Skeleton) -> Motion:
    rotations = inverse_kinematics(joints, skeleton).astype(np.float32)
    return dataclasses.replace(motion, joints=joints.astype(np.float32), rotations=rotations)


def _correction(foot: FloatArray, fps: float, fixed: BoolArray, settings: ContactSettings) -> FloatArray:
    """What moves a foot (T, 2, 3), ankle and toe, so that it stands still where either of them is on the ground, and not where `fixed`: (T, 3), level."""
    ground = np.quantile(foot[..., 1], 0.05, axis=0)
    on = np.stack([find_contacts(foot[:, part, 1] - ground[part], foot[:, part], fps, settings) for part in (0, 1)])
    move = np.full((len(foot), 3), np.nan)
    for start, end in runs(on.any(axis=0)):
        held = np.zeros((end - start, 2))
        for at in range(start + 1, end):
            part = 1 if on[1, at] and on[1, at - 1] else 0  # the toe holds where it stands, else the heel
            held[at - start] = held[at - start - 1] - (foot[at, part] - foot[at - 1, part])[[0, 2]]
        stays: IntArray = np.flatnonzero(fixed[start:end])
        move[start:end, [0, 2]] = held - (held[stays].mean(axis=0) if len(stays) else held.mean(axis=0))
        move[start:end, 1] = 0
    move[fixed] = 0
    smooth: FloatArray = gaussian_filter1d(bridged(move), SMOOTH_SECONDS * fps, axis=0, mode="nearest")
    smooth *= 1 - near(fixed, EASE_SECONDS * fps)[:, None]
    return smooth


def bend_to(hip: FloatArray, knee: FloatArray, ankle: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Knee and ankle (T, 3), or elbow and wrist, of a limb that reaches for `target`, in the plane in which it is bent; as far as it is long."""
    upper, lower = (np.linalg.norm(part, axis=-1, keepdims=True) for part in (knee - hip, ankle - knee))
    way = target - hip
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    direction = way / np.maximum(distance, 1e-9)
    longest = np.maximum(REACH * (upper + lower), np.linalg.norm(ankle - hip, axis=-1, keepdims=True))
    reached = np.clip(distance, np.abs(upper - lower) + 1e-6, np.minimum(longest, upper + lower))
    along = (upper**2 - lower**2 + reached**2) / (2 * reached)
    forward = knee - hip
    forward = forward - (forward * direction).sum(-1, keepdims=True) * direction
    forward /= np.maximum(np.linalg.norm(forward, axis=-1, keepdims=True), 1e-9)
    out = np.sqrt(np.maximum(upper**2 - along**2, 0))
    return hip + along * direction + out * forward, hip + reached * direction
