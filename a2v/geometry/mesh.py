"""Small mesh tools: normals, areas, and sparse Laplacian matrices."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.geometry.vectors import unit
from a2v.types import FloatArray, IntArray


def vertex_normals(
    vertices: FloatArray, faces: IntArray, *, dtype: type[np.floating[Any]] = np.float64
) -> FloatArray:
    """Return unit normals (V, 3) float64 weighted by face area; zero if a vertex has no face.

    Parameters
    ----------
    vertices : (V, 3)
    faces : (F, 3) int
        Counter-clockwise seen from outside.
    dtype : floating type
        Type of the faces' normals before they are summed.
    """
    corners = np.asarray(vertices, dtype)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.stack(
        [np.bincount(faces.ravel(), np.repeat(normal[:, a], 3), len(vertices)) for a in range(3)],
        -1,
    )
    return unit(np.asarray(total, np.float64), least=1e-20)


def within(values: FloatArray, corner: IntArray, weight: FloatArray) -> FloatArray:
    """Interpolate values (V, K) of vertices at points in faces; returns (n, K).

    `corner` (n, 3) are the vertices of each point's face, `weight` (n, 3, 1) its barycentric
    weights. The result is bit by bit that of a sum over an axis of (n, 3, K), but takes half the
    time.
    """
    total, *others = (np.take(values, corner[:, k], axis=0) * weight[:, k] for k in range(3))
    for one in others:
        total += one
    return np.asarray(total)


def evened(faces: IntArray, values: FloatArray, times: int = 1) -> FloatArray:
    """Average `values` (V, ...) over each vertex of `faces` (F, 3) and its neighbors, `times`
    times."""
    return Rings(faces, len(values)).evened(values, times)


class Rings:
    """The neighbors of the vertices of a mesh, for many rounds of `evened`."""

    def __init__(self, faces: IntArray, count: int) -> None:
        from scipy.sparse import csr_matrix

        one, two = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
        own = np.arange(count)
        rows, columns = np.concatenate([one, two, own]), np.concatenate([two, one, own])
        self._beside = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))
        self._total = np.asarray(self._beside.sum(axis=1))

    def evened(self, values: FloatArray, times: int = 1) -> FloatArray:
        """Average `values` (V, ...) over each vertex and its neighbors, `times` times."""
        total = self._total.reshape(-1, *[1] * (values.ndim - 1))
        for _ in range(times):
            values = self._beside @ values / total
        return values


def face_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return unit normals (F, 3) float32, computed in float64; zero for degenerate faces."""
    corner = vertices[faces].astype(np.float64)
    return unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])).astype(
        np.float32
    )


def vertex_areas(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return a third of the area of the faces around each vertex, (V,) square meters."""
    corners = vertices[faces]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    total: FloatArray = np.bincount(faces.ravel(), np.repeat(area / 3, 3), len(vertices)).astype(
        np.float64
    )
    return total


def cotangent_weights(vertices: FloatArray, faces: IntArray, *, smallest: float = 1e-2) -> Any:
    """Return the symmetric sparse matrix (V, V) of edge weights (cot alpha + cot beta) / 2.

    Cotangents of obtuse triangles are negative, which lets local rotations flip. So edge weights
    are at least `smallest`; degenerate triangles also give this value.
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


def uniform_weights(faces: IntArray, count: int) -> Any:
    """Return the symmetric sparse matrix (V, V) of edge weights of a mesh with `count` vertices:
    one half for each face at the edge."""
    from scipy.sparse import coo_matrix

    one, two = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    ends = np.concatenate([one, two]), np.concatenate([two, one])
    return coo_matrix((np.full(2 * len(one), 0.5), ends), shape=(count, count))


def laplacian(weights: Any) -> Any:
    """Return the positive semi-definite Laplacian (V, V) of a symmetric weight matrix."""
    from scipy.sparse import diags

    return (diags(np.asarray(weights.sum(axis=1)).ravel()) - weights).tocsr()


def joined_by(count: int, pairs: IntArray) -> IntArray:
    """Return the group number, from 0, of each of `count` items, where pairs (P, 2) connect
    items."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    graph = sp.csr_matrix((np.ones(len(pairs), bool), tuple(pairs.T)), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def piece_of_vertices(count: int, faces: IntArray) -> IntArray:
    """Return the number, from 0, of the connected piece of each of the `count` vertices of a
    mesh."""
    return joined_by(count, np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]]))


def piece_of_faces(count: int, faces: IntArray) -> IntArray:
    """Return the number, from 0, of the connected piece of each face (F,) of a mesh with `count`
    vertices."""
    label = piece_of_vertices(count, faces)
    return np.asarray(np.unique(label[faces[:, 0]], return_inverse=True)[1])


def signed_volumes(vertices: FloatArray, faces: IntArray, piece: IntArray) -> FloatArray:
    """Return the volume of each piece, m³, negative if its faces are oriented inward.

    `piece` (F,) numbers the pieces of the faces.
    """
    corners = np.asarray(vertices, np.float64)[faces]
    return np.asarray(
        np.bincount(
            piece, np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        )
    )


def keep_pieces(
    vertices: FloatArray, faces: IntArray, share: float = 1.0
) -> tuple[FloatArray, IntArray]:
    """Keep the connected piece of largest volume, and others of at least `share` of it.

    Bubbles inside have negative volume and are removed.
    """
    piece = piece_of_faces(len(vertices), faces)
    volumes = signed_volumes(vertices, faces, piece)
    good = volumes >= share * volumes.max()
    faces = faces[good[piece]]
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3)


def is_closed(vertices: FloatArray, faces: IntArray) -> bool:
    """Return whether the mesh is closed.

    Every edge joins two faces of consistent orientation, every vertex has a face, and every piece
    encloses a volume.
    """
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
    """A factored symmetric positive definite sparse matrix: factored once, for many right-hand
    sides; for few of them see `factored`."""

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
        """Return the solution (V, C) for right-hand sides (V, C)."""
        solution = np.zeros((self._size, right.shape[1]))
        wide = 64  # cholespy takes up to 128 columns at a time
        for first in range(0, right.shape[1], wide):
            part = np.ascontiguousarray(right[:, first : first + wide], dtype=np.float64)
            out = np.zeros_like(part)
            self._solver.solve(part, out)
            solution[:, first : first + wide] = out
        return solution


def factored(matrix: Any) -> Any:
    """Factor a symmetric positive definite sparse matrix (V, V) for few right-hand sides.

    Returns scipy's `SuperLU`, whose ``solve`` takes (V,) or (V, k) float64. Meshes of a person are
    factored in less than half the time of `Cholesky`; a solution takes up to three times as long.
    """
    from scipy.sparse.linalg import splu

    return splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def border_edges(faces: IntArray) -> IntArray:
    """Return the directed edges (n, 2) of faces (F, 3) that belong to only one face."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    base = int(faces.max()) + 1
    forward, backward = edges[:, 0] * base + edges[:, 1], edges[:, 1] * base + edges[:, 0]
    return np.asarray(edges[~np.isin(forward, backward)])


def border_loops(faces: IntArray) -> list[IntArray]:
    """Return the border loops of faces (F, 3) as ordered vertices, longest first.

    Each corner of a border must be passed only once.
    """
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
