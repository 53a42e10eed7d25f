"""Things in hands: a cup, a phone, a ball, a box, a sword, a torch, a guitar.

A thing is made of convex solids in a frame of its own, which moves with the palm that is at work,
or with both palms. Axes of a palm's frame: x towards the thumb, y along the hand, z out of the
palm or, for the other hand, into it.
"""

from __future__ import annotations

import csv
import functools
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from a2v.animation.hands import Hand
from a2v.animation.rig import SIDES, Rig, rig_of
from a2v.geometry.vectors import unit
from a2v.kinematics.ground import smoothed
from a2v.props import HIDDEN, Moving, Solid, box, rod
from a2v.types import Body, BoolArray, FloatArray, Motion

_TABLE = Path(__file__).with_name("held.csv")
PALM = (0.85, 0.022)
"""Middle of the grip: share of the way from the wrist to the middle knuckle, and meters out of the
palm."""
BUSY_SPEED = 0.3
"""Seconds: weight of a hand's speed beside its height, to find the hand that is at work."""
GRAVITY = 9.81
BALL = 0.055
"""Radius of a ball that is thrown, meters."""
BOX = (0.3, 0.26)
"""Height and depth of a box, meters."""
BENDS = 0.8
"""Hands that go below this multiple of their first height bend for the box."""
STAND = 0.1
"""Height in meters from which the box is picked up from a stand."""
APART = 1.35
"""Palms that are farther apart than this multiple of the box hold no box."""
BODY = (0.17, 0.13, 0.08)
"""Radii of the two bouts of a guitar and its thickness, meters."""
NECK = 0.62
"""Length of a guitar from the middle of its body to the end of its neck, meters."""


@functools.cache
def _rules() -> list[tuple[re.Pattern[str], str]]:
    with _TABLE.open(newline="", encoding="utf-8") as stream:
        return [(re.compile(row["action"]), row["thing"]) for row in csv.DictReader(stream)]


def thing_of(action: str) -> str:
    """Return the thing that an action holds; "" for none."""
    name = action.lower().replace("_", " ")
    return next((thing for pattern, thing in _rules() if pattern.search(name)), "")


def find_held(bone_transforms: FloatArray, body: Body, motion: Motion) -> list[Moving]:
    """Find the things in the hands of a clip.

    Parameters
    ----------
    bone_transforms : (T, B, 4, 4) float
        World from bone, meters, y up; the ground is y = 0.
    body : Body
        A body without five fingers holds nothing.
    motion : Motion
        Names the actions and their beginnings, and in ``provenance["over"]`` those of the upper
        body.

    Returns
    -------
    list of Moving
    """
    rig, transforms = rig_of(body), np.asarray(bone_transforms, np.float64)
    hands = {side: Hand.of(rig, body.bone_names, side) for side in SIDES}
    if len(transforms) < 2 or any(hand is None for hand in hands.values()):
        return []
    palms = {side: _palm(transforms, rig, hand) for side, hand in hands.items() if hand is not None}
    names = motion.action.split(",")
    over = [*motion.provenance.get("over", []), *[""] * len(names)]
    begins = [0.0] if motion.action_starts is None else motion.action_starts.tolist()
    found: list[Moving] = []
    for number, (name, upper) in enumerate(zip(names, over, strict=False)):
        thing = thing_of(upper) or thing_of(name)
        if not thing or (len(names) > 1 and len(begins) != len(names)):
            continue
        span = np.zeros(len(transforms), bool)
        end = begins[number + 1] if number + 1 < len(names) else np.inf
        times = np.arange(len(transforms)) / motion.fps
        span[(times >= begins[number]) & (times < end)] = True
        if span.sum() > 1:
            found += _MAKERS[thing](palms, span, motion.fps)
    return found


