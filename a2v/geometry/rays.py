"""Rays and closest points of one mesh (Embree by open3d)."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from a2v.geometry.mesh import face_normals
from a2v.geometry.vectors import unit
from a2v.system import thread_count
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera


def facing(normals: FloatArray, side: int) -> FloatArray:
    """Tilt unit normals (n, 3) that point away from the camera at +z (`side` 1) or -z (-1) to the
    rim.

    Interpolated normals of visible points can point away.
    """
    normals = unit(normals, least=1e-9)
    normals[:, 2] = side * np.maximum(side * normals[:, 2], 0)
    return unit(normals, least=1e-9)


@dataclass(frozen=True, eq=False)
class Hits:
    """Where rays met a mesh. The entries of rays that met nothing are undefined."""

    hit: BoolArray
    distance: FloatArray
    face: IntArray
    barycentric: FloatArray

    def interpolate(self, values: FloatArray, faces: IntArray) -> FloatArray:
        """Interpolate values (V, C) of vertices at the hits, (n, C) float32, for the rays that
        hit."""
        corners = np.asarray(values, np.float32)[faces[self.face[self.hit]]]
        return at_barycentric(corners, self.barycentric[self.hit]).astype(np.float32)


def at_barycentric(corners: FloatArray, barycentric: FloatArray) -> FloatArray:
    """Interpolate corner values (n, 3, C) by Embree's barycentric coordinates (n, 2); (n, C)."""
    u, v = barycentric[:, :1], barycentric[:, 1:]
    mixed: FloatArray = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    return mixed


_PLOTTING = "open3d.visualization.draw_plotly"
"""Module of open3d that draws in a web page. It imports Dash and Plotly and is not needed here."""


def load_open3d() -> Any:
    """Return the module `open3d`, imported without Dash, Flask and Plotly.

    That saves more than half of the import's processor time.
    """
    if "open3d" not in sys.modules:
        empty: Any = ModuleType(_PLOTTING)
        empty.get_plotly_fig = empty.draw_plotly = empty.draw_plotly_server = None
        sys.modules.setdefault(_PLOTTING, empty)
    import open3d

    return open3d


def ray_scene(vertices: FloatArray, faces: IntArray, *, threads: int = 1) -> Any:
    """Build Open3D's ray casting scene (Embree) of one mesh on `threads` threads (0: all cores).

    The mesh is given by vertices (V, 3), meters, and faces (F, 3). The scene takes float32 arrays:
    rays (..., 6), each an origin and a direction, or points (..., 3).
    """
    scene: Any = load_open3d().t.geometry.RaycastingScene(nthreads=threads)
    scene.add_triangles(
        np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.uint32)
    )
    return scene


