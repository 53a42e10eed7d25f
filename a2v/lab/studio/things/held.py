"""Objects in hands: their shapes, the arms and fingers that hold them, and their positions on a
posed person."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.posing import SIDES, Pose, arm_towards
from a2v.lab.studio.things.solids import Thing, ball, box, joined, rod, turned
from a2v.types import FloatArray

_SIGNS = dict(SIDES)
_TURNED = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation from the y axis to -z."""


@dataclass(frozen=True, eq=False)
class Held:
    """An object for one hand or both.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    things : mapping of side ("Left", "Right", "Both") to Thing
        Shapes in the frame of that grip (`grip_frame`), meters. For both hands they span a length
        of 1 along x (`_between`).
    pose : Pose
        Rotations of the gripping fingers, and of the arms if the object needs it. They replace the
        pose's.
    hangs : bool
        Whether it hangs straight down from the hand.
    """

    kind: str
    things: Mapping[str, Thing]
    pose: Pose = field(default_factory=dict)
    hangs: bool = False

    def placed(self, avatar: Avatar, transforms: FloatArray) -> Thing:
        """Return the object in the hands of an avatar with world-from-bone transforms (B, 4, 4)."""
        return joined(
            [self._placed(side, thing, avatar, transforms) for side, thing in self.things.items()]
        )

    def _placed(self, side: str, thing: Thing, avatar: Avatar, transforms: FloatArray) -> Thing:
        if side == "Both":
            frame, middle, width = _between(avatar, transforms)
            stretched = Thing(
                thing.vertices * np.array([width, 1, 1]), thing.faces, thing.uv, thing.patterns
            )
            if self.kind == "large ball":
                stretched = Thing(thing.vertices * width, thing.faces, thing.uv, thing.patterns)
            return stretched.moved(middle, frame)
        frame, middle = grip_frame(avatar, transforms, side)
        return thing.moved(middle, _upright(frame) if self.hangs else frame)


def grip_frame(avatar: Avatar, transforms: FloatArray, side: str) -> tuple[FloatArray, FloatArray]:
    """Return the grip of a hand: axes (3, 3) as columns, y toward the thumb and z out of the palm,
    and its middle (3,) on the palm.

    Parameters
    ----------
    transforms : (B, 4, 4)
        World-from-bone.
    side : str
        "Left" or "Right".
    """
    hand, knuckle = (avatar.bone_names.index(f"{side}{bone}") for bone in ("Hand", "HandMiddle1"))
    rest = avatar.rest_transforms.astype(np.float64)
    turn = transforms[hand, :3, :3] @ rest[hand, :3, :3].T
    wrist, ahead = transforms[hand, :3, 3], rest[knuckle, :3, 3] - rest[hand, :3, 3]
    palm = np.array([0.0, -1.0, 0.0])
    at = 0.85 * ahead + 0.13 * float(np.linalg.norm(ahead)) * palm
    axes = np.stack([np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), palm], axis=-1)
    return np.asarray(turn @ axes), np.asarray(wrist + turn @ at)


