"""Furniture in front of, beside and below a person who stands on y = 0 in front of a camera on +z;
it occludes limbs as in photographs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.things.solids import Thing, box, joined, rod
from a2v.types import FloatArray

_SEATED = (0.17, 0.42)
"""Height of the hips of a person who sits on furniture, as a fraction of the person's height."""
_HEAD_OVER_ANKLE = 0.845
"""Distance from the ankles to the lower end of the head, as a fraction of the person's height."""


@dataclass(frozen=True)
class Body:
    """Position and size of a person, meters.

    Attributes
    ----------
    hips : (3,) float
    heading : float
        Turn about the vertical, radians; 0 faces the camera.
    height : float
        Height of the person when standing.
    front, back : float
        z of the nearest and of the farthest point to the camera.
    left, right : float
        Least and greatest x.
    """

    hips: FloatArray
    heading: float
    height: float
    front: float
    back: float
    left: float
    right: float

    @classmethod
    def of(cls, avatar: Avatar, transforms: FloatArray, person: FloatArray) -> Body:
        """Measure an avatar on the ground, with world-from-bone transforms (B, 4, 4) and vertices
        (V, 3)."""
        hips = avatar.bone_names.index("Hips")
        facing = (
            transforms[hips, :3, :3]
            @ avatar.rest_transforms[hips, :3, :3].T
            @ np.array([0.0, 0.0, 1.0])
        )
        low, high = person.min(axis=0), person.max(axis=0)
        head, foot = (
            float(avatar.rest_transforms[avatar.bone_names.index(name), 1, 3])
            for name in ("Head", "LeftFoot")
        )
        return cls(
            transforms[hips, :3, 3],
            float(np.arctan2(facing[0], facing[2])),
            (head - foot) / _HEAD_OVER_ANKLE,
            float(high[2]),
            float(low[2]),
            float(low[0]),
            float(high[0]),
        )


def draw_furniture(body: Body, generator: np.random.Generator) -> Thing:
    """Draw a seat below a person whose hips are at sitting height; otherwise, or in addition, an
    object in front of or behind the person."""
    seated = _SEATED[0] < body.hips[1] / body.height < _SEATED[1]
    if seated and generator.random() < 0.75:
        seat = _seat(body, generator)
        return joined([seat, _in_front(body, generator)]) if generator.random() < 0.2 else seat
    if generator.random() < 0.15:
        return _place_near(
            _chair(body.hips[1] * generator.uniform(0.4, 0.55), generator),
            body,
            body.back - generator.uniform(0.3, 0.8),
            generator,
        )
    return _in_front(body, generator)


def _yaw(angle: float) -> FloatArray:
    """Return the rotation (3, 3) about the vertical."""
    return np.asarray(rotvec_to_rotmat(np.array([0.0, angle, 0.0])))


def _place_near(thing: Thing, body: Body, z: float, generator: np.random.Generator) -> Thing:
    """Place an object on the ground, randomly turned, near the person in the picture."""
    aside = generator.normal(0, 0.2) * body.height
    return thing.moved([body.hips[0] + aside, 0, z], _yaw(generator.uniform(-np.pi, np.pi)))


def _legs(width: float, depth: float, top: float, radius: float, pattern: int) -> list[Thing]:
    """Return four legs at the corners of a plate."""
    return [
        rod(radius, 0, top, pattern, sides=6).moved(
            [across * (width / 2 - radius), 0, away * (depth / 2 - radius)]
        )
        for across in (1, -1)
        for away in (1, -1)
    ]


def _chair(top: float, generator: np.random.Generator) -> Thing:
    """Return a seat at height `top` around the y axis with its back at -z: a chair, a stool, a
    bench or a block."""
    width, depth, thick = (
        generator.uniform(0.34, 0.5),
        generator.uniform(0.34, 0.48),
        generator.uniform(0.03, 0.09),
    )
    kind = generator.choice(["chair", "stool", "bench", "block"], p=[0.5, 0.15, 0.15, 0.2])
    if kind == "block":
        return box(width, top, depth).moved([0, top / 2, 0])
    if kind == "stool":
        return joined(
            [
                rod(width / 2, top - thick, top),
                rod(0.03, 0, top - thick, 1),
                rod(0.4 * width, 0, 0.02, 1),
            ]
        )
    if kind == "bench":
        width = generator.uniform(1.0, 2.0)
    parts = [
        box(width, thick, depth).moved([0, top - thick / 2, 0]),
        *_legs(width, depth, top - thick, generator.uniform(0.012, 0.03), 1),
    ]
    if kind == "chair":
        back = generator.uniform(0.3, 0.6)
        parts.append(box(width, back, 0.04).moved([0, top + back / 2 + 0.04, -depth / 2]))
        if generator.random() < 0.35:  # arm rests
            parts += [
                box(0.05, 0.04, depth, 1).moved([sign * width / 2, top + 0.22, 0])
                for sign in (1, -1)
            ]
            parts += [
                rod(0.015, top, top + 0.22, 1, sides=6).moved([sign * width / 2, 0, 0.4 * depth])
                for sign in (1, -1)
            ]
    return joined(parts)