class RayScene:
    """Embree (by open3d): rays, shadows and closest points of one mesh.

    Queries run on `a2v.system.thread_count` threads. Each is independent of the others, so the
    number of threads does not change any result.
    """

    def __init__(self, vertices: FloatArray, faces: IntArray):
        """`vertices` (V, 3), `faces` (F, 3)."""
        self.vertices, self.faces = vertices, faces
        self._threads = thread_count()
        self._scene = ray_scene(vertices, faces)

    def _rays(self, origins: FloatArray, directions: FloatArray) -> FloatArray:
        rays = np.empty((len(origins), 6), np.float32)
        rays[:, :3], rays[:, 3:] = origins, directions
        return rays

    def cast(self, origins: FloatArray, directions: FloatArray) -> Hits:
        """First hits of rays from `origins` (n, 3) along `directions` (n, 3) or (3,)."""
        found = self._scene.cast_rays(self._rays(origins, directions), nthreads=self._threads)
        distance = found["t_hit"].numpy()
        return Hits(
            np.isfinite(distance),
            distance,
            found["primitive_ids"].numpy().astype(np.int64),
            found["primitive_uvs"].numpy(),
        )

    def occluded(self, origins: FloatArray, directions: FloatArray) -> BoolArray:
        """Return whether rays (n,) meet anything."""
        return np.asarray(
            self._scene.test_occlusions(
                self._rays(origins, directions), nthreads=self._threads
            ).numpy()
        )

    def crossings(self, points: FloatArray, normals: FloatArray) -> IntArray:
        """Return winding numbers (N,) of points (N, 3) about a closed mesh with face normals (F,
        3).

        They are the exits minus the entries along one ray.
        """
        direction = np.array([0.0123, 0.0345, 1.0]) / np.linalg.norm(
            [0.0123, 0.0345, 1.0]
        )  # a direction along no usual edge
        found = self._scene.list_intersections(
            self._rays(points, direction), nthreads=self._threads
        )
        ray, face = (
            found["ray_ids"].numpy().astype(np.int64),
            found["primitive_ids"].numpy().astype(np.int64),
        )
        return np.asarray(
            np.rint(np.bincount(ray, np.sign(normals[face] @ direction), len(points))), np.int64
        )

    def passages(
        self, origins: FloatArray, directions: FloatArray, normals: FloatArray
    ) -> tuple[IntArray, FloatArray, BoolArray]:
        """Return all hits of rays with faces of normals (F, 3), in no particular order.

        The result is the number (h,) of the ray, the distance (h,) along it, and whether it enters
        (h,).
        """
        rays = self._rays(origins, directions)
        found = self._scene.list_intersections(rays, nthreads=self._threads)
        ray, face = (
            found["ray_ids"].numpy().astype(np.int64),
            found["primitive_ids"].numpy().astype(np.int64),
        )
        entering = (normals[face] * rays[ray, 3:]).sum(axis=1) < 0
        return ray, found["t_hit"].numpy(), np.asarray(entering)

    def closest(self, points: FloatArray) -> Hits:
        """Closest points of the mesh to `points` (n, 3)."""
        found = self._scene.compute_closest_points(
            np.ascontiguousarray(points, np.float32), nthreads=self._threads
        )
        distance = np.linalg.norm(points - found["points"].numpy(), axis=1)
        face, uv = found["primitive_ids"].numpy().astype(np.int64), found["primitive_uvs"].numpy()
        return Hits(np.ones(len(points), bool), distance, face, uv)


