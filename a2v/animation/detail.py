"""Fingers and faces of motions that have joints for the fingers and a joint in front of the
face."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from a2v.animation.hands import FINGERS, Hand, finger_bones, turn_bones
from a2v.animation.rig import SIDES, Rig
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat, swing_between
from a2v.kinematics.skeleton import subtree
from a2v.types import FloatArray, Motion

FRONT = "head_front"
"""Name of a joint in front of the face: the head's own joint does not give the direction of the
face."""
KNUCKLES = ("index", "middle", "little")
HEAD_SHARE = 0.6
"""Share of a turn of the head that the head takes rather than the neck."""


def detail_joints(motion: Motion) -> dict[str, FloatArray]:
    """Joints of a clip besides the canonical ones: ``left_index_1`` to ``left_index_4`` and so on,
    and `FRONT`; each (T, 3) float64, in the clip's units.

    A hand is left out if one of its fingers lacks its three joints.
    """
    found: dict[str, FloatArray] = {}
    joints = motion.joints.astype(np.float64)
    if FRONT in motion.joint_names:
        found[FRONT] = joints[:, motion.joint_names.index(FRONT)]
    for side in SIDES:
        fingers = finger_bones(motion.joint_names, side)
        if set(fingers) != set(FINGERS):
            continue
        for finger, chain in fingers.items():
            ends = np.flatnonzero(motion.parents == chain[-1])
            for place, joint in enumerate([*chain, *ends[:1].tolist()], 1):
                found[f"{side}_{finger}_{place}"] = joints[:, joint]
    return found


def follow_hands(
    transforms: FloatArray,
    rig: Rig,
    names: Sequence[str],
    source: Mapping[str, FloatArray],
    known: FloatArray,
) -> FloatArray:
    """Give bone transforms the palms and fingers of a motion.

    The forearm takes the turn of the palm about it, the wrist takes the rest. Fingers keep the
    directions that they have relative to the hand.

    Parameters
    ----------
    transforms : (T, B, 4, 4)
        World from bone.
    rig : Rig
    names : B str
    source : dict of joint to (T, 3)
        `detail_joints` and canonical ones, in the same world.
    known : (T,) float
        Weight of the motion's hands in [0, 1] against the hands of `transforms`.
    """
    out = transforms
    for side in SIDES:
        hand = Hand.of(rig, names, side)
        if hand is None or f"{side}_index_1" not in source:
            continue
        out = out.copy() if out is transforms else out
        axes = _hand_axes(source, side)
        _turn_palm(out, rig, hand, axes, known)
        own = _rig_axes(out, rig, hand)
        for finger in FINGERS:
            points = [
                source[key]
                for place in range(1, 5)
                if (key := f"{side}_{finger}_{place}") in source
            ]
            told = [unit(after - before) for before, after in itertools.pairwise(points)]
            told += [told[-1]] * (3 - len(told))
            for place, (segment, direction) in enumerate(
                zip(hand.segments(rig, finger), told, strict=True)
            ):
                bones = hand.fingers[finger][place:]
                now = out[:, bones[0], :3, :3] @ (rig.rest[bones[0]].T @ segment)
                wanted = np.einsum("tab,tb,tac->tc", axes, direction, own)
                turn_bones(
                    out, bones, rotvec_to_rotmat(known[:, None] * swing_between(now, wanted))
                )
    return out


def follow_face(
    transforms: FloatArray, rig: Rig, source: Mapping[str, FloatArray], known: FloatArray
) -> FloatArray:
    """Turn the head of bone transforms (T, B, 4, 4) towards `FRONT` by the weight `known` (T,) in
    [0, 1]; the neck takes a share."""
    chain = rig.chains["neck"]
    if FRONT not in source or "head_top" not in source or "head" not in rig.bones or not chain:
        return transforms
    up = unit(source["head_top"] - source["head"])
    ahead = source[FRONT] - source["head"]
    wanted = unit(ahead - (ahead * up).sum(-1, keepdims=True) * up)
    out, head = transforms.copy(), rig.bones["head"]
    for bone, share in [*((bone, (1 - HEAD_SHARE) / len(chain)) for bone in chain), (head, 1.0)]:
        face = out[:, head, :3, :3] @ (rig.rest[head].T @ np.array([0.0, 0.0, 1.0]))
        turn_bones(
            out,
            subtree(rig.parents, bone),
            rotvec_to_rotmat((share * known)[:, None] * swing_between(face, wanted)),
        )
    return out


def _hand_axes(source: Mapping[str, FloatArray], side: str) -> FloatArray:
    """Directions (T, 3, 3) along a motion's hand, out of its palm and towards its thumb, one per
    row."""
    wrist = source[f"{side}_wrist"]
    index, middle, little = (source[f"{side}_{finger}_1"] for finger in KNUCKLES)
    along = unit(middle - wrist)
    across = np.cross(index - wrist, little - wrist) * (1 if side == "right" else -1)
    palm = unit(across - (across * along).sum(-1, keepdims=True) * along)
    return np.stack([along, palm, np.cross(palm, along) * (-1 if side == "right" else 1)], axis=1)


def _rig_axes(transforms: FloatArray, rig: Rig, hand: Hand) -> FloatArray:
    """The directions of `_hand_axes` for a rig's hand under transforms (T, B, 4, 4)."""
    side = np.cross(hand.palm, hand.along) * (-1 if hand.side == "right" else 1)
    turned = transforms[:, hand.wrist, :3, :3] @ rig.rest[hand.wrist].T
    axes: FloatArray = np.einsum("tab,kb->tka", turned, np.stack([hand.along, hand.palm, side]))
    return axes


def _turn_palm(out: FloatArray, rig: Rig, hand: Hand, axes: FloatArray, known: FloatArray) -> None:
    """Turn forearm and wrist in place so that the hand has the directions `axes` (T, 3, 3)."""
    along, palm = (_rig_axes(out, rig, hand)[:, place] for place in (0, 1))
    wanted = axes[:, 1] - (axes[:, 1] * along).sum(-1, keepdims=True) * along
    angle = np.arctan2((np.cross(palm, wanted) * along).sum(-1), (palm * wanted).sum(-1))
    angle = np.unwrap(angle)
    angle -= 2 * np.pi * np.round(np.median(angle) / (2 * np.pi))
    steps = [
        *rig.chains[f"{hand.side}_elbow"],
        hand.wrist,
    ]  # each bone turns with its parent, plus a share of its own
    turn = rotvec_to_rotmat((known * angle / len(steps))[:, None] * along)
    for bone in steps:
        turn_bones(out, subtree(rig.parents, bone), turn)
    swing = swing_between(_rig_axes(out, rig, hand)[:, 0], axes[:, 0])
    turn_bones(out, subtree(rig.parents, hand.wrist), rotvec_to_rotmat(known[:, None] * swing))
