"""A hole cut into a surface where a patch lies over it, and the two sewn together."""

from __future__ import annotations

import numpy as np

from a2v.geometry.mesh import border_loops
from a2v.reconstruction.face.patch import Patch, single_rim
from a2v.types import BoolArray, FloatArray, IntArray, Surface

_REACH = 0.06
"""What lies farther from the patch, metres, stays."""
_GAP = 0.004
"""Cloth of the seam between rim and hole: so wide at least, metres."""


def cut_and_sew(
    surface: Surface, bent: FloatArray, body_faces: IntArray, patch: Patch
) -> tuple[FloatArray | None, IntArray, IntArray, IntArray]:
    """Cut the surface open under the patch, and sew the patch in.

    Parameters
    ----------
    surface : Surface
    bent : (13854, 3)
        Where the body's vertices and teeth lie.
    body_faces : (F, 3) int
    patch : Patch

    Returns
    -------
    vertices : (N, 3), or None where the hole has no single rim
        First what is kept of the surface, then the patch.
    faces : (M, 3)
    kept : (n,) int
        Vertices of the surface that are kept.
    own : (K,) int
        Places of the patch's vertices.
    """
    vertices, faces = surface.vertices.astype(np.float64), surface.faces.astype(np.int64)
    covered = _covered(vertices, bent, body_faces, patch)
    staying = single_rim(faces, ~covered[faces].any(axis=1))
    kept = np.unique(faces[staying])
    nothing = None, faces, kept, np.zeros(0, np.int64)
    loops = border_loops(faces[staying])
    if not loops or len(loops[0]) < 12 or len(loops) > 1:
        return nothing
    place = np.full(len(vertices), -1)
    place[kept] = np.arange(len(kept))
    rim = len(kept) + patch.rim
    every = np.concatenate([vertices[kept], bent[patch.vertices]])
    strip = sew(every, place[loops[0]][::-1], rim)
    made = np.concatenate([place[faces[staying]], strip, len(kept) + patch.faces])
    return every, made, kept, len(kept) + np.arange(len(patch.vertices))


def _covered(vertices: FloatArray, bent: FloatArray, body_faces: IntArray, patch: Patch) -> BoolArray:
    """Which vertices (V,) of a surface lie at the patch: the nearest of the body's visible front is of it, or of what borders on it."""
    from scipy.spatial import cKDTree

    from a2v.geometry.rays import ray_scene

    near = cKDTree(bent[patch.vertices[patch.kinds == 0]]).query(vertices, distance_upper_bound=_REACH)[0]
    ids = np.flatnonzero(np.isfinite(near))
    front = np.union1d(patch.front, np.flatnonzero(patch.within & np.isin(np.arange(len(body_faces)), patch.front)))
    found = ray_scene(bent, body_faces[front]).compute_closest_points(vertices[ids].astype(np.float32))
    on = front[found["primitive_ids"].numpy()]
    rim = bent[patch.vertices[patch.rim]]
    to_rim = cKDTree(rim).query(vertices[ids])[0]
    covered = np.zeros(len(vertices), bool)
    covered[ids] = patch.within[on] | (to_rim < _GAP)
    return covered


def sew(vertices: FloatArray, outer: IntArray, inner: IntArray) -> IntArray:
    """Triangles (n + m, 3) between two loops around the same hole: the shortest way in all (Fuchs, Kedem and Uselton 1977).

    Parameters
    ----------
    vertices : (V, 3)
    outer, inner : (n,), (m,) int
        Both running the same way round.
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