def signed_distance_and_normals(
    vertices: FloatArray, faces: IntArray, normals: FloatArray, scene: RayScene, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the signed distance (N,) float32 of points (N, 3) to a closed mesh, and its unit
    normal (N, 3) at the closest point.

    Parameters
    ----------
    vertices, faces, normals
        The mesh; normals (V, 3) of its vertices, which are interpolated.
    scene : RayScene
        Scene of the same mesh.
    """
    order = coherent(points)
    closest = scene.closest(points[order])
    distance, normal = np.empty(len(points), np.float32), np.empty((len(points), 3), np.float32)
    distance[order], normal[order] = closest.distance, closest.interpolate(normals, faces)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    # the mesh is closed, so this is exact, and five times as fast as `winding_number`
    inside = scene.crossings(points, face_normals(vertices, faces)) > 0
    return np.where(inside, -distance, distance), normal


def coherent(points: FloatArray, cell: float = 0.03) -> IntArray:
    """Return an order (N,) in which neighboring points follow each other, so that searches use the
    caches well."""
    return np.asarray(np.lexsort(np.floor(points / cell).T))


@dataclass(frozen=True, eq=False)
class SideView:
    """Hits of a mesh seen from the front, or through it from the back, on square pixels.

    `hits` has one ray per pixel, row by row. Depth (H, W) is in meters, NaN outside; unit normals
    (H, W, 3) are zero outside.
    """

    hits: Hits
    depth: FloatArray
    normals: FloatArray


def pixel_rays(camera: OrthographicCamera, pixels: FloatArray, z: float) -> FloatArray:
    """Return the origins (n, 3) of parallel rays through pixels (n, 2) of the photo, at depth
    `z`."""
    return np.asarray(camera.unproject(pixels, z), np.float32)


def side_view(
    rays: RayScene,
    normals: FloatArray,
    camera: OrthographicCamera,
    frame: int,
    size: int,
    side: int,
) -> SideView:
    """Rasterize the mesh of `rays`, with normals (V, 3) of its vertices, on `size` x `size` pixels.

    They cover the `frame` x `frame` pixels of `camera`. `side` 1 is the view from the front, -1 the
    view of the back on the same pixels.
    """
    vertices, step = rays.vertices, frame / size
    grid = (np.arange(size) + 0.5) * step
    corner = camera.project(vertices)
    low, high = (
        np.floor(corner.min(axis=0) / step).astype(int) - 1,
        np.ceil(corner.max(axis=0) / step).astype(int) + 1,
    )
    columns, rows = (
        np.arange(max(0, low[0]), min(size, high[0])),
        np.arange(max(0, low[1]), min(size, high[1])),
    )
    pixels = np.stack(np.meshgrid(grid[columns], grid[rows]), axis=-1).reshape(-1, 2)
    index = (rows[:, None] * size + columns[None]).ravel()
    far = side * (float(np.abs(vertices[:, 2]).max()) + 1)
    some = rays.cast(pixel_rays(camera, pixels, far), np.array([0, 0, -side], np.float32))
    whole = size * size
    hits = scattered(some, index, whole)
    hit = hits.hit
    normal = np.zeros((whole, 3), np.float32)
    normal[hit] = facing(hits.interpolate(normals, rays.faces), side)
    depth = np.where(hit, far - side * hits.distance, np.nan).astype(np.float32)
    return SideView(hits, depth.reshape(size, size), normal.reshape(size, size, 3))


def scattered(hits: Hits, index: IntArray, count: int) -> Hits:
    """Return hits of `count` rays: these hits at the places `index`, and nothing at the others."""
    hit, distance = np.zeros(count, bool), np.full(count, np.inf, np.float32)
    face, uv = np.zeros(count, np.int64), np.zeros((count, 2), np.float32)
    hit[index], distance[index], face[index], uv[index] = (
        hits.hit,
        hits.distance,
        hits.face,
        hits.barycentric,
    )
    return Hits(hit, distance, face, uv)


def texels(texel: FloatArray, size: int) -> tuple[IntArray, FloatArray]:
    """Find the face and the barycentric coordinates under each texel's center, by rays onto the
    flattened mesh.

    Parameters
    ----------
    texel : (F, 3, 2)
        Corners in texels, v growing upwards.

    Returns
    -------
    face (size, size) int32, -1 for none, and barycentric coordinates (size, size, 3) float32; row 0
    is the top.
    """
    flat = np.concatenate([texel.reshape(-1, 2), np.zeros((texel.shape[0] * 3, 1))], axis=1)
    scene = ray_scene(flat, np.arange(len(flat)).reshape(-1, 3), threads=0)
    face = np.empty((size, size), np.int32)
    barycentric = np.empty((size, size, 3), np.float32)
    high = 256  # rows at a time, to bound memory
    rays = np.zeros((min(high, size), size, 6), np.float32)
    rays[..., 0], rays[..., 2], rays[..., 5] = np.arange(size) + 0.5, 1.0, -1.0
    for top in range(0, size, high):
        rows = slice(top, min(size, top + high))
        block = rays[: rows.stop - top]
        block[..., 1] = (size - np.arange(top, rows.stop) - 0.5)[:, None]
        hits = scene.cast_rays(block)
        face[rows] = hits["primitive_ids"].numpy().view(np.int32)  # the id of no face becomes -1
        uv = hits["primitive_uvs"].numpy()
        barycentric[rows, :, 1:] = uv
        barycentric[rows, :, 0] = 1 - (uv[..., 0] + uv[..., 1])
    barycentric[face < 0] = 0.0
    return face, barycentric
