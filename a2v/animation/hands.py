"""Pose fingers to suit the action, and turn palms as on hanging arms: motions have no joints beyond
the wrists."""

from __future__ import annotations

import csv
import functools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np

from a2v.animation.rig import SIDES, Rig
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat, swing_between
from a2v.kinematics.ground import smoothed
from a2v.kinematics.names import split_side, without_numbers
from a2v.kinematics.skeleton import subtree
from a2v.types import FloatArray, IntArray

HandPose = Literal[
    "rest", "relaxed", "flat", "grip", "hold", "fist", "point", "graceful", "spread"
]  # fmt: skip
HAND_POSES: tuple[str, ...] = get_args(HandPose)

FINGERS: tuple[str, ...] = ("thumb", "index", "middle", "ring", "little")
_TABLE = Path(__file__).with_name("hands.csv")
_FOLLOW = 0.35
"""Share of the wrist's bend by which fingers close when the hand bends back, and open when it bends
in, as tendons do."""


Direction = tuple[float, float, float]


@dataclass(frozen=True)
class _Shape:
    """Fingers and thumb of a hand.

    Attributes
    ----------
    flexion : 4 triples, index to little
        Flexion of knuckle, middle and last joint from straight, degrees.
    together : float
        0 leaves fingers as spread as at rest, 1 makes them parallel.
    thumb : 3 directions
        Directions of the thumb's bones: along the hand, out of the palm, towards the index finger.
    loose : float
        Weight of the wrist's bend in opening and closing the fingers.
    """

    flexion: tuple[Direction, Direction, Direction, Direction]
    together: float
    thumb: tuple[Direction, Direction, Direction]
    loose: float = 1.0


_CLOSED = ((0.72, 0.6, 0.34), (0.5, 0.72, -0.48), (0.1, 0.5, -0.86))
_SHAPES = MappingProxyType(
    {
        "relaxed": _Shape(
            ((9, 22, 11), (14, 26, 13), (18, 28, 14), (20, 28, 14)),
            0.75,
            ((0.78, 0.36, 0.5), (0.93, 0.3, 0.2), (0.97, 0.22, 0.08)),
        ),
        "flat": _Shape(
            ((2, 3, 2), (2, 3, 2), (2, 4, 2), (2, 5, 3)),
            0.3,
            ((0.74, 0.15, 0.65), (0.88, 0.1, 0.46), (0.92, 0.05, 0.39)),
            0.0,
        ),
        "grip": _Shape(
            ((62, 72, 32), (66, 76, 34), (70, 78, 34), (72, 78, 34)),
            0.95,
            ((0.7, 0.64, 0.32), (0.68, 0.72, -0.12), (0.55, 0.6, -0.58)),
            0.1,
        ),
        "hold": _Shape(
            ((34, 42, 18), (38, 46, 20), (42, 50, 22), (46, 52, 22)),
            0.9,
            ((0.72, 0.6, 0.35), (0.84, 0.53, 0.1), (0.93, 0.36, -0.06)),
            0.1,
        ),
        "fist": _Shape(
            ((82, 98, 48), (86, 100, 50), (88, 100, 50), (90, 98, 48)), 1.0, _CLOSED, 0.0
        ),
        "point": _Shape(((4, 6, 4), (74, 92, 44), (80, 94, 46), (84, 92, 44)), 0.9, _CLOSED, 0.0),
        "spread": _Shape(
            ((-4, 0, 0), (-2, 0, 0), (-2, 0, 0), (-4, 2, 0)),
            -0.6,
            ((0.62, 0.1, 0.78), (0.72, 0.06, 0.69), (0.76, 0.03, 0.65)),
            0.0,
        ),
        "graceful": _Shape(
            ((4, 12, 6), (14, 20, 9), (16, 22, 10), (6, 16, 8)),
            0.35,
            ((0.76, 0.46, 0.46), (0.91, 0.38, 0.14), (0.96, 0.28, 0.0)),
            0.7,
        ),
    }
)
"""Set by eye on Anny's rig, within the range of a hand. Angles of fingers are absolute, so that
every rig's rest pose gives the same hand."""


@functools.lru_cache(maxsize=1)
def _rules() -> tuple[tuple[re.Pattern[str], str, str], ...]:
    with open(_TABLE, newline="", encoding="utf-8") as stream:
        return tuple(
            (re.compile(row["action"], re.IGNORECASE), row["left"], row["right"])
            for row in csv.DictReader(stream)
        )


def hands_of(action: str) -> tuple[str, str]:
    """Hand poses (left, right) that suit an action, from the first row of ``hands.csv`` whose
    pattern is found in the action's name; "relaxed" by default."""
    return next(
        ((left, right) for pattern, left, right in _rules() if pattern.search(action)),
        ("relaxed", "relaxed"),
    )


