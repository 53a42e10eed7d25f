"""Retarget motions: from the joints of any person's skeleton to the bones of a body's rig."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from a2v.animation.clearance import clear_arms
from a2v.animation.contacts import ContactSettings
from a2v.animation.detail import detail_joints
from a2v.animation.entrance import enter_from, in_world
from a2v.animation.grounding import clean_contacts
from a2v.animation.holding import hold_solids
from a2v.animation.life import LifeSettings, enliven, share_of, swayed
from a2v.animation.orient import orient_bones
from a2v.animation.posture import standing_posture, straightened
from a2v.animation.rig import SIDES, Rig, rig_of, sole_points
from a2v.animation.source import (
    LEANING,
    aligned,
    middle,
    source_joints,
    source_leg_length,
    upright_rotmat,
)
from a2v.animation.task import Task
from a2v.errors import InputError
from a2v.kinematics.foot_contacts import steps_under
from a2v.kinematics.ground import smoothed
from a2v.types import Body, FloatArray, Motion


@dataclass(frozen=True)
class RetargetSettings:
    """Settings of retargeting.

    Attributes
    ----------
    raw : bool
        Skip the clean-up of contacts: feet may slide and sink as in the motion.
    align : bool
        Turn and move the motion so that in the first frame the person stands at x = z = 0 and faces
        +z.
    level : {"auto", "always", "never"}
        Whether to turn the motion upright by balance (`upright_rotmat`). "auto" does so for data
        sets that were reconstructed from tilted cameras (HumanAct12, NTU-VIBE) and trusts the
        vertical of motion capture.
    steps : {"auto", "always", "never"}
        Whether feet may stand on steps, whose heights are found
        (`a2v.kinematics.foot_contacts.steps_under`); "auto" does so if `rises` is set in the
        motion's provenance. Without steps, a person who is above the ground for long is moved back
        to it.
    limits : bool
        Keep joints within a human's range.
    smoothing : float
        Width (standard deviation) in seconds of the symmetric Gaussian over the motion's joints; no
        lag. 0 for none.
    twist_smoothing : float
        Time constant in seconds of the smoothing of the limbs' twist.
    contacts : ContactSettings
        Detection and locking of foot contacts.
    clear_arms : bool
        Keep arms out of the trunk and the thighs (`a2v.animation.clearance`); not with `raw`.
    from_photo : bool
        Begin in the pose of the photo and blend into the motion (`a2v.animation.entrance`).
    life : LifeSettings
        Hands, gaze, breath and sway, which a motion's joints do not contain (`a2v.animation.life`).
    """

    raw: bool = False
    align: bool = True
    level: str = "auto"
    steps: str = "auto"
    limits: bool = True
    smoothing: float = 0.02
    twist_smoothing: float = 0.06
    contacts: ContactSettings = field(default_factory=ContactSettings)
    clear_arms: bool = True
    from_photo: bool = False
    life: LifeSettings = field(default_factory=LifeSettings)


def retarget(
    motion: Motion, body: Body, *, settings: RetargetSettings = RetargetSettings()
) -> FloatArray:
    """Make a body's rig follow a motion's joints.

    Hips, spine and shoulders orient pelvis and chest; the bend between them is distributed over the
    spine. Arms, legs, feet, neck and hands take the motion's bone directions exactly. The twist of
    a limb comes from the plane of its bent elbow or knee (for straight legs also from the feet).
    Where the limb is straight, it fades smoothly to an untwisted reference. The path over the
    ground is scaled by the ratio of leg lengths. Unless ``settings.raw``, foot contacts are found,
    locked and put on the ground (`clean_contacts`), and arms are kept out of the trunk
    (`clear_arms`).

    Parameters
    ----------
    motion : Motion
        One clip, T frames, any skeleton whose joints `canonical_joints` recognizes; any unit of
        length.
    body : Body
        Its rest pose stands upright and faces +z.
    settings : RetargetSettings

    Returns
    -------
    (T, B, 4, 4) float32
        World from bone, meters, y up; the ground is y = 0.

    Raises
    ------
    InputError
        The motion is a batch, or lacks a joint of the limbs, or has no size.
    """
    for name in ("level", "steps"):
        if getattr(settings, name) not in ("auto", "always", "never"):
            raise InputError(
                f"{name} is '{getattr(settings, name)}'; choose from auto, always, never"
            )
    rig = rig_of(body)
    source = {**detail_joints(motion), **source_joints(motion)}
    if settings.smoothing > 0:
        source = {
            name: smoothed(points, settings.smoothing * motion.fps)
            for name, points in source.items()
        }
    scale = rig.leg_length / source_leg_length(source)
    source = {name: points * scale for name, points in source.items()}
    if settings.level == "always" or (settings.level == "auto" and motion.skeleton in LEANING):
        rotmat = upright_rotmat(source, motion.fps)
        source = {name: points @ rotmat.T for name, points in source.items()}
    if settings.align:
        source = aligned(source)
    steps = _steps(source, motion.fps) if has_steps(motion, settings) else None
    posture = standing_posture(motion)
    source = swayed(straightened(source, posture, rig), motion.fps, settings.life)
    task = Task(
        source=source,
        rig=rig,
        posture=posture,
        fps=motion.fps,
        limits=settings.limits,
        twist_smoothing=settings.twist_smoothing,
    )
    transforms = _assemble(orient_bones(task), middle(source, "hip"), rig)
    if settings.raw:
        transforms[..., 1, 3] -= _floor(transforms, rig)
    else:
        before = transforms[:, 0, 1, 3]
        transforms = clean_contacts(transforms, rig, motion.fps, settings.contacts, steps)
        transforms[..., 1, 3] += (
            share_of(motion, "air", len(transforms)) * (before - transforms[:, 0, 1, 3])
        )[:, None]
    transforms = enliven(transforms, rig, body.bone_names, motion, settings.life, source)
    if not settings.raw:
        transforms = clear_arms(transforms, rig, motion.fps) if settings.clear_arms else transforms
        transforms = transforms if steps is None else hold_solids(transforms, rig, body, motion.fps)
    if settings.from_photo:
        transforms = enter_from(transforms, in_world(body), body.bone_parents, fps=motion.fps)
    return transforms.astype(np.float32)


def has_steps(motion: Motion, settings: RetargetSettings = RetargetSettings()) -> bool:
    """Return whether the feet of a motion may stand on steps on the given body."""
    if settings.raw or settings.steps == "never":
        return False
    return settings.steps == "always" or bool(np.any(motion.provenance.get("rises", [False])))


def _steps(source: dict[str, FloatArray], fps: float) -> FloatArray | None:
    """Heights (2, T) of the surface under the feet of canonical joints (T, 3); None without
    toes."""
    if any(f"{side}_foot" not in source for side in SIDES) or len(source["pelvis"]) < 4:
        return None
    feet = np.stack(
        [np.stack([source[f"{side}_ankle"], source[f"{side}_foot"]], axis=1) for side in SIDES]
    )
    return steps_under(feet, source["pelvis"], fps)[0]


def _assemble(rotmats: FloatArray, hips: FloatArray, rig: Rig) -> FloatArray:
    """World transforms (T, B, 4, 4) from the bones' rotations (T, B, 3, 3) from rest and the path
    of the middle of the hips (T, 3)."""
    frames, count = rotmats.shape[:2]
    transforms = np.zeros((frames, count, 4, 4))
    transforms[..., 3, 3] = 1
    transforms[..., :3, :3] = rotmats @ rig.rest
    for bone, parent in enumerate(rig.parents):
        if parent >= 0:
            transforms[:, bone, :3, 3] = transforms[:, parent, :3, 3] + rotmats[:, parent] @ (
                rig.heads[bone] - rig.heads[parent]
            )
    now = 0.5 * (
        transforms[:, rig.bones["left_hip"], :3, 3] + transforms[:, rig.bones["right_hip"], :3, 3]
    )
    transforms[..., :3, 3] += (hips - now)[:, None]
    return transforms


def _floor(transforms: FloatArray, rig: Rig) -> float:
    """Height of the ground under a clip, from the soles when they are low."""
    low = np.minimum(*(sole_points(transforms, rig, side)[..., 1].min(-1) for side in SIDES))
    return float(np.quantile(low, 0.1))
