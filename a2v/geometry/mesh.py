"""Small mesh tools: normals, areas and Laplacians as sparse matrices."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.geometry.vectors import unit
from a2v.types import FloatArray, IntArray


def vertex_normals(
    vertices: FloatArray, faces: IntArray, *, dtype: type[np.floating[Any]] = np.float64
) -> FloatArray:
    """Unit normals (V, 3) float64 weighted by face area; zero where a vertex has no face.

    Parameters
    ----------
    vertices : (V, 3)
    faces : (F, 3) int
        Counter-clockwise seen from outside.
    dtype : floating type
        Of the faces' normals before they are added up.
    """
    corners = np.asarray(vertices, dtype)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.stack(
        [np.bincount(faces.ravel(), np.repeat(normal[:, a], 3), len(vertices)) for a in range(3)],
        -1,
    )
    return unit(np.asarray(total, np.float64), least=1e-20)


def within(values: FloatArray, corner: IntArray, weight: FloatArray) -> FloatArray:
    """Values (n, K) at places in faces whose `corner` (n, 3) vertices have the barycentric `weight`
    (n, 3, 1), out of those of the vertices (V, K).

    To the bit the sum over an axis of (n, 3, K), which takes twice as long.
    """
    first, second, third = (values[corner[:, k]] * weight[:, k] for k in range(3))
    return np.asarray(first + second + third)


def evened(faces: IntArray, values: FloatArray, times: int = 1) -> FloatArray:
    """Means of `values` (V, ...) over each vertex of `faces` (F, 3) and its neighbors, so many
    times."""
    from scipy.sparse import csr_matrix

    one, two = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    own = np.arange(len(values))
    rows, columns = np.concatenate([one, two, own]), np.concatenate([two, one, own])
    beside = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(values), len(values)))
    total = np.asarray(beside.sum(axis=1)).reshape(-1, *[1] * (values.ndim - 1))
    for _ in range(times):
        values = beside @ values / total
    return values


def face_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Unit normals (F, 3) float32, worked out in float64; zero for degenerate faces."""
    corner = vertices[faces].astype(np.float64)
    return unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])).astype(
        np.float32
    )


def vertex_areas(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """A third of the area of the faces around each vertex, (V,) square meters."""
    corners = vertices[faces]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    total: FloatArray = np.bincount(faces.ravel(), np.repeat(area / 3, 3), len(vertices)).astype(
        np.float64
    )
    return total


def cotangent_weights(vertices: FloatArray, faces: IntArray, *, smallest: float = 1e-2) -> Any:
    """Symmetric sparse matrix (V, V) of edge weights (cot alpha + cot beta) / 2.

    Cotangents of obtuse triangles are negative, which lets local rotations flip: edge weights are
    kept above `smallest` (degenerate triangles give it too).
    """
    from scipy.sparse import coo_matrix

    v = vertices.astype(np.float64)
    rows, columns, values = [], [], []
    for a in range(3):
        i, j, k = faces[:, (a + 1) % 3], faces[:, (a + 2) % 3], faces[:, a]
        to_i, to_j = v[i] - v[k], v[j] - v[k]
        sine = np.linalg.norm(np.cross(to_i, to_j), axis=1)
        cotangent = (to_i * to_j).sum(1) / np.maximum(sine, 1e-12)
        cotangent = np.clip(cotangent, -50, 50) * (sine > 1e-12)
        rows += [i, j]
        columns += [j, i]
        values += [cotangent / 2, cotangent / 2]
    count = len(v)
    matrix = coo_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(count, count),
    ).tocsr()
    matrix.data = np.maximum(matrix.data, smallest)
    return matrix


def laplacian(weights: Any) -> Any:
    """Positive semi-definite Laplacian (V, V) of a symmetric weight matrix."""
    from scipy.sparse import diags

    return (diags(np.asarray(weights.sum(axis=1)).ravel()) - weights).tocsr()


