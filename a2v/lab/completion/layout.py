"""Two sheets of the body at rest, front and back, on which a network completes colors.

MakeHuman's texture layout has islands, so that neighbors on the body are far apart in it. The body
at rest (arms 45 degrees down, legs apart) hides almost nothing of itself from the front and from
the back. So each place of the skin has a pixel on one of two pictures. Neighbors stay neighbors there, the
mirrored place is in the flipped column, and the place behind is at the same pixel of the other
sheet.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from a2v.body.registry import load_body_model
from a2v.body.skin import skin_vertices
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import RayScene
from a2v.types import BoolArray, FloatArray, IntArray

ROWS = 256
"""Height of a sheet, pixels."""
COLUMNS = 192
"""Width of a sheet, pixels."""
_MARGIN = 6
"""Empty pixels above and below the body."""


@dataclass(frozen=True, eq=False)
class Sheets:
    """The places of a mesh on both sheets (0 front, 1 back).

    Attributes
    ----------
    face : (2, ROWS, COLUMNS) int64
        Face of the mesh at each pixel; -1 for none.
    barycentric : (2, ROWS, COLUMNS, 3) float32
    depth : (2, ROWS, COLUMNS) float32
        z of the place at rest, meters; 0 for none.
    """

    face: IntArray
    barycentric: FloatArray
    depth: FloatArray

    @property
    def filled(self) -> BoolArray:
        """Pixels (2, ROWS, COLUMNS) that show the body."""
        return np.asarray(self.face >= 0)


@functools.cache
def frame() -> tuple[float, float, float]:
    """Pixels per meter, and the column and row of the origin of the default body at rest."""
    rest = default_rest()
    low, high = rest.min(axis=0), rest.max(axis=0)
    scale = (ROWS - 2 * _MARGIN) / float(high[1] - low[1])
    return scale, COLUMNS / 2, _MARGIN + scale * float(high[1])


@functools.cache
def default_rest() -> FloatArray:
    """Vertices (V, 3) of the default body at rest, meters, y up, facing +z."""
    import torch

    model = load_body_model("anny")
    with torch.no_grad():
        rest = model.rest(torch.from_numpy(model.shape_default))[0].numpy()
    return np.asarray(rest, np.float64)


def lay_out(vertices: FloatArray, faces: IntArray) -> Sheets:
    """Lay out a mesh of the default body at rest: `vertices` (V, 3), meters, and `faces` (F, 3)."""
    scale, left, top = frame()
    columns, rows = np.meshgrid(np.arange(COLUMNS) + 0.5, np.arange(ROWS) + 0.5)
    places = np.stack(
        [(columns - left) / scale, (top - rows) / scale, np.zeros(columns.shape)], axis=-1
    ).reshape(-1, 3)
    rays = RayScene(np.asarray(vertices, np.float32), faces)
    shape, found = (ROWS, COLUMNS), []
    for sign in (1.0, -1.0):
        hits = rays.cast(places + np.array([0, 0, 5 * sign]), np.array([0, 0, -sign]))
        face = np.where(hits.hit, hits.face, -1).reshape(shape)
        uv = hits.barycentric
        weight = np.concatenate([1 - uv.sum(axis=1, keepdims=True), uv], axis=1)
        depth = np.where(hits.hit, sign * (5 - hits.distance), 0.0).reshape(shape)
        found.append((face, weight.reshape(*shape, 3), depth))
    face, weight, depth = (np.stack(values) for values in zip(*found, strict=True))
    return Sheets(face, weight.astype(np.float32), depth.astype(np.float32))


@functools.cache
def skin_sheets() -> tuple[Sheets, IntArray, IntArray]:
    """The sheets of Anny's outer skin, its faces (F, 3) in the order of `outer_skin`, and the
    vertices (S,) of Anny that it keeps."""
    model = load_body_model("anny")
    kept = skin_vertices(len(default_rest()), model.faces)
    number = np.full(len(default_rest()), -1)
    number[kept] = np.arange(len(kept))
    faces = number[np.asarray(model.faces, np.int64)]
    faces = faces[(faces >= 0).all(axis=1)]
    return lay_out(default_rest()[kept], faces), faces, kept


def pixels_of(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Columns and rows (V, 2) on the sheets of the default body's `vertices` (V, 3) at rest, and
    the share (V,) of the front."""
    scale, left, top = frame()
    normals = vertex_normals(vertices, faces)
    pixels = np.stack([left + scale * vertices[:, 0], top - scale * vertices[:, 1]], axis=1)
    return pixels, np.clip(0.5 + 2.5 * normals[:, 2], 0, 1)
