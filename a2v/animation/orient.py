"""Orient a rig's bones to follow a motion's joints: torso, collars, head; limbs are in `limbs`."""

from __future__ import annotations

import numpy as np

from a2v.animation.limbs import orient_arm, orient_leg
from a2v.animation.posture import Posture, upright_back
from a2v.animation.rig import SIDES, Rig
from a2v.animation.source import middle
from a2v.animation.task import Task
from a2v.geometry.vectors import frame_along
from a2v.kinematics import rotmat_to_rotvec, rotvec_to_rotmat, swing_between
from a2v.types import FloatArray


def orient_bones(task: Task) -> FloatArray:
    """World rotations (T, B, 3, 3) float64 of a rig's bones from their rest orientation.

    Hips, spine and shoulders orient pelvis and chest; the bend between them is distributed over the
    spine. Collars, head and limbs follow.
    """
    source, rig, frames = task.source, task.rig, task.frames
    rotmats: dict[int, FloatArray] = {}
    pelvis, chest = _torso(task)
    if task.limits:
        chest = pelvis @ task.limited(np.swapaxes(pelvis, 1, 2) @ chest, "spine")
    for bone in range(rig.bones["pelvis"] + 1):
        rotmats[bone] = pelvis
    bend = rotmat_to_rotvec(np.swapaxes(pelvis, 1, 2) @ chest)
    spine = rig.chains["spine"]
    for place, bone in enumerate(spine):
        rotmats[bone] = pelvis @ rotvec_to_rotmat(bend * ((place + 1) / len(spine)))
    if not spine:
        chest = pelvis
    back = upright_back(
        middle(source, "shoulder") - middle(source, "hip"), pelvis, task.posture, rig
    )
    for _ in range(
        3 if spine else 0
    ):  # swing the spine so that the shoulders have the right direction from the hips
        heads = _heads(rotmats, rig, frames)
        now = 0.5 * (heads[rig.bones["left_shoulder"]] + heads[rig.bones["right_shoulder"]])
        now = now - 0.5 * (heads[rig.bones["left_hip"]] + heads[rig.bones["right_hip"]])
        swing = rotvec_to_rotmat(swing_between(now, back))
        for bone in spine:
            rotmats[bone] = swing @ rotmats[bone]
        chest = swing @ chest
    _orient_collars(rotmats, task, chest)
    _orient_head(rotmats, task, chest)
    for side in SIDES:
        orient_arm(rotmats, task, chest, side)
        orient_leg(rotmats, task, pelvis, side)
    stacked = np.zeros((frames, len(rig.parents), 3, 3))
    for bone, parent in enumerate(rig.parents):
        stacked[:, bone] = rotmats[bone] if bone in rotmats else stacked[:, parent]
    return stacked


def _torso(task: Task) -> tuple[FloatArray, FloatArray]:
    """World rotations (T, 3, 3) of pelvis and chest from rest."""
    source, rig = task.source, task.rig
    hips, shoulders = middle(source, "hip"), middle(source, "shoulder")
    across_hips = source["left_hip"] - source["right_hip"]
    across_shoulders = source["left_shoulder"] - source["right_shoulder"]
    rest_hips, rest_shoulders = rig.middle("hip"), rig.middle("shoulder")
    rest_across = (
        rig.joints["left_hip"] - rig.joints["right_hip"],
        rig.joints["left_shoulder"] - rig.joints["right_shoulder"],
    )
    # the joint nearest to the middle of the back divides the torso; the rig's back is divided at
    # the same height
    names = sorted(name for name in source if name.startswith("spine"))
    height = np.linalg.norm(shoulders - hips, axis=-1)
    best, share = "", 0.0
    for name in names:
        below = np.linalg.norm(source[name] - hips, axis=-1)
        fraction = float(
            np.median(
                below / np.maximum(below + np.linalg.norm(shoulders - source[name], axis=-1), 1e-9)
            )
        )
        if 0.25 <= fraction <= 0.75 and (not best or abs(fraction - 0.5) < abs(share - 0.5)):
            best, share = name, fraction
    if not best or float(np.median(height)) < 1e-9:
        torso, rest_torso = shoulders - hips, rest_shoulders - rest_hips
        pelvis = frame_along(across_hips, torso) @ frame_along(rest_across[0], rest_torso).T
        chest = frame_along(torso, across_shoulders) @ frame_along(rest_torso, rest_across[1]).T
        return pelvis, chest
    lower, upper = source[best] - hips, shoulders - source[best]
    rest_lower, rest_upper = _neutral_back(task.posture, best, rig, share)
    pelvis = frame_along(across_hips, lower) @ frame_along(rest_across[0], rest_lower).T
    chest = frame_along(upper, across_shoulders) @ frame_along(rest_upper, rest_across[1]).T
    return pelvis, chest