def _between(avatar: Avatar, transforms: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the frame between both hands: axes, middle (3,), and distance, meters.

    x points from the right palm to the left one, and y is as upright as possible.
    """
    left, right = (grip_frame(avatar, transforms, side)[1] for side, _ in SIDES)
    width = max(float(np.linalg.norm(left - right)), 1e-3)
    x = (left - right) / width
    z = np.cross(x, [0.0, 1.0, 0.0] if abs(x[1]) < 0.9 else [0.0, 0.0, 1.0])
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=-1), (left + right) / 2, width


def _upright(frame: FloatArray) -> FloatArray:
    """Return the frame turned so that its y is the world's; x stays level."""
    x = np.array([frame[0, 1], 0.0, frame[2, 1]])
    length = float(np.linalg.norm(x))
    x = x / length if length > 0.1 else np.array([1.0, 0.0, 0.0])
    return np.stack([x, [0.0, 1.0, 0.0], np.cross(x, [0.0, 1.0, 0.0])], axis=-1)


def _fist(side: str, generator: np.random.Generator, curl: float) -> Pose:
    """Return fingers bent by about `curl` degrees per joint."""
    pose: Pose = {}
    for finger in ("Index", "Middle", "Ring", "Pinky"):
        own = np.radians(np.clip(curl + generator.normal(0, 4), 0, 85))
        for joint in (1, 2, 3):
            pose[f"{side}Hand{finger}{joint}"] = np.array([0.0, 0.0, -_SIGNS[side] * own])
    return pose


def _arm(side: str, upper: tuple[float, float, float], fore: tuple[float, float, float]) -> Pose:
    """Return an arm from the directions of its segments, left: x outward, y up, z to the front."""
    mirror = np.array([_SIGNS[side], 1.0, 1.0])
    straight = {f"{side}Hand": np.zeros(3)}
    return (
        arm_towards(side, _SIGNS[side], np.asarray(upper) * mirror, np.asarray(fore) * mirror)
        | straight
    )


def _stick(generator: np.random.Generator) -> Thing:
    radius, long = generator.uniform(0.011, 0.02), generator.uniform(0.5, 1.5)
    below = generator.uniform(0.06, 0.5) * long
    return rod(radius, -below, long - below, tip=radius * generator.uniform(0.6, 2.4))


def _racket(generator: np.random.Generator) -> Thing:
    size, neck = generator.uniform(0.07, 0.14), generator.uniform(0.12, 0.34)
    head = turned([(0, -0.008), (size, -0.008), (size, 0.008), (0, 0.008)], 1, 18)
    stretch = np.diag([1.0, 1.0, generator.uniform(1.0, 1.35)])
    turn = (
        _TURNED.T
        if generator.random() < 0.5
        else np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) @ _TURNED.T
    )
    return joined([rod(0.016, -0.09, neck), head.moved([0, neck + 1.1 * size, 0], turn @ stretch)])


def _umbrella(generator: np.random.Generator) -> Thing:
    long, wide = generator.uniform(0.55, 0.8), generator.uniform(0.4, 0.6)
    canopy = turned(
        [
            (wide, long - 0.55 * wide),
            (0.8 * wide, long - 0.3 * wide),
            (0.4 * wide, long - 0.08 * wide),
            (0, long),
        ],
        1,
        8,
    )
    return joined([rod(0.011, -0.16, long + 0.05), canopy])


def _bottle(generator: np.random.Generator) -> Thing:
    radius, tall = generator.uniform(0.027, 0.045), generator.uniform(0.14, 0.26)
    body = turned(
        [
            (0, 0),
            (radius, 0),
            (radius, 0.7 * tall),
            (0.4 * radius, 0.85 * tall),
            (0.4 * radius, tall),
            (0, tall),
        ],
        0,
    )
    return body.moved([0, -0.4 * tall, 0.7 * radius])


def _slab(generator: np.random.Generator) -> Thing:
    size = (
        generator.uniform(0.07, 0.12) if generator.random() < 0.5 else generator.uniform(0.12, 0.22)
    )
    flat = box(size, size * generator.uniform(1.3, 2.1), generator.uniform(0.008, 0.03))
    flat = flat.painted(1) if generator.random() < 0.2 else flat
    return flat.moved([generator.uniform(-0.03, 0.03), 0, 0.02])


def _bag(generator: np.random.Generator) -> Thing:
    wide, tall, deep = (
        generator.uniform(0.16, 0.5),
        generator.uniform(0.18, 0.45),
        generator.uniform(0.06, 0.2),
    )
    strap = generator.uniform(0.06, 0.3)
    straps = [
        rod(0.008, 0, strap, 1, sides=6).moved([sign * 0.22 * wide, -strap, 0]) for sign in (1, -1)
    ]
    return joined(
        [
            box(wide, tall, deep).moved([0, -strap - tall / 2, 0]),
            box(0.44 * wide, 0.02, 0.02, 1),
            *straps,
        ]
    )


