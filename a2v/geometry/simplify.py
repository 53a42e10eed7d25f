"""Mesh simplification: edges collapse onto one of their ends, in the order of the quadric error
(Garland and Heckbert, SIGGRAPH 1997).

Every remaining vertex is one of the given ones at its given position. So its attributes (weights,
expressions, twin) stay exact, and touching lips stay separate. Corners on the borders of texture
charts stay in their charts: a seam collapses only along itself, and both sides together.
(pymeshlab's decimation with a texture moves vertices to new positions, which have no weights, and
takes five times as long.)
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.geometry.compiled import compiled
from a2v.types import BoolArray, FloatArray, IntArray

_BORDER = 10.0
"""Weight of the planes through borders and seams, perpendicular to their faces, relative to the
faces' planes."""
_FLIP = 0.2
"""A face counts as flipped if the cosine between its normals before and after a collapse is below
this."""
_LEAST_SHAPE = 0.05
"""Smallest shape of a triangle (1: equilateral) after a collapse, unless it was worse before."""


@dataclass(frozen=True, eq=False)
class Simplified:
    """A subset of a mesh's vertices with new faces.

    Attributes
    ----------
    kept : (K,) int
        The remaining vertices, ascending.
    faces : (F, 3) int32
        Into `kept`.
    corners : (F, 3) int
        For each corner, the corner of the given mesh (3 * face + corner) with its texture
        coordinates.
    origin : (F,) int
        Index of each face in the given mesh.
    """

    kept: IntArray
    faces: IntArray
    corners: IntArray
    origin: IntArray


def simplify(
    vertices: FloatArray,
    faces: IntArray,
    target: int,
    *,
    uv: FloatArray | None = None,
    importance: FloatArray | None = None,
    locked: BoolArray | None = None,
) -> Simplified:
    """Collapse edges until `target` faces remain, or no edge can collapse.

    Parameters
    ----------
    vertices : (V, 3)
        Meters.
    faces : (F, 3)
    target : int
        Number of faces.
    uv : (F, 3, 2), optional
        Texture coordinates of corners.
    importance : (V,), optional
        Weight of the error around each vertex; default 1.
    locked : (V,) bool, optional
        Vertices that are kept.

    Raises
    ------
    InputError
        `target` is less than four.
    """
    if target < 4:
        raise InputError(f"cannot simplify to {target} triangles; expected at least 4")
    points, tri = (
        np.ascontiguousarray(vertices, np.float64),
        np.ascontiguousarray(faces, np.int64).copy(),
    )
    count = len(points)
    weight = np.ones(count) if importance is None else np.ascontiguousarray(importance, np.float64)
    wedge = _wedges(tri, uv)
    stay = np.zeros(count, bool) if locked is None else np.asarray(locked, bool).copy()
    corners = np.arange(3 * len(tri)).reshape(-1, 3)
    sharp = _sharp_edges(tri, wedge)
    quadrics = _quadrics(points, tri, weight, sharp)
    alive = np.ones(len(tri), bool)
    compiled(_collapse)(
        points, tri, wedge, corners, quadrics, stay, alive, target, _FLIP, _LEAST_SHAPE
    )
    kept, index = np.unique(tri[alive], return_inverse=True)
    return Simplified(
        kept, index.reshape(-1, 3).astype(np.int32), corners[alive], np.flatnonzero(alive)
    )


def _wedges(faces: IntArray, uv: FloatArray | None) -> IntArray:
    """Number the different pairs of vertex and texture coordinates: return the number (F, 3) of
    each corner.
    """
    if uv is None:
        return faces.copy()
    rows = np.concatenate(
        [faces.reshape(-1, 1), np.ascontiguousarray(uv.reshape(-1, 2), np.float32).view(np.int32)],
        axis=1,
    )
    _, number = np.unique(rows, axis=0, return_inverse=True)
    return np.asarray(number).reshape(-1, 3).astype(np.int64)