def finger_bones(names: Sequence[str], side: str) -> dict[str, list[int]]:
    """Bones of each of a hand's `FINGERS` from its root, by the names of Anny, SMPL-H and rigs of
    engines; only fingers with three bones."""
    chains: dict[str, dict[int, int]] = {}
    for bone, name in enumerate(without_numbers(names)):
        own, base = split_side(name)
        anny = re.fullmatch(r"finger([1-5])([1-3])", base)
        other = re.search(
            r"(thumb|index|middle|ring|pinky|little)(?:finger|proximal)?0?([1-3])$", base
        )
        if own != side:
            continue
        if anny:
            chains.setdefault(FINGERS[int(anny[1]) - 1], {})[int(anny[2])] = bone
        elif other:
            chains.setdefault(other[1].replace("pinky", "little"), {})[int(other[2])] = bone
    return {
        finger: [chain[place] for place in (1, 2, 3)]
        for finger, chain in chains.items()
        if sorted(chain) == [1, 2, 3]
    }


@dataclass(frozen=True)
class Hand:
    """A hand of a rig at rest; the rig faces +z with arms to the sides or down.

    Attributes
    ----------
    side : "left" or "right"
    wrist : int
    fingers : dict of finger to 3 bones
    along, palm : (3,) float64
        Unit vectors from the wrist to the middle knuckle and out of the palm.
    """

    side: str
    wrist: int
    fingers: dict[str, list[int]]
    along: FloatArray
    palm: FloatArray

    @classmethod
    def of(cls, rig: Rig, names: Sequence[str], side: str) -> Hand | None:
        """Find the hand on a side; None for a rig without five fingers of three bones."""
        fingers = finger_bones(names, side)
        if set(fingers) != set(FINGERS):
            return None
        wrist = rig.bones[f"{side}_wrist"]
        index, middle, little = (
            rig.heads[fingers[name][0]] - rig.heads[wrist] for name in ("index", "middle", "little")
        )
        along = unit(middle)
        across = np.cross(index, little) if side == "right" else np.cross(little, index)
        palm = unit(across - (across @ along) * along)
        return cls(side, wrist, fingers, along, palm)

    def segments(self, rig: Rig, finger: str) -> FloatArray:
        """Directions (3, 3) of a finger's bones at rest. The last repeats the one before it, since
        the tip is no bone."""
        heads = rig.heads[self.fingers[finger]]
        return unit(np.stack([heads[1] - heads[0], heads[2] - heads[1], heads[2] - heads[1]]))


def pose_hands(
    transforms: FloatArray,
    rig: Rig,
    names: Sequence[str],
    poses: Sequence[tuple[str, str]],
    shares: FloatArray | None = None,
) -> FloatArray:
    """Put the fingers of bone transforms in poses of `HAND_POSES`.

    Fingers of a loose hand follow the wrist and close slightly when it bends back.

    Parameters
    ----------
    transforms : (T, B, 4, 4)
        World from bone.
    rig : Rig
    names : B str
    poses : P pairs (left, right)
    shares : (T, P) or None
        Weight of each pose per frame, with sums of 1; None for the first pose alone. A side with
        the pose "rest" at any time keeps it throughout.

    Returns
    -------
    (T, B, 4, 4)
        The input if the rig has no known fingers.
    """
    out = transforms
    shares = np.eye(1, len(poses)) if shares is None else shares
    for side, own in zip(SIDES, zip(*poses, strict=True), strict=True):
        hand = Hand.of(rig, names, side)
        if hand is None or "rest" in own:
            continue
        out = out.copy() if out is transforms else out
        shapes = [_SHAPES[pose] for pose in own]
        flexion, together, thumb, loose = (
            np.einsum(
                "tp,p...->t...",
                shares,
                np.array([getattr(shape, name) for shape in shapes], np.float64),
            )
            for name in ("flexion", "together", "thumb", "loose")
        )
        looseness = 1 + loose * _FOLLOW * _bent_back(out, rig, hand)  # (T,)
        for at, finger in enumerate(FINGERS[1:]):
            _flex(out, rig, hand, finger, np.deg2rad(flexion[:, at]) * looseness[:, None], together)
        _point_thumb(out, rig, hand, thumb)
    return out


def _flex(
    out: FloatArray, rig: Rig, hand: Hand, finger: str, wanted: FloatArray, together: FloatArray
) -> None:
    """Bend a finger to the flexion `wanted` (T, 3), radians from straight, and draw it towards the
    middle one by `together` (T,); in place."""
    bones, segments = hand.fingers[finger], hand.segments(rig, finger)
    axis = unit(np.cross(segments[0], hand.palm))
    before = hand.along
    aside = np.arctan2(np.cross(before, segments[0]) @ hand.palm, before @ segments[0])
    _turn(out, rig, bones, rotvec_to_rotmat(-(together * aside)[:, None] * hand.palm))
    for place in range(3):
        rest = (
            np.arctan2(np.cross(before, segments[place]) @ axis, before @ segments[place])
            if place < 2
            else 0.0
        )
        angles = wanted[:, place] - rest
        _turn(out, rig, bones[place:], rotvec_to_rotmat(angles[:, None] * axis))
        before = segments[place]


