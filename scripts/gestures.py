"""Gestures of our own for the library of clips: wave, clap, kick and others, as keyed poses.

``scripts/make_clips.py`` bakes them. A key places wrists from the shoulder and ankles from the hip
of their side: meters, x outwards, y up, z ahead. Directions have the same axes. All values are
eased between keys.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.kinematics import Skeleton, rotvec_to_rotmat

FPS = 30.0
SIDES = {"l": 1.0, "r": -1.0}

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Arm:
    """Place of an arm; None leaves that of the idle pose."""

    wrist: Vector
    along: Vector
    palm: Vector
    elbow: Vector = (0.6, -1.0, -0.3)
    hand: str = "open"


@dataclass(frozen=True)
class Key:
    """A pose at a time, seconds; angles in degrees, forward is positive; the head turns to the left
    by `turn`, the chest by `twist`."""

    time: float
    r: Arm | None = None
    l: Arm | None = None  # noqa: E741
    foot: Vector | None = None
    sink: float = 0.0
    spine: float = 0.0
    neck: float = 0.0
    shrug: float = 0.0
    turn: float = 0.0
    twist: float = 0.0


def both(time: float, arm: Arm, **other: float) -> Key:
    """Return a key with symmetric arms."""
    return Key(time, arm, arm, **other)


def _wave(sway: float) -> Arm:
    return Arm((0.2 + sway, 0.24, 0.2), (0.3 + 4 * sway, 1.0, 0.1), (0, 0, 1), (1.0, -0.9, 0))


_CLAP = Arm((-0.155, -0.2, 0.34), (-0.12, 0.45, 1.0), (-1, 0, 0.1), (0.8, -1.0, -0.2))
_APART = Arm((-0.01, -0.2, 0.32), (-0.1, 0.45, 1.0), (-1, 0, 0.2), (0.8, -1.0, -0.2))
_FACE = Arm((-0.12, 0.03, 0.29), (-0.2, 1.0, -0.15), (0, 0, -1), (0.7, -1.0, 0.4))
_EYES = Arm((-0.085, 0.03, 0.29), (-0.2, 1.0, -0.15), (0, 0, -1), (0.7, -1.0, 0.4))
_SHRUG = Arm((0.16, -0.3, 0.2), (0.75, 0.05, 0.65), (0, 1, -0.1), (0.3, -1.0, -0.4))
_UP = Arm((0.14, 0.46, 0.06), (0.1, 1.0, 0.0), (-0.6, 0, 0.8), (1.0, 0.0, -0.2), "fist")
_LOW = Arm((0.14, 0.3, 0.1), (0.05, 1.0, 0.05), (-0.6, 0, 0.8), (1.0, -0.3, -0.2), "fist")
_BELLY = Arm((-0.12, -0.42, 0.2), (-1.0, -0.1, 0.25), (0, 0, -1), (1.0, -0.6, -0.3))
_AHEAD = Arm((0.0, -0.02, 0.5), (-0.05, 0.0, 1.0), (0, -1, 0), (0.6, -1.0, 0))
_GUARD = Arm((-0.02, -0.08, 0.25), (-0.1, 0.75, 0.6), (-1, 0, 0), (0.6, -1.0, 0), "fist")

_MOUTH = Arm((-0.13, 0.0, 0.24), (-0.5, 0.8, -0.3), (-0.5, -0.1, -0.85), (0.7, -1.0, 0.2), "fist")
_SIP = Arm((-0.12, 0.02, 0.25), (-0.6, 0.6, -0.2), (-0.75, 0.0, -0.6), (0.9, -0.6, 0.2), "fist")
_CUP = Arm((-0.03, -0.3, 0.3), (-0.35, 0.3, 1.0), (-1.0, 0.0, -0.2), (0.5, -1.0, -0.2), "fist")
_BITE = Arm((-0.13, -0.01, 0.24), (-0.5, 0.75, -0.35), (-0.2, -0.2, -1.0), (0.8, -0.8, 0.2), "fist")
_EAR = Arm((0.0, 0.1, 0.1), (-0.25, 0.95, -0.15), (-1.0, 0.0, -0.1), (0.7, -1.0, 0.35), "fist")
_CAP = Arm((-0.02, 0.24, 0.08), (-0.75, 0.6, -0.1), (-0.6, -0.8, 0.0), (1.0, 0.1, 0.2))
_CAP2 = Arm((-0.05, 0.25, 0.02), (-0.75, 0.6, -0.2), (-0.6, -0.8, 0.0), (1.0, 0.15, 0.2))
_KNOCK = Arm((-0.05, 0.02, 0.42), (-0.05, 0.85, 0.5), (-0.2, 0.0, 1.0), (0.7, -1.0, 0.0), "fist")
_KNOCKED = Arm((-0.05, 0.0, 0.34), (-0.05, 0.95, 0.2), (-0.2, 0.0, 1.0), (0.7, -1.0, 0.0), "fist")
_HANDLE = Arm((0.0, -0.38, 0.42), (-0.1, -0.1, 1.0), (0.0, -1.0, 0.0), (0.5, -1.0, -0.2), "fist")
_PULLED = Arm((0.12, -0.38, 0.16), (0.0, -0.1, 1.0), (0.0, -1.0, 0.0), (0.6, -0.6, -0.8), "fist")
_SHOVED = Arm((-0.05, -0.36, 0.52), (-0.1, -0.1, 1.0), (0.0, -1.0, 0.0), (0.5, -1.0, 0.0), "fist")
_CAMERA = Arm((-0.12, 0.12, 0.26), (-0.5, 0.8, 0.3), (-0.6, 0.0, -0.8), (0.6, -1.0, 0.0), "fist")
_SNAP = Arm((-0.12, 0.115, 0.25), (-0.5, 0.8, 0.3), (-0.6, 0.0, -0.8), (0.6, -1.0, 0.0), "point")
_SELFIE = Arm((-0.05, 0.2, 0.48), (-0.2, 0.9, 0.3), (-0.2, 0.0, -1.0), (0.6, -1.0, 0.0), "fist")


def _keys(by: float) -> Arm:
    return Arm((-0.05, -0.33 + by, 0.33), (-0.25, -0.05, 1.0), (0.0, -1.0, 0.0), (0.7, -1.0, -0.3))


_NECK = Arm((0.06, -0.12, 0.42), (0.25, 0.75, 0.5), (-0.2, 0.3, -1.0), (0.5, -1.0, 0.0))


def _strum(by: float) -> Arm:
    return Arm((-0.17, -0.36 + by, 0.2), (-0.8, -0.35, 0.45), (0.1, 0.0, -1.0), (1.0, -0.4, -0.3))


_FOLD = Arm((-0.22, -0.27, 0.17), (-1.0, 0.1, 0.05), (0.0, 0.0, -1.0), (0.6, -1.0, 0.2))
_FOLDED = Arm((-0.2, -0.23, 0.21), (-1.0, 0.2, -0.05), (0.0, 0.0, -1.0), (0.6, -1.0, 0.2))
_HIP = Arm((0.03, -0.46, 0.02), (-0.75, -0.35, 0.45), (-0.6, -0.5, -0.6), (1.0, -0.2, -0.35))
_KISS = Arm((-0.13, 0.02, 0.23), (-0.3, 0.9, -0.2), (-0.1, 0.0, -1.0), (0.7, -1.0, 0.1))
_BLOWN = Arm((0.05, -0.03, 0.45), (0.0, 0.35, 1.0), (0.0, 1.0, -0.3), (0.6, -1.0, 0.0))
_WATCH = Arm((-0.2, -0.17, 0.3), (-1.0, 0.1, 0.15), (0.0, -1.0, 0.2), (0.7, -0.8, 0.2), "fist")
_BRUSH = Arm((-0.08, -0.02, 0.26), (-0.75, 0.6, 0.1), (-0.2, 0.0, -1.0), (1.0, -0.3, 0.0), "fist")
_BRUSHED = Arm((-0.13, -0.02, 0.26), (-0.75, 0.6, 0.1), (-0.2, 0.0, -1.0), (1.0, -0.3, 0.0), "fist")
_COMB = Arm((-0.02, 0.27, 0.1), (-0.8, 0.45, -0.2), (-0.6, -0.8, 0.0), (1.0, 0.1, 0.1), "fist")
_COMBED = Arm((0.02, 0.14, -0.06), (-0.7, 0.6, -0.4), (-0.9, -0.3, 0.2), (1.0, 0.1, 0.0), "fist")
_CHIN = Arm((-0.14, -0.1, 0.22), (-0.4, 0.85, -0.25), (-0.2, 0.0, -1.0), (0.5, -1.0, 0.3), "fist")
_UNDER = Arm((-0.22, -0.27, 0.19), (-1.0, 0.1, 0.05), (0.0, 0.6, -0.8), (0.6, -1.0, 0.1))
_MICRO = Arm((-0.12, -0.03, 0.25), (-0.5, 0.8, -0.2), (-0.7, 0.0, -0.7), (0.7, -1.0, 0.1), "fist")
_RAISED = Arm((0.06, 0.48, 0.04), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, -0.1))
_HIGH = Arm((0.02, 0.5, 0.02), (-0.1, 1.0, -0.05), (0.0, 0.2, 1.0), (1.0, 0.2, -0.1))
_WIDE = Arm((0.5, 0.12, -0.08), (1.0, 0.2, -0.1), (0.0, 0.2, 1.0), (0.2, -1.0, -0.4))
_FLEX = Arm((0.26, 0.2, 0.05), (-0.35, 0.95, 0.0), (-0.9, 0.0, 0.3), (1.0, -0.1, 0.0), "fist")
_A_ARM = Arm((0.36, -0.36, 0.0), (0.7, -0.7, 0.0), (-0.3, -0.3, 0.9), (0.6, 0.4, -0.7))
_HUG = Arm((-0.1, -0.16, 0.36), (-0.9, 0.1, 0.4), (-0.2, 0.0, -1.0), (1.0, -0.5, 0.2))
_OPEN = Arm((0.3, -0.14, 0.36), (0.3, 0.05, 1.0), (-0.9, 0.2, 0.2), (0.8, -0.8, 0.0))
_PRAY = Arm((-0.17, -0.23, 0.24), (0.0, 0.9, 0.45), (-1.0, 0.0, 0.0), (0.9, -0.9, 0.0))
_PAT = Arm((-0.14, -0.33, 0.14), (-0.9, -0.1, 0.2), (0.0, 0.0, -1.0), (1.0, -0.6, -0.2))
_STIR = [Arm((-0.1 + 0.05 * np.cos(a), -0.38, 0.34 + 0.05 * np.sin(a)), (-0.2, -0.5, 0.85), (-0.9, 0.0, -0.3), (0.7, -1.0, -0.2), "fist") for a in np.arange(0, 2.01 * np.pi, np.pi / 2)]  # fmt: skip
_BOWL = Arm((-0.04, -0.42, 0.32), (-0.5, -0.1, 0.9), (-0.6, 0.8, 0.0), (0.5, -1.0, -0.2), "fist")
_CLUB = Arm((-0.18, -0.46, 0.28), (-0.2, -0.9, 0.4), (-0.9, 0.0, 0.1), (0.8, -0.6, 0.1), "fist")
_BOX = Arm((-0.04, -0.36, 0.36), (-0.1, 0.0, 1.0), (-0.9, 0.45, 0.0), (0.8, -1.0, -0.2))

GESTURES: dict[str, tuple[Sequence[Key], bool]] = {
    "own-wave": ([Key(0), *(Key(0.45 + 0.26 * k, _wave(0.07 if k % 2 else -0.07)) for k in range(7)), Key(2.6)], False),
    "own-wave-both": ([Key(0), *(both(0.45 + 0.26 * k, _wave(0.07 if k % 2 else -0.07)) for k in range(7)), Key(2.6)], False),
    "own-clap": ([both(0.16 * k, _APART if k % 2 else _CLAP) for k in range(14)] + [both(0.16 * 14, _CLAP)], True),
    "own-point": ([Key(0), *(Key(t, Arm((-0.02, 0.0, 0.53), (-0.05, 0.02, 1.0), (0, -1, 0), hand="point")) for t in (0.5, 1.7)), Key(2.3)], False),
    "own-thumbs-up": ([Key(0), *(Key(t, Arm((-0.02, -0.14, 0.38), (-0.2, 0.1, 1.0), (-1, 0, -0.2), hand="thumb")) for t in (0.45, 1.6)), Key(2.1)], False),
    "own-salute": ([Key(0), *(Key(t, Arm((-0.01, 0.15, 0.15), (-0.75, 0.62, 0.0), (-0.1, -0.75, 0.55), (1.0, -0.25, 0.1))) for t in (0.45, 1.6)), Key(2.1)], False),
    "own-shake-head": ([Key(0), *(Key(0.35 + 0.36 * k, neck=3, turn=t) for k, t in enumerate((34, -34, 30, -30, 24, -14))), Key(2.7)], False),
    "own-shrug": ([Key(0), *(both(t, _SHRUG, shrug=0.05, neck=-4) for t in (0.4, 1.0)), Key(1.6)], False),
    "own-cheer": ([Key(0), *(both(0.4 + 0.25 * k, _UP if k % 2 == 0 else _LOW, spine=-4, neck=-10) for k in range(9)), Key(2.9)], False),
    "own-facepalm": ([Key(0), *(Key(t, _FACE, neck=n, spine=6) for t, n in ((0.5, 22), (1.0, 26), (1.8, 24))), Key(2.5)], False),
    "own-cry": ([both(0.25 * k, _EYES, neck=30, spine=14 + (3 if k % 2 else 0)) for k in range(9)], True),
    "own-laugh": ([Key(0.2 * k, _BELLY, spine=-8 + (9 if k % 2 else 0), neck=-12 + (8 if k % 2 else 0)) for k in range(13)], True),
    "own-kick": (
        [Key(0, _GUARD, _GUARD), Key(0.35, _GUARD, _GUARD, foot=(0.02, -0.6, 0.28), spine=-4), Key(0.55, _LOW, _GUARD, foot=(0.0, -0.12, 0.8), spine=-14),
         Key(0.7, _LOW, _GUARD, foot=(0.0, -0.14, 0.79), spine=-13), Key(1.0, _GUARD, _GUARD, foot=(0.02, -0.62, 0.25)), Key(1.4, _GUARD, _GUARD)], False,
    ),
    "own-squat": ([both(0, _AHEAD), both(0.95, _AHEAD, sink=0.36, spine=30, neck=-14), both(1.1, _AHEAD, sink=0.36, spine=30, neck=-14), both(2.1, _AHEAD)], True),
    "own-hands-up": ([Key(0), *(both(t, Arm((0.2, 0.3, 0.08), (0.05, 1.0, 0.05), (0, 0, 1), (1.0, -0.6, 0))) for t in (0.5, 2.6)), Key(3.2)], False),
    "own-look-around": ([Key(0), Key(0.5, turn=45, twist=8), Key(1.3, turn=48, twist=8), Key(2.0, turn=-48, twist=-8), Key(2.9, turn=-45, twist=-8), Key(3.6)], False),
    "own-yawn": ([Key(0), Key(0.7, _KISS, neck=-10, spine=-4, shrug=0.02), Key(1.6, _KISS, neck=-16, spine=-7, shrug=0.03), Key(2.2, _KISS, neck=-6), Key(2.9)], False),
    "own-stretch": ([Key(0), both(0.9, _HIGH, spine=-4, neck=-8, shrug=0.03), both(1.7, _HIGH, spine=-9, neck=-14, shrug=0.05), both(2.4, _WIDE, spine=-6, neck=-6), Key(3.3)], False),
    "own-scratch-head": ([Key(0), *(Key(0.5 + 0.17 * k, _CAP2 if k % 2 else _CAP, neck=8, turn=-8) for k in range(8)), Key(2.3)], False),
    "own-cough": ([Key(0), Key(0.4, _MOUTH, neck=10, spine=6), *(Key(0.55 + 0.22 * k, _MOUTH, neck=20 if k % 2 else 10, spine=13 if k % 2 else 5) for k in range(6)), Key(2.3)], False),
    "own-sneeze": ([Key(0), Key(0.6, _MOUTH, neck=-14, spine=-6), Key(0.8, _MOUTH, neck=32, spine=24), Key(1.2, _MOUTH, neck=20, spine=12), Key(2.0)], False),
    "own-drink": ([Key(0, _CUP), Key(0.3, _CUP), Key(1.0, _SIP, neck=-6), Key(1.5, _SIP, neck=-18, spine=-3), Key(2.3, _SIP, neck=-20, spine=-3), Key(3.1, _CUP), Key(3.5, _CUP)], False),
    "own-eat": ([Key(0, _CUP), Key(0.7, _BITE, neck=8, spine=3), Key(1.0, _BITE, neck=10, spine=3), Key(1.7, _CUP, neck=4), Key(2.3, _CUP)], False),
    "own-phone": ([Key(0), Key(0.7, _EAR, neck=4, turn=-6), Key(1.8, _EAR, _PAT, neck=0, turn=10), Key(3.0, _EAR, neck=6, turn=-10), Key(4.0, _EAR, _OPEN, neck=2, turn=5), Key(4.8, _EAR), Key(5.5)], False),
    "own-knock": ([Key(0), Key(0.4, _KNOCKED), *(Key(0.55 + 0.15 * k, _KNOCK if k % 2 == 0 else _KNOCKED) for k in range(6)), Key(1.9)], False),
    "own-open-door": ([Key(0), Key(0.6, _HANDLE, neck=12), Key(0.9, _HANDLE, neck=10), Key(1.6, _PULLED, twist=-16, neck=4), Key(2.0, _PULLED, twist=-16), Key(2.8)], False),
    "own-push-door": ([Key(0), Key(0.6, _HANDLE, neck=10), Key(1.2, _SHOVED, spine=6), Key(1.5, _SHOVED, spine=6), Key(2.2)], False),
    "own-photo": ([Key(0), both(0.7, _CAMERA, neck=4), both(1.2, _SNAP, neck=4), both(1.4, _CAMERA, neck=4), both(2.0, _CAMERA, neck=4), Key(2.8)], False),
    "own-selfie": ([Key(0), Key(0.6, _SELFIE, neck=-6, turn=-8), Key(1.2, _SELFIE, neck=-4, turn=-16), Key(2.1, _SELFIE, neck=-8, turn=-4), Key(2.9)], False),
    "own-type": ([Key(0.15 * k, _keys(0.025 * (k % 2)), _keys(0.025 * (k % 3 == 0)), neck=14, spine=4) for k in range(13)], True),
    "own-guitar": ([Key(0.25 * k, _strum(0.05 if k % 2 else -0.05), _NECK, neck=10 + 3 * (k % 2), turn=12) for k in range(9)], True),
    "own-cross-arms": ([Key(0), *(Key(t, _FOLD, _FOLDED) for t in (0.6, 2.6)), Key(3.3)], False),
    "own-hands-on-hips": ([Key(0), *(both(t, _HIP, spine=-2) for t in (0.6, 2.6)), Key(3.2)], False),
    "own-kiss": ([Key(0), Key(0.5, _KISS), Key(0.9, _KISS, neck=4), Key(1.3, _BLOWN, neck=-4, spine=3), Key(1.7, _BLOWN, neck=-4), Key(2.3)], False),
    "own-watch": ([Key(0), *(Key(t, None, _WATCH, neck=24, turn=14) for t in (0.6, 1.5)), Key(2.2)], False),
    "own-brush-teeth": ([Key(0.17 * k, _BRUSHED if k % 2 else _BRUSH, neck=4) for k in range(13)], True),
    "own-comb": ([Key(0), *(Key(0.6 + 0.45 * k, _COMBED if k % 2 else _COMB, neck=6, turn=10) for k in range(6)), Key(3.4)], False),
    "own-think": ([Key(0), *(Key(t, _CHIN, _UNDER, neck=n, turn=a) for t, n, a in ((0.7, 8, 6), (1.6, 12, -4), (2.8, 6, 8))), Key(3.5)], False),
    "own-sing": ([Key(0.7 * k, _MICRO, _OPEN if k % 2 else None, neck=-6 - 6 * (k % 2), spine=-2 + 4 * (k % 2), turn=8 * (k % 2)) for k in range(5)], True),
    "own-raise-hand": ([Key(0), *(Key(t, _RAISED) for t in (0.6, 2.2)), Key(2.9)], False),
    "own-flex": ([Key(0), *(both(t, _FLEX, spine=-4) for t in (0.6, 1.3)), both(1.6, _UP), *(both(t, _FLEX, spine=-5, turn=18) for t in (2.0, 2.7)), Key(3.3)], False),
    "own-a-pose": ([both(0, _A_ARM), both(2.0, _A_ARM)], True),
    "own-hug": ([Key(0), both(0.6, _OPEN, spine=3), both(1.2, _HUG, spine=8, neck=6), both(2.4, _HUG, spine=8, neck=8), Key(3.2)], False),
    "own-pray": ([Key(0), *(both(t, _PRAY, neck=n) for t, n in ((0.7, 14), (1.6, 20), (2.6, 16))), Key(3.3)], False),
    "own-stir": ([Key(0.3 * k, _STIR[k % 4], _BOWL, neck=22, spine=6) for k in range(9)], True),
    "own-hold-cup": ([Key(0, _CUP, neck=6), Key(1.6, _CUP, neck=2, turn=8), Key(3.2, _CUP, neck=6)], True),
    "own-carry-box": ([both(0, _BOX, spine=-4), both(1.5, _BOX, spine=-5, neck=4), both(3.0, _BOX, spine=-4)], True),
    "own-golf": ([both(0, _CLUB, spine=20, neck=14), both(0.5, _CLUB, spine=20, neck=14), Key(1.3, Arm((0.12, 0.22, 0.05), (0.3, 0.8, -0.4), (-0.6, 0, 0.6), (1.0, -0.4, -0.2), "fist"), Arm((-0.38, 0.1, 0.16), (-0.6, 0.7, 0.0), (0.5, 0, 0.6), (0.2, -1.0, 0.2), "fist"), spine=14, twist=-55, turn=50),
                  both(1.6, _CLUB, spine=20, neck=14), Key(2.1, Arm((-0.36, 0.16, 0.16), (-0.6, 0.7, 0.0), (0.5, 0, 0.6), (0.2, -1.0, 0.2), "fist"), Arm((0.1, 0.24, 0.06), (0.3, 0.8, -0.4), (-0.6, 0, 0.6), (1.0, -0.4, -0.2), "fist"), spine=6, twist=60, turn=-10), Key(2.8)], False),
    "own-touch-chest": ([Key(0), *(Key(t, Arm((-0.16, -0.16, 0.17), (-0.9, 0.25, 0.1), (0, 0, -1.0), (0.8, -1.0, 0.0)), neck=10, spine=5) for t in (0.6, 1.6)), Key(2.3)], False),
    "own-stop": ([Key(0), *(Key(t, Arm((0.0, 0.0, 0.5), (0.0, 1.0, 0.15), (0, 0, 1.0), (0.6, -1.0, 0.0))) for t in (0.4, 1.6)), Key(2.2)], False),
    "own-beckon": ([Key(0), *(Key(0.5 + 0.25 * k, Arm((0.0, -0.12 + 0.02 * (k % 2), 0.42 - 0.1 * (k % 2)), (-0.1, 0.3 + 0.6 * (k % 2), 1.0 - 0.9 * (k % 2)), (0, 1.0 - 0.9 * (k % 2), -0.2 - 0.8 * (k % 2)), (0.6, -1.0, 0.0))) for k in range(6)), Key(2.5)], False),
    "own-cover-ears": ([Key(0), *(both(t, Arm((0.0, 0.12, 0.08), (-0.2, 0.95, -0.1), (-1.0, 0, -0.1), (1.0, -0.6, 0.3)), neck=12, spine=8, shrug=0.02) for t in (0.5, 1.8)), Key(2.5)], False),
    "own-hit-back": ([Key(0), Key(0.13, _OPEN, _OPEN, spine=-17, neck=-18), Key(0.5, spine=12, neck=8), Key(0.9, spine=6, neck=4), Key(1.5)], False),
    "own-rub-hands": ([Key(0.2 * k, Arm((-0.17, -0.3, 0.28 + 0.04 * (k % 2)), (-0.1, 0.3, 1.0), (-1.0, 0, 0)), Arm((-0.17, -0.3, 0.32 - 0.04 * (k % 2)), (-0.1, 0.3, 1.0), (-1.0, 0, 0)), neck=6) for k in range(9)], True),
}  # fmt: skip
"""File names to keys, and whether the gesture is a cycle."""


class Puppet:
    """The idle pose of the library's skeleton, and functions that move it.

    Parameters
    ----------
    skeleton : Skeleton
    idle : (J, 3) float
        Stands, faces +z.
    hands : dict of str to (J, 3) float
        Poses whose fingers are open, and a fist.
    """

    def __init__(self, skeleton: Skeleton, idle: np.ndarray, hands: dict[str, np.ndarray]) -> None:
        self.names, self.parents, self.idle = skeleton.joint_names, skeleton.parents.tolist(), idle
        self.hands = {
            side: {name: self._hand(pose, side) for name, pose in hands.items()} for side in SIDES
        }
        for side, known in self.hands.items():
            index, thumb = (
                np.array([finger in self.names[at] for at in self.below(f"hand_{side}")])
                for finger in ("index", "thumb")
            )
            known["point"] = np.where(index[:, None], known["open"], known["fist"])
            known["thumb"] = np.where(thumb[:, None], known["open"], known["fist"])

    def with_hands(self, joints: np.ndarray, hand: str) -> np.ndarray:
        """Return joints (T, J, 3) with the fingers of a known pose, along the forearms; "relaxed"
        and "" leave them."""
        if hand in ("", "relaxed"):
            return joints
        made = joints.copy()
        for side in SIDES:
            wrist, middle = self.at(f"hand_{side}"), self.at(f"middle_01_{side}")
            index, little = self.at(f"index_01_{side}"), self.at(f"pinky_01_{side}")
            for frame in made:
                across = np.cross(frame[index] - frame[wrist], frame[little] - frame[wrist])
                axes = self._axes(frame[middle] - frame[wrist], across * -SIDES[side], side)
                frame[self.below(f"hand_{side}")] = frame[wrist] + self.hands[side][hand] @ axes
        return made

    def at(self, name: str) -> int:
        """Return the index of a joint."""
        return self.names.index(name)

    def below(self, name: str) -> list[int]:
        """Return the joints below a joint."""
        found = {self.at(name)}
        for joint, parent in enumerate(self.parents):
            if parent in found:
                found.add(joint)
        return sorted(found - {self.at(name)})

    def _axes(self, along: np.ndarray, palm: np.ndarray, side: str) -> np.ndarray:
        along = unit(along)
        palm = unit(palm - (palm @ along) * along)
        return np.stack([along, palm, np.cross(palm, along) * SIDES[side]])

    def _hand(self, pose: np.ndarray, side: str) -> np.ndarray:
        """Return the fingers of a pose from the wrist: along the hand, out of the palm, to the
        thumb."""
        wrist, index, middle, little = (
            pose[self.at(f"{name}_{side}")]
            for name in ("hand", "index_01", "middle_01", "pinky_01")
        )
        across = np.cross(index - wrist, little - wrist) * -SIDES[side]
        return (pose[self.below(f"hand_{side}")] - wrist) @ self._axes(
            middle - wrist, across, side
        ).T

    def pose(self, key: Key) -> np.ndarray:
        """Return the joints (J, 3) of a key."""
        pose = self.idle.copy()
        pose[..., 1] -= key.sink
        for name, angle in (
            ("spine_01", key.spine / 2),
            ("spine_03", key.spine / 2),
            ("neck_01", key.neck),
        ):
            moved = self.below(name)
            pose[moved] = (
                pose[self.at(name)]
                + (pose[moved] - pose[self.at(name)])
                @ rotvec_to_rotmat(np.array([np.deg2rad(angle), 0, 0])).T
            )
        for name, angle in (
            ("spine_02", key.twist),
            ("neck_01", key.turn / 2),
            ("head", key.turn / 2),
        ):
            moved = self.below(name)
            pose[moved] = (
                pose[self.at(name)]
                + (pose[moved] - pose[self.at(name)])
                @ rotvec_to_rotmat(np.array([0, np.deg2rad(angle), 0])).T
            )
        for side, arm in (("r", key.r), ("l", key.l)):
            pose[self.below(f"clavicle_{side}")] += [0, key.shrug, 0]
            if arm is not None:
                self._reach_arm(pose, arm, side)
            if key.sink:
                self._reach_leg(pose, side, self.idle[self.at(f"foot_{side}")])
        if key.foot is not None:
            self._reach_leg(pose, "r", pose[self.at("thigh_r")] + np.array(key.foot) * [-1, 1, 1])
        return pose

    def _reach_arm(self, pose: np.ndarray, arm: Arm, side: str) -> None:
        flip = np.array([SIDES[side], 1, 1])
        shoulder, elbow, wrist = (
            self.at(f"{name}_{side}") for name in ("upperarm", "lowerarm", "hand")
        )
        pose[elbow], pose[wrist] = self._bent(
            pose,
            (shoulder, elbow, wrist),
            pose[shoulder] + np.array(arm.wrist) * flip,
            np.array(arm.elbow) * flip,
        )
        axes = self._axes(np.array(arm.along) * flip, np.array(arm.palm) * flip, side)
        pose[self.below(f"hand_{side}")] = pose[wrist] + self.hands[side][arm.hand] @ axes

    def _reach_leg(self, pose: np.ndarray, side: str, ankle: np.ndarray) -> None:
        joints = tuple(self.at(f"{name}_{side}") for name in ("thigh", "calf", "foot"))
        below = self.below(f"foot_{side}")
        foot = self.idle[below] - self.idle[joints[2]]
        lifted = np.clip((ankle[2] - pose[joints[0]][2]) / 0.8, 0, 1)
        pose[joints[1]], pose[joints[2]] = self._bent(
            pose, joints, ankle, np.array([SIDES[side] * 0.15, 0.2, 1.0])
        )
        pose[below] = pose[joints[2]] + foot @ rotvec_to_rotmat(np.array([-0.9 * lifted, 0, 0])).T

    def _bent(
        self, pose: np.ndarray, joints: tuple[int, int, int], target: np.ndarray, pole: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return middle and end of a limb that reaches for the target, with its middle towards the
        pole."""
        first, middle, last = (self.idle[joint] for joint in joints)
        upper, lower = np.linalg.norm(middle - first), np.linalg.norm(last - middle)
        way = target - pose[joints[0]]
        reach = min(np.linalg.norm(way), 0.995 * (upper + lower))
        along = unit(way)
        height = (upper**2 + reach**2 - lower**2) / (2 * reach)
        aside = unit(pole - (pole @ along) * along)
        return pose[joints[0]] + height * along + np.sqrt(
            max(upper**2 - height**2, 0)
        ) * aside, pose[joints[0]] + reach * along

    def play(self, keys: Sequence[Key]) -> np.ndarray:
        """Return the joints (T, J, 3) at `FPS`, eased from key to key."""
        poses, times = (
            np.stack([self.pose(key) for key in keys]),
            np.array([key.time for key in keys]),
        )
        at = np.arange(round(times[-1] * FPS) + 1) / FPS
        before = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
        share = smoothstep((at - times[before]) / (times[before + 1] - times[before]), 0.0, 1.0)
        return poses[before] + share[:, None, None] * (poses[before + 1] - poses[before])