def _palm(transforms: FloatArray, rig: Rig, hand: Hand) -> FloatArray:
    """Frames (T, 4, 4) of a palm."""
    knuckles = {
        finger: rig.heads[hand.fingers[finger][0]] for finger in ("index", "middle", "little")
    }
    across = knuckles["index"] - knuckles["little"]
    thumb = unit(across - (across @ hand.along) * hand.along)
    axes = np.stack([thumb, hand.along, np.cross(thumb, hand.along)], axis=-1)
    share, out = PALM
    wrist = rig.heads[hand.wrist]
    place = share * (knuckles["middle"] - wrist) + out * hand.palm
    turn = transforms[:, hand.wrist, :3, :3] @ rig.rest[hand.wrist].T
    frames = np.tile(np.eye(4), (len(transforms), 1, 1))
    frames[:, :3, :3] = turn @ axes
    frames[:, :3, 3] = transforms[:, hand.wrist, :3, 3] + turn @ place
    return frames


_Palms = dict[str, FloatArray]


def _busy(palms: _Palms, span: BoolArray, fps: float) -> str:
    """Return the side of the hand that is at work: high or fast."""

    def work(side: str) -> float:
        place = palms[side][span, :3, 3]
        speed = np.linalg.norm(np.diff(place, axis=0), axis=-1).mean() * fps
        return float(place[:, 1].mean() + BUSY_SPEED * speed)

    return max(SIDES, key=work)


def _shown(frames: FloatArray, span: BoolArray) -> FloatArray:
    """Scale a thing to nothing outside of its action."""
    made = frames.copy()
    made[~span, :3, :3] *= HIDDEN
    return made


def _in_one_hand(name: str, solids: Sequence[Solid]) -> Callable[..., list[Moving]]:
    def make(palms: _Palms, span: BoolArray, fps: float) -> list[Moving]:
        side = _busy(palms, span, fps)
        return [Moving(name, list(solids), _shown(palms[side], span))]

    return make


def _in_both_hands(name: str, solids: Sequence[Solid]) -> Callable[..., list[Moving]]:
    def make(palms: _Palms, span: BoolArray, fps: float) -> list[Moving]:
        return [Moving(name, list(solids), _shown(palms[side], span)) for side in SIDES]

    return make


def _thrown(palms: _Palms, span: BoolArray, fps: float) -> list[Moving]:
    """A ball that leaves the hand where it is fastest upwards or ahead, and falls."""
    side = _busy(palms, span, fps)
    place = palms[side][:, :3, 3] + 0.7 * BALL * palms[side][:, :3, 2] * _outwards(side)
    speed = np.gradient(smoothed(place, 0.03 * fps), axis=0) * fps
    fast = np.where(span & (np.arange(len(span)) > 2), np.linalg.norm(speed, axis=-1), 0.0)
    at = int(fast.argmax())
    after = np.arange(len(place) - at) / fps
    flight = (
        place[at] + after[:, None] * speed[at] - 0.5 * GRAVITY * after[:, None] ** 2 * [0, 1, 0]
    )
    landed = np.flatnonzero(flight[:, 1] < BALL)
    if len(landed):
        flight[landed[0] :] = flight[landed[0]] * [1, 0, 1] + [0, BALL, 0]
    frames = np.tile(np.eye(4), (len(place), 1, 1))
    frames[:, :3, 3] = np.concatenate([place[:at], flight])
    golden = np.arange(60) * (np.pi * (3 - np.sqrt(5)))
    height = np.linspace(-1, 1, 60)
    ring = np.sqrt(1 - height**2)
    points = BALL * np.stack([ring * np.cos(golden), height, ring * np.sin(golden)], axis=-1)
    return [Moving("ball", [("ball", points)], _shown(frames, span))]


def _outwards(side: str) -> float:
    """Sign of a palm's z axis that leads out of the palm."""
    return 1.0 if side == "right" else -1.0


