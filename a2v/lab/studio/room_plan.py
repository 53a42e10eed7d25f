"""Random plans of ordinary rooms: walls, floor, furniture, lights and a camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.colors import to_bytes
from a2v.types import ByteArray, FloatArray, Surface

SHORT = 600
"""Shorter side of the photos, pixels."""
LONG = 800
"""Longer side of the photos, pixels."""


@dataclass(frozen=True, eq=False)
class RoomPlan:
    """A room's objects as Mitsuba dictionaries without texture objects, its camera and its
    facts."""

    boxes: tuple[tuple[str, FloatArray, FloatArray, float, FloatArray], ...]
    """Name, middle (3,), half sides (3,), turn about the vertical in degrees, sRGB (3,)."""
    wall: FloatArray
    floor: ByteArray
    back: tuple[float, float]
    """Distance of the back wall behind the origin, meters, and its turn, degrees."""
    side: tuple[float, float]
    """Side with a wall (-1, 1), and its distance, meters."""
    lamp: tuple[FloatArray, float, FloatArray]
    """Middle (3,), radius and radiance (3,) of the ceiling lamp."""
    window: tuple[float, FloatArray]
    """Side of the window (-1, 1) and its radiance (3,)."""
    origin: FloatArray
    target: FloatArray
    fov: float
    size: tuple[int, int]
    """Width and height, pixels."""

    @classmethod
    def draw(cls, number: int, generator: np.random.Generator, person: Surface) -> RoomPlan:
        """Draw a room around a person who stands at the origin."""
        tall = float(person.vertices[:, 1].max())
        upright = bool(number % 2)
        distance, height = generator.uniform(2.6, 4.2), generator.uniform(1.2, 1.6)
        width, rows = (SHORT, LONG) if upright else (LONG, SHORT)
        fill = generator.uniform(0.62, 0.78)
        fov = 2 * np.degrees(np.arctan(tall / fill / 2 / distance * (width / rows)))
        aside = generator.uniform(-0.15, 0.15) * (1 if upright else 3)
        origin = np.array([aside + generator.uniform(-0.3, 0.3), height, distance])
        target = np.array([aside, tall / 2 + generator.uniform(-0.05, 0.1), 0.0])
        back = generator.uniform(0.5, 2.2), generator.uniform(-14, 14)
        side = float(generator.choice([-1, 1])), generator.uniform(1.3, 2.4)
        warm = np.array([1.0, generator.uniform(0.85, 0.97), generator.uniform(0.68, 0.92)])
        cool = np.array([generator.uniform(0.85, 1.0), 0.95, 1.0])
        lamp = (
            np.array([generator.uniform(-1, 1), 2.55, generator.uniform(-0.5, 1.5)]),
            generator.uniform(0.12, 0.3),
            warm * generator.uniform(14, 30),
        )
        window = float(generator.choice([-1, 1])), cool * generator.uniform(1.5, 5)
        return cls(
            _furniture(number, generator, back, side),
            _wall(generator),
            _floor(number, generator),
            back,
            side,
            lamp,
            window,
            origin,
            target,
            float(fov),
            (width, rows),
        )


def _wall(generator: np.random.Generator) -> FloatArray:
    """Draw a wall's paint, sRGB (3,)."""
    base = generator.uniform(0.55, 0.92)
    return np.clip(base + generator.uniform(-0.1, 0.1, 3), 0.2, 0.97)


def _floor(number: int, generator: np.random.Generator) -> ByteArray:
    """Draw a square of the floor (512, 512, 3) that is repeated: planks, tiles, carpet or stone."""
    import cv2

    size, kind = 512, number % 4
    grain = generator.standard_normal((size, size)).astype(np.float32)
    if kind == 0:  # planks along y
        color = np.array(
            [
                generator.uniform(0.45, 0.7),
                generator.uniform(0.32, 0.48),
                generator.uniform(0.2, 0.32),
            ]
        )
        plank = np.arange(size) * 6 // size
        tone = (
            generator.uniform(0.82, 1.1, 6)[plank][None, :]
            + 0.05 * cv2.GaussianBlur(grain, (0, 0), sigmaX=0.8, sigmaY=30) * 8
        )
        tone[:, np.flatnonzero(np.diff(plank, prepend=-1))] *= 0.55
    elif kind == 1:  # tiles
        color = np.full(3, generator.uniform(0.6, 0.85)) + generator.uniform(-0.05, 0.05, 3)
        tone = 1 + 0.06 * cv2.GaussianBlur(grain, (0, 0), 12) * 12
        for at in range(0, size, size // 4):
            tone[at : at + 3] *= 0.7
            tone[:, at : at + 3] *= 0.7
    elif kind == 2:  # carpet
        color = generator.uniform(0.3, 0.65, 3)
        tone = 1 + 0.12 * grain
    else:  # stone
        color = np.full(3, generator.uniform(0.4, 0.7))
        tone = 1 + 0.5 * cv2.GaussianBlur(grain, (0, 0), 6) + 0.06 * grain
    return to_bytes(np.clip(color * np.asarray(tone)[..., None], 0, 1))


def _furniture(
    number: int,
    generator: np.random.Generator,
    back: tuple[float, float],
    side: tuple[float, float],
) -> tuple[tuple[str, FloatArray, FloatArray, float, FloatArray], ...]:
    """Draw boxes in the room: a sofa or shelf at the wall, a picture or door on it. Every third
    room has an object in front of the person."""
    away, turn = back
    found = []
    color = generator.uniform(0.15, 0.85, 3)
    x = float(generator.choice([-1, 1]) * generator.uniform(0.7, 1.4))
    kind = number % 3
    if kind == 0:
        found.append(
            ("sofa", np.array([x, 0.22, -away + 0.42]), np.array([0.7, 0.22, 0.38]), turn, color)
        )
        found.append(
            ("sofa", np.array([x, 0.6, -away + 0.14]), np.array([0.7, 0.25, 0.1]), turn, color)
        )
    elif kind == 1:
        found.append(
            ("shelf", np.array([x, 0.75, -away + 0.18]), np.array([0.35, 0.75, 0.16]), turn, color)
        )
    else:
        found.append(
            (
                "door",
                np.array([x, 1.0, -away + 0.012]),
                np.array([0.42, 1.0, 0.02]),
                turn,
                np.clip(color + 0.25, 0, 0.95),
            )
        )
    picture = generator.uniform(0.2, 0.9, 3)
    found.append(
        (
            "picture",
            np.array([-x * 0.7, 1.55, -away + 0.02]),
            np.array([0.3, 0.22, 0.012]),
            turn,
            picture,
        )
    )
    if number % 3 == 2:
        where = float(generator.choice([-1, 1]) * generator.uniform(0.2, 0.35))
        found.append(
            (
                "table",
                np.array([where, 0.21, 0.55]),
                np.array([0.22, 0.21, 0.18]),
                generator.uniform(-20, 20),
                generator.uniform(0.2, 0.7, 3),
            )
        )
    return tuple(found)