def _sharp_edges(faces: IntArray, wedge: IntArray) -> IntArray:
    """Return edges (n, 3), as (face, first corner, second corner), that only one face has: borders
    and sides of seams."""
    ends = np.stack([wedge, np.roll(wedge, -1, axis=1)], axis=-1).reshape(-1, 2)
    base = int(wedge.max()) + 1
    forward, backward = ends[:, 0] * base + ends[:, 1], ends[:, 1] * base + ends[:, 0]
    alone = np.flatnonzero(~np.isin(forward, backward))
    return np.stack([alone // 3, alone % 3, (alone + 1) % 3], axis=1)


def _quadrics(
    points: FloatArray, faces: IntArray, weight: FloatArray, sharp: IntArray
) -> FloatArray:
    """Sum, for each vertex, the area-weighted quadrics of its faces' planes and of the planes
    through sharp edges, (V, 10)."""
    corner = points[faces]
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(cross, axis=1)
    normal = cross / np.maximum(area, 1e-20)[:, None]
    total = np.zeros((len(points), 10))
    planes = _plane(normal, corner[:, 0]) * area[:, None]
    for column in range(3):
        np.add.at(total, faces[:, column], planes)
    first, second = (points[faces[sharp[:, 0], sharp[:, column]]] for column in (1, 2))
    along = second - first
    across = np.cross(along, normal[sharp[:, 0]])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-20)
    walls = _plane(across, first) * (_BORDER * (along**2).sum(axis=1))[:, None]
    for column in (1, 2):
        np.add.at(total, faces[sharp[:, 0], sharp[:, column]], walls)
    return np.asarray(total * weight[:, None])


def _plane(normal: FloatArray, point: FloatArray) -> FloatArray:
    """Return the quadrics (N, 10) of planes: the upper half of the symmetric matrix of (normal,
    offset)."""
    row = np.concatenate([normal, -(normal * point).sum(axis=1, keepdims=True)], axis=1)
    first, second = np.triu_indices(4)
    return np.asarray(row[:, first] * row[:, second])


def _collapse(points, tri, wedge, corners, quadrics, stay, alive, target, flip, least):  # type: ignore[no-untyped-def]  # compiled by numba
    """Collapse edges of `tri` (F, 3) in place, with `wedge`, `corners` (F, 3) and `alive` (F,).
    Plain loops for numba."""
    count, faces = len(points), len(tri)
    # linked lists of the corners around each vertex, joined when vertices merge
    following, first, last = np.full(3 * faces, -1), np.full(count, -1), np.full(count, -1)
    for c in range(3 * faces):
        v = tri[c // 3, c % 3]
        if first[v] < 0:
            first[v] = c
        else:
            following[last[v]] = c
        last[v] = c
    stamp = np.zeros(count, np.int64)
    mark = np.full(count, -1, np.int64)
    turn = 0
    heap = [(0.0, 0, 0, np.int64(0))]
    heap.pop()

    def error(u, v):  # type: ignore[no-untyped-def]
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        return max(
            0.0,
            quadrics[u, 0] * x * x
            + 2 * quadrics[u, 1] * x * y
            + 2 * quadrics[u, 2] * x * z
            + 2 * quadrics[u, 3] * x
            + quadrics[u, 4] * y * y
            + 2 * quadrics[u, 5] * y * z
            + 2 * quadrics[u, 6] * y
            + quadrics[u, 7] * z * z
            + 2 * quadrics[u, 8] * z
            + quadrics[u, 9],
        )

    def gap(u, v):  # type: ignore[no-untyped-def]
        x, y, z = (
            points[u, 0] - points[v, 0],
            points[u, 1] - points[v, 1],
            points[u, 2] - points[v, 2],
        )
        return 1e-14 * (x * x + y * y + z * z)

    def shape(a, b, c):  # type: ignore[no-untyped-def]
        ex, ey, ez = (
            points[b, 0] - points[a, 0],
            points[b, 1] - points[a, 1],
            points[b, 2] - points[a, 2],
        )
        fx, fy, fz = (
            points[c, 0] - points[a, 0],
            points[c, 1] - points[a, 1],
            points[c, 2] - points[a, 2],
        )
        gx, gy, gz = fx - ex, fy - ey, fz - ez
        nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
        area = np.sqrt(nx * nx + ny * ny + nz * nz)
        round_ = (
            3.4641
            * area
            / (
                ex * ex
                + ey * ey
                + ez * ez
                + fx * fx
                + fy * fy
                + fz * fz
                + gx * gx
                + gy * gy
                + gz * gz
                + 1e-30
            )
        )
        return nx, ny, nz, area, round_

    for f in range(faces):
        for k in range(3):
            u, v = tri[f, k], tri[f, (k + 1) % 3]
            if not stay[u]:
                heap.append((error(u, v) + gap(u, v), u, v, np.int64(0)))  # type: ignore[no-untyped-call]
            if not stay[v]:
                heap.append((error(v, u) + gap(u, v), v, u, np.int64(0)))  # type: ignore[no-untyped-call]
    heapq.heapify(heap)
    left = faces
    while left > target and len(heap) > 0:
        _, u, v, when = heapq.heappop(heap)
        if when != stamp[u] + stamp[v] or first[u] < 0 or first[v] < 0:
            continue
        # the faces of the edge, and the new wedges of u's wedges
        between, shared = 0, 0
        before, after = np.full(4, -1), np.full(4, -1)
        good, others = True, 0
        turn += 1
        c = first[v]
        while c >= 0:
            f = c // 3
            if alive[f]:
                for k in range(3):
                    mark[tri[f, k]] = turn
            c = following[c]
        mark[u], mark[v] = -1, -1
        c = first[u]
        while c >= 0 and good:
            f, k = c // 3, c % 3
            if alive[f]:
                at = -1
                for j in range(3):
                    if tri[f, j] == v:
                        at = j
                if at >= 0:
                    between += 1
                    slot = -1
                    for s in range(others):
                        if before[s] == wedge[f, k]:
                            slot = s
                    if slot < 0:
                        if others == 4:
                            good = False
                        else:
                            before[others], after[others] = wedge[f, k], wedge[f, at]
                            others += 1
                    elif after[slot] != wedge[f, at]:
                        good = False
            c = following[c]
        if not good or between == 0 or between > 2:
            continue
        # common neighbors of both must be those of the edge's faces, and each wedge of u needs a
        # new one
        turn += 1
        c = first[u]
        used = 0
        while c >= 0 and good:
            f, k = c // 3, c % 3
            if alive[f]:
                has = False
                for j in range(3):
                    w = tri[f, j]
                    if w == v:
                        has = True
                    if w != u and w != v and mark[w] == turn - 1:
                        mark[w] = turn
                        shared += 1
                known = False
                for s in range(others):
                    if before[s] == wedge[f, k]:
                        known = True
                if not known:
                    good = False
                if not has:
                    used += 1
                    a, b, d = tri[f, 0], tri[f, 1], tri[f, 2]
                    x0, y0, z0, area0, shape0 = shape(a, b, d)  # type: ignore[no-untyped-call]
                    x1, y1, z1, area1, shape1 = shape(
                        v if k == 0 else a, v if k == 1 else b, v if k == 2 else d
                    )  # type: ignore[no-untyped-call]
                    if x0 * x1 + y0 * y1 + z0 * z1 < flip * area0 * area1 or (
                        shape1 < least and shape1 < shape0
                    ):
                        good = False
            c = following[c]
        if not good or shared != between or used == 0:
            continue
        # a border collapses only along itself; inside, u has as many faces as neighbors
        turn += 1
        ring, own = 0, 0
        c = first[u]
        while c >= 0:
            f = c // 3
            if alive[f]:
                own += 1
                for j in range(3):
                    w = tri[f, j]
                    if w != u and mark[w] != turn:
                        mark[w] = turn
                        ring += 1
            c = following[c]
        if ring != own and between != 1:
            continue
        if ring == own and between != 2:
            continue
        c = first[u]
        while c >= 0:
            f, k = c // 3, c % 3
            if alive[f]:
                has = False
                for j in range(3):
                    if tri[f, j] == v:
                        has = True
                if has:
                    alive[f] = False
                    left -= 1
                else:
                    tri[f, k] = v
                    for s in range(others):
                        if before[s] == wedge[f, k]:
                            # the corner of v with this wedge
                            g = first[v]
                            while g >= 0:
                                if wedge[g // 3, g % 3] == after[s] and tri[g // 3, g % 3] == v:
                                    corners[f, k] = corners[g // 3, g % 3]
                                    break
                                g = following[g]
                            wedge[f, k] = after[s]
                            break
            c = following[c]
        following[last[v]] = first[u]
        last[v] = last[u]
        first[u] = -1
        for j in range(10):
            quadrics[v, j] += quadrics[u, j]
        stamp[v] += 1
        c = first[v]
        while c >= 0:
            f = c // 3
            if alive[f]:
                for j in range(3):
                    w = tri[f, j]
                    if w != v:
                        if not stay[v]:
                            cost = error(v, w) + gap(v, w)  # type: ignore[no-untyped-call]
                            heapq.heappush(heap, (cost, v, w, stamp[v] + stamp[w]))
                        if not stay[w]:
                            cost = error(w, v) + gap(v, w)  # type: ignore[no-untyped-call]
                            heapq.heappush(heap, (cost, w, v, stamp[v] + stamp[w]))
            c = following[c]
    return left
