"""The outer skin of a body: its mesh without eyes, teeth and tongue."""

from __future__ import annotations

import numpy as np

from a2v.geometry.mesh import piece_of_faces
from a2v.types import Body, FloatArray, IntArray


def outer_skin(body: Body) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the largest connected piece of a body's mesh, by its faces.

    Returns
    -------
    vertices : (S, 3) float64
        Meters, in the body's frame, in the body's order.
    faces : (G, 3) int64
    parts : (S,) int8
        Body part of each vertex, an index into `a2v.body.PARTS`.
    """
    own = _largest_piece(len(body.vertices), body.faces)
    kept = np.zeros(len(body.vertices), bool)
    kept[own.ravel()] = True
    number = np.cumsum(kept) - 1
    return np.asarray(body.vertices, np.float64)[kept], number[own], np.asarray(body.parts)[kept]


def skin_vertices(count: int, faces: IntArray) -> IntArray:
    """Return the indices (S,) int64, ascending, of the vertices that `outer_skin` keeps of a mesh
    with `count` vertices and `faces` (F, 3)."""
    return np.unique(_largest_piece(count, faces))


def _largest_piece(count: int, faces: IntArray) -> IntArray:
    """Return the faces (G, 3) int64 of the largest connected piece of a mesh of `count`
    vertices."""
    faces = np.asarray(faces, np.int64)
    piece = piece_of_faces(count, faces)
    return np.asarray(faces[piece == np.bincount(piece).argmax()])


def spread_vertices(rest: FloatArray, faces: IntArray, count: int, *, seed: int) -> IntArray:
    """Return indices (count,) of vertices (V, 3) spread evenly over the skin."""
    corner = rest[faces]
    area = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    weight = np.zeros(len(rest))
    for index in range(3):
        np.add.at(weight, faces[:, index], area)
    rng = np.random.default_rng(seed)
    return np.sort(rng.choice(len(rest), size=count, replace=False, p=weight / weight.sum()))
