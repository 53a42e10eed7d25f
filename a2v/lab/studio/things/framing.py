"""Framing of a person: the photographed square, cuts by its border, and the visible fraction behind
objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.rays import RayScene
from a2v.lab.studio.things.solids import Thing
from a2v.types import FloatArray, IntArray

LEAST_LEFT = 0.4
"""Smallest fraction of the person's pixels that objects and the border must leave visible."""
_GRID = 96
"""Number of rays per side of the person's box that `share_left` casts."""
_DOWN = np.array([0, 0, -1], np.float32)


@dataclass(frozen=True, eq=False)
class Square:
    """The photographed square of the frame (`a2v.lab.studio.solid.PhotoFrame`).

    Attributes
    ----------
    middle : (2,) float
        Meters.
    extent : float
        Longer side of the box that it is drawn around, meters.
    fill : float
        That side as a fraction of the square's.
    """

    middle: FloatArray
    extent: float
    fill: float

    @property
    def side(self) -> float:
        """Side of the square, meters."""
        return self.extent / self.fill

    @classmethod
    def around(cls, seen: FloatArray, fill: float) -> Square:
        """Return the square around vertices (V, 3)."""
        least, most = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
        return cls((least + most) / 2, float((most - least).max()), fill)

    def cut(self, generator: np.random.Generator) -> Square:
        """Draw a square that is too small for the person, or shifted, so that its border cuts the
        person."""
        fill = self.fill * float(generator.uniform(1.1, 1.5))
        return Square(
            self.middle + self.extent * generator.uniform(-0.2, 0.2, 2), self.extent, fill
        )


def unhidden(seen: FloatArray, thing: Thing, generator: np.random.Generator) -> FloatArray:
    """Return the vertices, of (V, 3) in the frame, around which the picture is framed: half of the
    time only those that no object occludes.

    At run time only the mask is known (`a2v.perception.bodymap`,
    `a2v.reconstruction.implicit.inputs.frame_box`).
    """
    if generator.random() < 0.5:
        return seen
    some = seen[::5]
    free = some[
        ~RayScene(thing.vertices, thing.faces).occluded(
            some.astype(np.float32), np.array([0, 0, 1], np.float32)
        )
    ]
    return free if len(free) > LEAST_LEFT * len(some) else seen


def share_left(seen: FloatArray, faces: IntArray, thing: Thing | None, square: Square) -> float:
    """Return the fraction of a person's pixels that are visible: neither behind an object nor
    outside of the border.

    The person has vertices (V, 3) in the frame and faces (F, 3).
    """
    low, high = seen.min(axis=0), seen.max(axis=0)
    steps = (np.arange(_GRID) + 0.5) / _GRID
    at = low[:2] + (high - low)[:2] * np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    top = float(high[2] if thing is None else max(high[2], thing.vertices[:, 2].max())) + 1
    origins = np.column_stack([at, np.full(len(at), top)]).astype(np.float32)
    person = RayScene(seen.astype(np.float32), faces).cast(origins, _DOWN)
    left = person.hit & (np.abs(at - square.middle).max(axis=1) < square.side / 2)
    if thing is not None:
        before = RayScene(thing.vertices.astype(np.float32), thing.faces).cast(origins, _DOWN)
        left &= ~(before.hit & (before.distance < person.distance))
    return float(left.sum()) / max(int(person.hit.sum()), 1)
