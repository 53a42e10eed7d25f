"""The head chart: head and neck of the body, unrolled by azimuth and elevation around the middle of
the head. It is the same for all people, and a network completes heads in it."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from a2v.body.parts import on_parts
from a2v.body.registry import default_rest, load_body_model
from a2v.body.skin import skin_vertices
from a2v.geometry.rays import RayScene
from a2v.types import BoolArray, FloatArray, IntArray

HEIGHT = 96
"""Number of elevations."""
WIDTH = 128
"""Number of azimuths."""
CENTER = np.array([0.0, 0.79, 0.045])
"""Middle of the head of the default body at rest, meters."""
_TOP = np.radians(90.0)
"""Largest elevation, radians."""
_BOTTOM = np.radians(-75.0)
"""Smallest elevation, on the neck, radians."""
_OUTSIDE = 0.5
"""Distance from the middle at which rays begin, meters."""
PARTS = ("head", "neck")
"""Parts that the chart shows."""


@dataclass(frozen=True, eq=False)
class HeadCells:
    """Which place of the outer skin each cell of the chart shows.

    Attributes
    ----------
    valid : (H, W) bool
        Cells on head or neck; others lie below the neck.
    corners : (H, W, 3) int64
        Vertices of the body model.
    weights : (H, W, 3) float64
        Their barycentric coordinates.
    """

    valid: BoolArray
    corners: IntArray
    weights: FloatArray

    def spread(self, values: FloatArray) -> FloatArray:
        """Values (H, W, C) of the cells from those (V, C) of the model's vertices."""
        return np.asarray((np.asarray(values)[self.corners] * self.weights[..., None]).sum(axis=2))


def chart_places(points: FloatArray) -> FloatArray:
    """Column and row (n, 2) in the chart, in cells, of points (n, 3) of the default body at
    rest."""
    away = np.asarray(points, np.float64) - CENTER
    azimuth = np.arctan2(away[:, 0], away[:, 2])
    elevation = np.arctan2(away[:, 1], np.hypot(away[:, 0], away[:, 2]))
    column = (azimuth / (2 * np.pi) + 0.5) * WIDTH - 0.5
    row = (_TOP - elevation) / (_TOP - _BOTTOM) * HEIGHT - 0.5
    return np.stack([column, row], axis=1)


def sample_chart(chart: FloatArray, places: FloatArray) -> FloatArray:
    """Sample a chart (H, W, C) bilinearly at `places` (n, 2); the azimuth goes around."""
    import cv2

    wrapped = np.concatenate([chart[:, -1:], chart, chart[:, :1]], axis=1).astype(np.float32)
    column = (places[:, 0] + 1).astype(np.float32)
    row = np.clip(places[:, 1], 0, HEIGHT - 1).astype(np.float32)
    found = cv2.remap(wrapped, column[:, None], row[:, None], cv2.INTER_LINEAR)
    return np.asarray(found.reshape(len(places), -1), np.float64)


@functools.cache
def head_cells() -> HeadCells:
    """Make the cells from the default body at rest, once per process."""
    model = load_body_model("anny")
    rest = default_rest()
    outer = np.zeros(len(rest), bool)
    outer[skin_vertices(len(rest), model.faces)] = True
    faces = np.asarray(model.faces, np.int64)
    faces = faces[(outer & on_parts(np.asarray(model.parts), *PARTS))[faces].all(axis=1)]
    row, column = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    elevation = _TOP - row.ravel() / HEIGHT * (_TOP - _BOTTOM)
    azimuth = (column.ravel() / WIDTH - 0.5) * 2 * np.pi
    way = np.stack(
        [
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
            np.cos(elevation) * np.cos(azimuth),
        ],
        axis=1,
    )
    hits = RayScene(rest, faces).cast(
        (CENTER + _OUTSIDE * way).astype(np.float32), (-way).astype(np.float32)
    )
    valid = hits.hit & (hits.distance < _OUTSIDE)
    corner = faces[np.where(valid, hits.face, 0)]
    u, v = np.where(valid[:, None], hits.barycentric, 0.0).T.astype(np.float64)
    weights = np.stack([1 - u - v, u, v], axis=1)
    shape = (HEIGHT, WIDTH)
    return HeadCells(valid.reshape(shape), corner.reshape(*shape, 3), weights.reshape(*shape, 3))