def _point_thumb(out: FloatArray, rig: Rig, hand: Hand, directions: FloatArray) -> None:
    """Point the thumb's three bones along `directions` (T, 3, 3) of the hand; in place."""
    side = np.cross(hand.palm, hand.along) * (-1 if hand.side == "right" else 1)
    axes, turned = np.stack([hand.along, hand.palm, side]), np.eye(3)
    for place, segment in enumerate(hand.segments(rig, "thumb")):
        wanted = unit(directions[:, place] @ axes)
        turn = rotvec_to_rotmat(
            swing_between(
                np.broadcast_to(segment, wanted.shape),
                np.einsum("...ba,...b->...a", turned, wanted),
            )
        )
        _turn(out, rig, hand.fingers["thumb"][place:], turn)
        turned = turned @ turn


def _turn(out: FloatArray, rig: Rig, bones: Sequence[int], turn: FloatArray) -> None:
    """Turn a chain of bones about its first head, in place; `turn` (1 or T, 3, 3) in the world of
    the rest pose."""
    first = bones[0]
    rest = rig.rest[first]
    now = out[:, first, :3, :3]
    world = now @ (rest.T @ turn @ rest) @ np.swapaxes(now, 1, 2)
    turn_bones(out, bones, world)


def turn_bones(out: FloatArray, bones: Sequence[int] | IntArray, turn: FloatArray) -> None:
    """Turn `bones`, the first with all its descendants, by world rotations (T, 3, 3) about its
    head; in place."""
    moved = out[:, bones]
    pivot = moved[:, :1, :3, 3].copy()
    moved[..., :3, :3] = turn[:, None] @ moved[..., :3, :3]
    moved[..., :3, 3] = pivot + np.einsum("tab,tkb->tka", turn, moved[..., :3, 3] - pivot)
    out[:, bones] = moved


def _bent_back(transforms: FloatArray, rig: Rig, hand: Hand) -> FloatArray:
    """Return the sine of the angle by which the hand is bent back from the forearm (T,), -1 to
    1."""
    turned = transforms[:, hand.wrist, :3, :3] @ rig.rest[hand.wrist].T
    palm = turned @ hand.palm
    elbow = transforms[:, rig.bones[f"{hand.side}_elbow"], :3, 3]
    forearm = unit(transforms[:, hand.wrist, :3, 3] - elbow)
    rest = unit(rig.joints[f"{hand.side}_wrist"] - rig.joints[f"{hand.side}_elbow"])
    back: FloatArray = (forearm * palm).sum(-1) - float(rest @ hand.palm)
    return np.clip(back, -1, 1)


def turn_palms(transforms: FloatArray, rig: Rig, names: Sequence[str], fps: float) -> FloatArray:
    """Turn forearms so that the palms of hanging arms face the thighs and slightly backwards.

    A motion's joints give the plane of the elbow, not the turn of the forearm. With the elbow
    turned out, the palm of a neutral forearm would face the front, which is unnatural. Raised and
    stretched arms do not change.
    """
    out = transforms.copy()
    pelvis = transforms[:, rig.bones["pelvis"], :3, :3] @ rig.rest[rig.bones["pelvis"]].T
    for side in SIDES:
        hand = Hand.of(rig, names, side)
        if hand is None:
            continue
        elbow, wrist = (
            transforms[:, rig.bones[f"{side}_elbow"], :3, 3],
            transforms[:, hand.wrist, :3, 3],
        )
        along = unit(wrist - elbow)
        palm = transforms[:, hand.wrist, :3, :3] @ rig.rest[hand.wrist].T @ hand.palm
        inwards = np.array([-0.8 if side == "left" else 0.8, 0.0, -0.45])
        wanted = pelvis @ inwards
        wanted, palm = (
            unit(v - (v * along).sum(-1, keepdims=True) * along) for v in (wanted, palm)
        )
        angle = np.arctan2((np.cross(palm, wanted) * along).sum(-1), (palm * wanted).sum(-1))
        pronation = 1.0 if side == "left" else -1.0  # the thumb goes inwards
        angle = (pronation * angle + 2.2) % (
            2 * np.pi
        ) - 2.2  # a palm turned far to the front comes back this way
        angle = pronation * np.clip(angle, np.deg2rad(-15), np.deg2rad(100))
        angle = smoothed((angle * smoothstep(-along[:, 1], 0.05, 0.55))[:, None], 0.1 * fps)[:, 0]
        steps = [
            *rig.chains[f"{side}_elbow"],
            hand.wrist,
        ]  # each bone turns with its parent, plus a share of its own
        for bone in steps:
            turn_bones(
                out,
                subtree(rig.parents, bone),
                rotvec_to_rotmat((angle / len(steps))[:, None] * along),
            )
    return out