def _neutral_back(
    posture: Posture, joint: str, rig: Rig, share: float
) -> tuple[FloatArray, FloatArray]:
    """Return the directions of the lower and the upper back of a person who stands upright and
    faces +z."""
    if joint in posture.back:
        return posture.back[joint]
    hips, shoulders = rig.middle("hip"), rig.middle("shoulder")
    back = np.stack([hips, *(rig.heads[bone] for bone in rig.chains["spine"][1:]), shoulders])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(back, axis=0), axis=1))])
    point = np.array([np.interp(share * along[-1], along, back[:, axis]) for axis in range(3)])
    return point - hips, shoulders - point


def _orient_collars(rotmats: dict[int, FloatArray], task: Task, chest: FloatArray) -> None:
    """Swing the collar bones so that the shoulders have the motion's directions from their
    middle."""
    source, rig = task.source, task.rig
    chest_top = middle(source, "shoulder")
    heads = _heads(rotmats, rig, task.frames)
    now = 0.5 * (heads[rig.bones["left_shoulder"]] + heads[rig.bones["right_shoulder"]])
    for side in SIDES:
        chain = rig.chains[f"{side}_collar"]
        if not chain:
            continue
        reach = source[f"{side}_shoulder"] - chest_top
        ratio = (
            0.5
            * rig.length("left_shoulder", "right_shoulder")
            / max(float(np.median(np.linalg.norm(reach, axis=-1))), 1e-9)
        )
        pivot = heads[chain[0]]
        swing = rotvec_to_rotmat(
            swing_between(heads[rig.bones[f"{side}_shoulder"]] - pivot, now + reach * ratio - pivot)
        )
        swing = task.limited(swing, "collar")
        for bone in chain:
            rotmats[bone] = swing @ chest


def _orient_head(rotmats: dict[int, FloatArray], task: Task, chest: FloatArray) -> None:
    """Point the neck at the motion's head; the skull keeps the neutral angle between neck and
    face."""
    source, rig = task.source, task.rig
    if "head" not in source or "head" not in rig.bones or not rig.chains["neck"]:
        return
    base = source["neck"] if "neck" in source else middle(source, "shoulder")
    rest = rig.joints["head"] - rig.joints["neck"]
    local = np.einsum("tba,tb->ta", chest, source["head"] - base)
    swing = task.limited(
        rotvec_to_rotmat(swing_between(np.broadcast_to(rest, local.shape), local)), "neck"
    )
    for bone in rig.chains["neck"]:
        rotmats[bone] = chest @ swing
    tilt = rotvec_to_rotmat(
        swing_between(rest if task.posture.neck is None else task.posture.neck, rest)
    )
    skull = rotvec_to_rotmat(swing_between(np.broadcast_to(rest, local.shape), local @ tilt.T))
    rotmats[rig.bones["head"]] = chest @ task.limited(skull, "neck")


def _heads(rotmats: dict[int, FloatArray], rig: Rig, frames: int) -> list[FloatArray]:
    """Return the heads (T, 3) of the bones relative to the first one. A bone without an entry in
    `rotmats` has the rotation of its parent."""
    heads: list[FloatArray] = []
    worn: list[FloatArray] = []
    for bone, parent in enumerate(rig.parents):
        if parent < 0:
            heads.append(np.zeros((frames, 3)))
        else:
            heads.append(heads[parent] + worn[parent] @ (rig.heads[bone] - rig.heads[parent]))
        worn.append(rotmats[bone] if bone in rotmats else worn[parent])
    return heads
