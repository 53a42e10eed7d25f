"""Samples of a launch of the tracer: stratified random points and camera rays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.opaque import opaque_integer, opaque_number, opaque_numbers


class Draws:
    """Points of Sobol's sequence in the unit square, scrambled separately for each pixel and each
    pair of dimensions.

    The points are stratified within a pixel.
    """

    def __init__(self, mi: Any, index: Any, pixel: Any, mask: Any, seed: Any, table: Any) -> None:
        self._mi, self._index, self._mask, self._table = mi, index, mask, table
        self._key, _ = mi.sample_tea_32(pixel, seed)
        self._pair = 0

    def next(self) -> Any:
        """Return the next Point2f in [0, 1)."""
        return self._point(self._scrambled(), self._index, self._mask)

    def pair(self) -> list[Any]:
        """Return the next two points, from a sequence of twice as many per pixel."""
        keys = self._scrambled()
        return [self._point(keys, self._index * 2 + which, self._mask * 2 + 1) for which in (0, 1)]

    def _scrambled(self) -> tuple[Any, Any]:
        self._pair += 1
        one, two = self._mi.sample_tea_32(self._key, self._mi.UInt32(self._pair))
        return one, two

    def _point(self, keys: tuple[Any, Any], index: Any, mask: Any) -> Any:
        import drjit as dr

        one, two = keys
        at = index ^ (
            (two >> 7) & mask
        )  # shuffle each pair of dimensions differently; otherwise they would be correlated
        bits = dr.brev(at) ^ one, dr.gather(self._mi.UInt32, self._table, at) ^ two
        return self._mi.Point2f(*(self._mi.Float(part >> 8) * (1 / (1 << 24)) for part in bits))


@dataclass(frozen=True)
class Lanes:
    """The samples of a launch: their pixels, the columns and rows of pixels that they spread over
    (None: one pixel), and their draws."""

    mi: Any
    pixel: Any
    spread: Any
    draws: Draws

    def pair(self, camera: ViewCamera, size: int) -> list[Any]:
        """Return two camera rays through points in the pixel."""
        return [primary_ray(self.mi, self.pixel, at, camera, size) for at in self.draws.pair()]

    def ray(self, camera: ViewCamera, size: int) -> Any:
        """Return a camera ray through a point in the pixel."""
        at = self.draws.next()
        if self.spread is not None:
            at = self.mi.Point2f(at.x * self.spread[0], at.y * self.spread[1])
        return primary_ray(self.mi, self.pixel, at, camera, size)


def primary_ray(mi: Any, pixel: Any, at: Any, camera: ViewCamera, size: int) -> Any:
    """Return camera rays through points `at` (Point2f) of pixels (row * size + column)."""
    import drjit as dr

    width, half = opaque_integer(mi, size), opaque_number(mi, size / 2)
    unit = opaque_number(mi, np.tan(np.radians(camera.fov) / 2) / (size / 2))
    right, up, backward = (mi.Vector3f(*opaque_numbers(mi, axis)) for axis in camera.axes)
    u, v = mi.Float(pixel % width) + at.x - half, mi.Float(pixel // width) + at.y - half
    return mi.Ray3f(
        mi.Point3f(*opaque_numbers(mi, camera.origin)),
        dr.normalize(right * (u * unit) - up * (v * unit) - backward),
    )