def joined_by(count: int, pairs: IntArray) -> IntArray:
    """Number, from 0, of the group of each of `count` items that pairs (P, 2) of them join."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    graph = sp.csr_matrix((np.ones(len(pairs), bool), tuple(pairs.T)), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def piece_of_vertices(count: int, faces: IntArray) -> IntArray:
    """Number, from 0, of the connected piece of each of the `count` vertices of a mesh."""
    return joined_by(count, np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]]))


def piece_of_faces(count: int, faces: IntArray) -> IntArray:
    """Number, from 0, of the connected piece of each face (F,) of a mesh with `count` vertices."""
    label = piece_of_vertices(count, faces)
    return np.asarray(np.unique(label[faces[:, 0]], return_inverse=True)[1])


def signed_volumes(vertices: FloatArray, faces: IntArray, piece: IntArray) -> FloatArray:
    """Volume enclosed by each piece, m³, negative where its faces look inwards; `piece` (F,)
    numbers the pieces of the faces."""
    corners = np.asarray(vertices, np.float64)[faces]
    return np.asarray(
        np.bincount(
            piece, np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        )
    )


def keep_pieces(
    vertices: FloatArray, faces: IntArray, share: float = 1.0
) -> tuple[FloatArray, IntArray]:
    """The connected piece of largest volume, and others of at least `share` of it. Bubbles inside
    look inwards and go as well."""
    piece = piece_of_faces(len(vertices), faces)
    volumes = signed_volumes(vertices, faces, piece)
    good = volumes >= share * volumes.max()
    faces = faces[good[piece]]
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3)


def is_closed(vertices: FloatArray, faces: IntArray) -> bool:
    """Whether every edge joins two faces that agree about outside, no vertex is left over, and
    every piece encloses a volume."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = np.sort(edges[:, 0] * np.int64(len(vertices)) + edges[:, 1])
    back = np.sort(edges[:, 1] * np.int64(len(vertices)) + edges[:, 0])
    if (
        not len(faces)
        or (there[1:] == there[:-1]).any()
        or (there != back).any()
        or len(np.unique(faces)) != len(vertices)
    ):
        return False
    return bool((signed_volumes(vertices, faces, piece_of_faces(len(vertices), faces)) > 0).all())


class Cholesky:
    """A factored symmetric positive definite sparse matrix: factor once, solve many right-hand
    sides."""

    def __init__(self, matrix: Any):
        from cholespy import CholeskySolverD, MatrixType

        entries = matrix.tocoo()
        self._size = entries.shape[0]
        self._solver = CholeskySolverD(
            self._size,
            entries.row.astype(np.int32),
            entries.col.astype(np.int32),
            entries.data.astype(np.float64),
            MatrixType.COO,
        )

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution (V, C) for right-hand sides (V, C)."""
        solution = np.zeros((self._size, right.shape[1]))
        wide = 64  # cholespy takes up to 128 columns at once
        for first in range(0, right.shape[1], wide):
            part = np.ascontiguousarray(right[:, first : first + wide], dtype=np.float64)
            out = np.zeros_like(part)
            self._solver.solve(part, out)
            solution[:, first : first + wide] = out
        return solution


def border_edges(faces: IntArray) -> IntArray:
    """Directed edges (n, 2) of faces (F, 3) without another face beyond them."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    base = int(faces.max()) + 1
    forward, backward = edges[:, 0] * base + edges[:, 1], edges[:, 1] * base + edges[:, 0]
    return np.asarray(edges[~np.isin(forward, backward)])


def border_loops(faces: IntArray) -> list[IntArray]:
    """Borders of faces (F, 3) whose corners are each passed once, as vertices in order, the longest
    first."""
    following = {int(a): int(b) for a, b in border_edges(faces)}
    loops: list[IntArray] = []
    while following:
        start, at = next(iter(following.items()))
        loop = [start]
        del following[start]
        while at != start and at in following:
            loop.append(at)
            at = following.pop(at)
        loops.append(np.array(loop))
    return sorted(loops, key=len, reverse=True)
