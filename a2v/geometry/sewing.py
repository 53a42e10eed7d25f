"""Mesh pieces with a single rim, and sewing of rims."""

from __future__ import annotations

import numpy as np

from a2v.geometry.mesh import border_edges
from a2v.types import BoolArray, FloatArray, IntArray


def single_rim(faces: IntArray, own: BoolArray) -> BoolArray:
    """Return the faces (F,) bool of the largest piece of the `own` ones, trimmed to a single rim.

    Faces that are attached by only one edge and corners where the border touches itself are
    removed.
    """
    own = own.copy()
    base = int(faces.max()) + 1
    for _ in range(60):
        own = largest_piece(faces, own)
        chosen = np.flatnonzero(own)
        kept = faces[chosen]
        ends = border_edges(kept)
        vertices, count = np.unique(ends[:, 0], return_counts=True)
        free = sum(
            np.isin(kept[:, a] * base + kept[:, b], ends[:, 0] * base + ends[:, 1]).astype(int)
            for a, b in ((0, 1), (1, 2), (2, 0))
        )
        bad = (free >= 2) | np.isin(kept, vertices[count > 1]).any(axis=1)
        if not bad.any():
            return own
        own[chosen[bad]] = False
    return own


def largest_piece(faces: IntArray, own: BoolArray) -> BoolArray:
    """Return the faces (F,) bool of the largest edge-connected piece among the `own` ones (F,)
    bool."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    chosen = np.flatnonzero(own)
    edges = np.sort(faces[chosen][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, key = np.unique(
        edges[:, 0].astype(np.int64) * (int(faces.max()) + 1) + edges[:, 1], return_inverse=True
    )
    owner = np.repeat(np.arange(len(chosen)), 3)
    graph = sp.coo_matrix(
        (np.ones(len(key)), (owner, key)), shape=(len(chosen), int(key.max()) + 1)
    ).tocsr()
    _, label = connected_components(graph @ graph.T, directed=False)
    kept = np.zeros(len(own), bool)
    kept[chosen[label == np.bincount(label).argmax()]] = True
    return kept


def sew(vertices: FloatArray, outer: IntArray, inner: IntArray) -> IntArray:
    """Triangulate the strip between two loops around the same hole: (n + m, 3) of least total edge
    length (Fuchs, Kedem and Uselton 1977).

    Parameters
    ----------
    vertices : (V, 3)
    outer, inner : (n,), (m,) int
        Both in the same direction.
    """
    start = np.linalg.norm(vertices[outer][:, None] - vertices[inner][None], axis=-1)
    first, second = np.unravel_index(int(start.argmin()), start.shape)
    a, b = np.roll(outer, -first), np.roll(inner, -second)
    a, b = np.append(a, a[0]), np.append(b, b[0])
    length = np.linalg.norm(vertices[a][:, None] - vertices[b][None], axis=-1)
    n, m = length.shape
    cost = np.full((n, m), np.inf)
    cost[0, 0] = 0
    for i in range(n):
        for j in range(m):
            if i:
                cost[i, j] = min(cost[i, j], cost[i - 1, j] + length[i, j])
            if j:
                cost[i, j] = min(cost[i, j], cost[i, j - 1] + length[i, j])
    strip: list[tuple[int, int, int]] = []
    i, j = n - 1, m - 1
    while i or j:
        if i and (not j or cost[i - 1, j] <= cost[i, j - 1]):
            strip.append((a[i - 1], a[i], b[j]))
            i -= 1
        else:
            strip.append((a[i], b[j], b[j - 1]))
            j -= 1
    return np.array(strip, dtype=np.int64)


def sew_in(
    vertices: FloatArray,
    staying: IntArray,
    hole: IntArray,
    patch: FloatArray,
    patch_faces: IntArray,
    rim: IntArray,
) -> tuple[FloatArray, IntArray, IntArray]:
    """Sew a patch into the hole of a surface.

    Parameters
    ----------
    vertices : (V, 3)
        Of the surface.
    staying : (F, 3) int
        Its faces that are kept.
    hole : (n,) int
        Their border, as `border_loops` gives it.
    patch : (K, 3)
        Vertices of the patch.
    patch_faces : (G, 3) int
        Into `patch`.
    rim : (m,) int
        Into `patch`, in order: its border.

    Returns
    -------
    vertices : (N, 3)
        The kept vertices of the surface, then the patch's.
    faces : (M, 3) int
    kept : (n,) int
        Vertices of the surface that are kept.
    """
    kept = np.unique(staying)
    place = np.full(len(vertices), -1)
    place[kept] = np.arange(len(kept))
    every = np.concatenate([vertices[kept], patch])
    strip = sew(every, place[hole][::-1], len(kept) + rim)
    return every, np.concatenate([place[staying], strip, len(kept) + patch_faces]), kept
