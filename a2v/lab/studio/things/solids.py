"""Plain solids: boxes and surfaces of revolution, joined to objects, and objects joined to a
person's textured mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from a2v.lab.studio.solid import smooth_normals
from a2v.lab.studio.texture import texture_of
from a2v.types import ByteArray, FloatArray, IntArray, Surface

TILE = 64
"""Side of a pattern (`a2v.lab.studio.things.paint`), pixels."""


@dataclass(frozen=True, eq=False)
class Thing:
    """A mesh whose faces have coordinates on numbered patterns; vertices are shared where it is
    smooth.

    Attributes
    ----------
    vertices : (V, 3) float
        Meters.
    faces : (F, 3) int
    uv : (F, 3, 2) float
        Coordinates on the pattern, in [0, 1].
    patterns : (F,) int
        Number of each face's pattern.
    """

    vertices: FloatArray
    faces: IntArray
    uv: FloatArray
    patterns: IntArray

    def moved(self, shift: FloatArray | Sequence[float], turn: FloatArray | None = None) -> Thing:
        """Return the object turned by a rotation (3, 3), if given, then moved by (3,)."""
        vertices = self.vertices if turn is None else self.vertices @ np.asarray(turn).T
        return replace(self, vertices=vertices + np.asarray(shift, np.float64))

    def painted(self, pattern: int) -> Thing:
        """Return the object with a single pattern."""
        return replace(self, patterns=np.full(len(self.faces), pattern))


def joined(things: Sequence[Thing]) -> Thing:
    """Join several objects to one."""
    starts = np.cumsum([0, *(len(thing.vertices) for thing in things)])
    return Thing(
        np.concatenate([thing.vertices for thing in things]),
        np.concatenate([thing.faces + start for thing, start in zip(things, starts, strict=False)]),
        np.concatenate([thing.uv for thing in things]),
        np.concatenate([thing.patterns for thing in things]),
    )


def box(width: float, height: float, depth: float, pattern: int = 0) -> Thing:
    """Return a box around the origin with sizes along x, y, z, meters."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    half, corners = np.array([width, height, depth]) / 2, []
    for axis in range(3):
        for sign in (1, -1):
            side = np.insert(square if sign > 0 else square[::-1], axis, sign, axis=1)
            corners.append((side if axis != 1 else side[::-1]) * half)
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    return Thing(
        np.concatenate(corners),
        np.concatenate([quad + 4 * side for side in range(6)]),
        np.tile((square[quad] + 1) / 2, (6, 1, 1)),
        np.full(12, pattern),
    )


def turned(profile: Sequence[tuple[float, float]], pattern: int = 0, sides: int = 14) -> Thing:
    """Return the surface of revolution of a profile about the y axis.

    The profile is (radius, height), meters, from bottom to top. The surface is open at both ends.
    """
    rows = np.asarray(profile, float)
    around = 2 * np.pi * np.arange(sides + 1) / sides
    ring = np.stack([np.sin(around), np.zeros(sides + 1), np.cos(around)], axis=-1)
    vertices = rows[:, None, :1] * ring + rows[:, None, 1:] * np.array([0.0, 1.0, 0.0])
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(rows, axis=0), axis=1))]
    at = np.stack(
        np.broadcast_arrays(around[None] / (2 * np.pi), (length / max(length[-1], 1e-9))[:, None]),
        axis=-1,
    ).reshape(-1, 2)
    first = (np.arange(len(rows) - 1)[:, None] * (sides + 1) + np.arange(sides)[None]).ravel()
    up = first + sides + 1
    faces = np.concatenate(
        [np.stack([first, first + 1, up + 1], axis=1), np.stack([first, up + 1, up], axis=1)]
    )
    return Thing(vertices.reshape(-1, 3), faces, at[faces], np.full(len(faces), pattern))


def rod(
    radius: float,
    low: float,
    high: float,
    pattern: int = 0,
    *,
    tip: float | None = None,
    sides: int = 10,
) -> Thing:
    """Return a closed rod along y; `tip` is the radius of its upper end, if it differs."""
    end = radius if tip is None else tip
    wall = turned([(radius, low), (end, high)], pattern, sides)
    return joined(
        [
            wall,
            turned([(0, low), (radius, low)], pattern, sides),
            turned([(end, high), (0, high)], pattern, sides),
        ]
    )


def ball(radius: float, pattern: int = 0, *, tall: float = 1.0) -> Thing:
    """Return a ball around the origin, stretched by `tall` along y."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 9)
    return turned(
        [(float(radius * np.cos(a)), float(tall * radius * np.sin(a))) for a in angle], pattern
    )


def with_thing(
    surface: Surface, normals: FloatArray, thing: Thing, patterns: Sequence[ByteArray]
) -> tuple[Surface, FloatArray]:
    """Append an object to a person's textured surface; returns the surface and the normals (V, 3)
    of both.

    The object's faces follow the person's, and its patterns are below the texture.

    Parameters
    ----------
    surface : Surface
        Its texture must be at least `TILE` times the number of patterns wide.
    normals : (V, 3)
        Normals of its vertices.
    thing : Thing
        In the surface's frame.
    patterns : sequence of (TILE, TILE, 3) uint8

    Raises
    ------
    InputError
        The surface has no texture.
    """
    places, texture = texture_of(surface)
    height, width = texture.shape[:2]
    strip = np.zeros((TILE, width, 3), np.uint8)
    for number, pattern in enumerate(patterns):
        strip[:, TILE * number : TILE * (number + 1)] = pattern
    tall = height + TILE
    own = places * np.array([1, height / tall], np.float32) + np.array([0, TILE / tall], np.float32)
    # one pixel from the borders, so that neighboring patterns do not bleed in
    inside = 1 + (TILE - 2) * thing.uv
    theirs = np.stack(
        [(inside[..., 0] + TILE * thing.patterns[:, None]) / width, inside[..., 1] / tall], axis=-1
    )
    vertices, faces = thing.vertices.astype(np.float32), thing.faces + len(surface.vertices)
    whole = replace(
        surface,
        vertices=np.concatenate([surface.vertices, vertices]),
        faces=np.concatenate([surface.faces, faces.astype(surface.faces.dtype)]),
        colors=np.concatenate([surface.colors, np.zeros((len(vertices), 3), np.float32)]),
        uv=np.concatenate([own, theirs.astype(np.float32)]),
        texture=np.concatenate([texture, strip]),
    )
    return whole, np.concatenate(
        [normals, smooth_normals(vertices, thing.faces, np.arange(len(vertices)))]
    )