def _dumbbell(generator: np.random.Generator) -> Thing:
    radius, half = generator.uniform(0.035, 0.08), generator.uniform(0.06, 0.09)
    heads = [rod(radius, low, low + 0.05, 1) for low in (half, -half - 0.05)]
    return joined([rod(0.014, -half, half), *heads])


def _small_ball(generator: np.random.Generator) -> Thing:
    radius = generator.choice([generator.uniform(0.025, 0.05), generator.uniform(0.09, 0.13)])
    return ball(radius).moved([0, 0, radius])


_ONE: Mapping[str, tuple[Callable[[np.random.Generator], Thing], float]] = MappingProxyType(
    {
        "stick": (_stick, 72),
        "racket": (_racket, 70),
        "umbrella": (_umbrella, 70),
        "bottle": (_bottle, 55),
        "slab": (_slab, 32),
        "bag": (_bag, 68),
        "dumbbell": (_dumbbell, 70),
        "small ball": (_small_ball, 30),
    }
)
"""Objects for one hand, and the bend of each finger joint around them, degrees."""
_TWO = ("box", "large ball", "bar")
KINDS: tuple[str, ...] = (*_ONE, *_TWO)


def draw_held(generator: np.random.Generator) -> Held:
    """Draw any object, with the hands (and mostly the arms) that hold it."""
    return held_of(str(generator.choice(KINDS)), generator)


def held_of(kind: str, generator: np.random.Generator) -> Held:
    """Draw an object of a kind, one of `KINDS`; see `draw_held`."""
    if kind in _TWO:
        return _for_both(kind, generator)
    make, curl = _ONE[kind]
    side = "Left" if generator.random() < 0.5 else "Right"
    sides = [side] if kind != "dumbbell" or generator.random() < 0.5 else ["Left", "Right"]
    pose: Pose = {}
    for own in sides:
        pose |= _fist(own, generator, curl)
    if kind == "umbrella" or (
        kind in ("slab", "bottle", "small ball") and generator.random() < 0.6
    ):
        raised = generator.uniform(-0.2, 0.9)
        upper = (generator.uniform(0.0, 0.35), -1.0, generator.uniform(-0.1, 0.5))
        pose |= _arm(
            side, upper, (generator.uniform(-0.5, 0.15), 0.0 if kind == "umbrella" else raised, 1.0)
        )
    thing = make(generator)
    return Held(kind, dict.fromkeys(sides, thing), pose, hangs=kind == "bag")


def _for_both(kind: str, generator: np.random.Generator) -> Held:
    """Return a box or a ball between the palms, or a bar through both fists."""
    reach = generator.uniform(-0.35, 0.7)
    upper = (generator.uniform(0.0, 0.4), -1.0, generator.uniform(0.0, 0.8))
    fore = (generator.uniform(-0.3, 0.0), reach, 1.0)
    if kind == "bar":
        if generator.random() < 0.4:  # overhead
            upper, fore = (
                (generator.uniform(0.3, 0.9), 1.0, 0.2),
                (generator.uniform(-0.1, 0.2), 1.0, 0.1),
            )
        radius, beyond = generator.uniform(0.012, 0.02), generator.uniform(0.7, 2.2)
        along = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        bar = rod(radius, -beyond, beyond)
        if generator.random() < 0.5:
            weight = generator.uniform(0.06, 0.2)
            bar = joined(
                [
                    bar,
                    *(
                        rod(weight, sign * 0.9 * beyond, sign * 0.9 * beyond + 0.06, 1)
                        for sign in (1, -1)
                    ),
                ]
            )
        thing = bar.moved([0, 0, 0], along)
    elif kind == "box":
        thing = box(1.0, generator.uniform(0.1, 0.4), generator.uniform(0.12, 0.4))
    else:
        thing = ball(0.5)
    curl = 70.0 if kind == "bar" else 12.0
    pose: Pose = {}
    for side, _ in SIDES:
        pose |= _fist(side, generator, curl) | _arm(side, upper, fore)
    return Held(kind, {"Both": thing}, pose)