def _between(palms: _Palms, span: BoolArray, fps: float) -> list[Moving]:
    """A box between both palms from where they are lowest, if they bend for it; before, it stands
    there, on a stand if it is high, and it stays where they part."""
    left, right = (palms[side][:, :3, 3] for side in SIDES)
    across, middle = left - right, 0.5 * (left + right)
    away = np.linalg.norm(across, axis=-1)
    wide = float(np.median(away[span]))
    held = span & (away < APART * wide)
    if not held.any():
        return []
    first, last = np.flatnonzero(held)[[0, -1]]
    lowest = first + int(middle[first : last + 1, 1].argmin())
    bends = middle[lowest, 1] < BENDS * middle[first, 1]
    first = lowest if bends else first
    level = unit(across * np.array([1.0, 0.0, 1.0]))
    frames = np.tile(np.eye(4), (len(span), 1, 1))
    up = np.array([0.0, 1.0, 0.0])
    frames[:, :3, :3] = np.stack(
        [level, np.broadcast_to(up, level.shape), np.cross(level, up)], axis=-1
    )
    frames[:, :3, 3] = middle
    frames[:first], frames[last + 1 :] = frames[first], frames[last]
    height, depth = BOX
    half = np.array([max(0.5 * wide - 0.02, 0.05), 0.5 * height, 0.5 * depth])
    made = [Moving("box", [("box", box(-half, half))], _shown(frames, span))]
    below = middle[first, 1] - half[1]
    if bends and below > STAND:
        top = half * [0.8, 0, 0.8]
        solid = box(-top - [0, half[1] + below, 0], top - [0, half[1], 0])
        made.append(
            Moving(
                "stand", [("stand", solid)], _shown(np.tile(frames[first], (len(span), 1, 1)), span)
            )
        )
    return made


def _guitar(palms: _Palms, span: BoolArray, fps: float) -> list[Moving]:
    """A guitar whose body lies under the lower hand and whose neck leads to the other one."""
    low = min(SIDES, key=lambda side: float(palms[side][span, 1, 3].mean()))
    strum, fret = (palms[side][:, :3, 3] for side in (low, SIDES[low == SIDES[0]]))
    strum = smoothed(strum, 0.5 * fps)
    along = unit(smoothed(fret, 0.15 * fps) - strum)
    across = np.cross(along, [0.0, 1.0, 0.0]) * (1.0 if low == "right" else -1.0)
    ahead = unit(across)
    frames = np.tile(np.eye(4), (len(span), 1, 1))
    frames[:, :3, :3] = np.stack([along, np.cross(ahead, along), ahead], axis=-1)
    frames[:, :3, 3] = strum - 0.06 * ahead
    big, small, thick = BODY
    back, front = np.array([0.0, 0.0, -thick]), np.zeros(3)
    higher = np.array([1.25 * big, 0.0, 0.0])
    solids = [
        ("guitar_body", rod(back, front, big, sides=24)),
        ("guitar_body", rod(back + higher, front + higher, small, sides=24)),
        ("guitar_neck", box(np.array([0.2, -0.025, -0.02]), np.array([NECK, 0.025, 0.012]))),
        ("guitar_head", box(np.array([NECK, -0.04, -0.02]), np.array([NECK + 0.15, 0.04, 0.0]))),
    ]
    return [Moving("guitar", solids, _shown(frames, span))]


def _rod(low: float, high: float, radius: float) -> FloatArray:
    """Points on a rod along x."""
    return rod(np.array([low, 0.0, 0.0]), np.array([high, 0.0, 0.0]), radius)


def _sword(blade: float, grip: float) -> list[Solid]:
    return [
        ("sword_grip", _rod(-grip / 2, grip / 2, 0.014)),
        (
            "sword_guard",
            box(np.array([grip / 2, -0.09, -0.014]), np.array([grip / 2 + 0.02, 0.09, 0.014])),
        ),
        (
            "sword_blade",
            box(np.array([grip / 2 + 0.02, -0.022, -0.005]), np.array([blade, 0.022, 0.005])),
        ),
    ]


_MAKERS: dict[str, Callable[[_Palms, BoolArray, float], list[Moving]]] = {
    "cup": _in_one_hand("cup", [("cup", _rod(-0.05, 0.06, 0.036))]),
    "phone": _in_one_hand(
        "phone", [("phone", box(np.array([-0.06, -0.034, -0.006]), np.array([0.09, 0.034, 0.006])))]
    ),
    "torch": _in_one_hand(
        "torch", [("torch", _rod(-0.12, 0.3, 0.016)), ("torch_top", _rod(0.3, 0.4, 0.035))]
    ),
    "sword": _in_one_hand("sword", _sword(0.9, 0.18)),
    "long sword": _in_one_hand("sword", _sword(1.15, 0.32)),
    "swords": _in_both_hands("sword", _sword(0.8, 0.16)),
    "ball": _thrown,
    "box": _between,
    "guitar": _guitar,
}