def _seat(body: Body, generator: np.random.Generator) -> Thing:
    """Return a seat for the person."""
    top = max(0.08, float(body.hips[1]) - generator.uniform(0.06, 0.085) * body.height)
    behind = np.array([np.sin(body.heading), 0.0, np.cos(body.heading)]) * generator.uniform(
        -0.02, 0.08
    )
    at = body.hips * [1, 0, 1] + behind
    return _chair(top, generator).moved(at, _yaw(body.heading + generator.normal(0, 0.08)))


def _in_front(body: Body, generator: np.random.Generator) -> Thing:
    """Return an object between the person and the camera."""
    kind = generator.choice(
        ["table", "counter", "railing", "chair", "block", "pillar"],
        p=[0.22, 0.12, 0.2, 0.2, 0.14, 0.12],
    )
    gap = body.front + generator.uniform(0.03, 0.35)
    middle = body.hips[0] + generator.normal(0, 0.3)
    tall = body.height
    if kind == "chair":
        return _place_near(
            _chair(tall * generator.uniform(0.22, 0.32), generator), body, gap + 0.3, generator
        )
    if kind == "railing":
        return _railing(tall * generator.uniform(0.35, 0.62), generator).moved([middle, 0, gap])
    if kind == "pillar":
        radius = generator.uniform(0.04, 0.14)
        aside = (
            generator.choice([body.left, body.right]) * generator.uniform(0.2, 1.1)
            + body.hips[0] * 0.2
        )
        return rod(radius, 0, 2 * tall).moved([aside, 0, gap + radius])
    if kind == "block":
        size = (
            generator.uniform(0.25, 0.8),
            tall * generator.uniform(0.12, 0.4),
            generator.uniform(0.15, 0.5),
        )
        return box(*size).moved(
            [middle, size[1] / 2, gap + size[2] / 2], _yaw(generator.normal(0, 0.1))
        )
    width, depth, top = (
        generator.uniform(0.7, 1.9),
        generator.uniform(0.4, 0.7),
        tall * generator.uniform(0.32, 0.5),
    )
    thick = generator.uniform(0.02, 0.06)
    parts = [box(width, thick, depth).moved([0, top - thick / 2, 0])]
    if kind == "table":
        parts += _legs(width, depth, top - thick, generator.uniform(0.015, 0.04), 1)
    else:
        parts.append(
            box(0.96 * width, top - thick, 0.9 * depth, 1).moved([0, (top - thick) / 2, 0])
        )
    for _ in range(int(generator.integers(0, 4))):  # objects on it
        across, up, deep = generator.uniform(0.05, 0.3, 3)
        spot = [
            generator.uniform(-0.4, 0.4) * width,
            top + up / 2,
            generator.uniform(-0.3, 0.3) * depth,
        ]
        parts.append(
            box(across, up, deep, int(generator.integers(2, 4))).moved(
                spot, _yaw(generator.uniform(-0.5, 0.5))
            )
        )
    return joined(parts).moved([middle, 0, gap + depth / 2], _yaw(generator.normal(0, 0.15)))


def _railing(top: float, generator: np.random.Generator) -> Thing:
    """Return bars between posts along x."""
    wide, radius, lying = (
        4.0,
        generator.uniform(0.01, 0.03),
        np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    )
    bar = rod(radius, -wide / 2, wide / 2, sides=8).moved([0, 0, 0], lying)
    parts = [
        bar.moved([0, at, 0])
        for at in np.linspace(
            top, top * generator.uniform(0.15, 0.6), int(generator.integers(1, 5))
        )
    ]
    step = generator.choice([generator.uniform(0.1, 0.25), generator.uniform(0.8, 1.6)])
    posts = np.arange(-wide / 2, wide / 2, step) + generator.uniform(0, step)
    parts += [
        rod(radius * generator.uniform(0.5, 1.2), 0, top, 1, sides=6).moved([at, 0, 0])
        for at in posts
    ]
    return joined(parts)
