"""What the photo's camera sees of a surface: ray casting (Embree through Open3D)."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera


def raycasting_scene(vertices: FloatArray, faces: IntArray) -> Any:
    """An Open3D ray casting scene of one triangle mesh: vertices (V, 3) metres, faces (F, 3)."""
    import open3d as o3d

    scene: Any = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.uint32))
    return scene


def cast_depth(scene: Any, x: FloatArray, y: FloatArray, front: float) -> FloatArray:
    """The z of the first hit from the camera's side at points (x, y) metres (any shape); -inf where nothing is hit.

    `front` is a z in front of everything: the photo's camera is on +z and looks down -z.
    """
    rays = np.empty((*x.shape, 6), np.float32)
    rays[..., 0], rays[..., 1], rays[..., 2] = x, y, front
    rays[..., 3:] = (0, 0, -1)
    distance = scene.cast_rays(rays)["t_hit"].numpy()
    return np.where(np.isfinite(distance), front - distance, -np.inf).astype(np.float32)


def depth_map(vertices: FloatArray, faces: IntArray, camera: OrthographicCamera, size: tuple[int, int]) -> FloatArray:
    """Front depth (H, W) float32, metres, at the centres of the photo's pixels; -inf where the surface is not.

    `size` is the crop's (width, height).
    """
    columns, rows = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    points = camera.unproject(np.stack([columns, rows], axis=-1), 0.0)
    scene = raycasting_scene(vertices, faces)
    return cast_depth(scene, points[..., 0], points[..., 1], float(np.max(vertices[:, 2])) + 1.0)


def visible_vertices(vertices: FloatArray, faces: IntArray, *, tolerance: float = 0.002) -> BoolArray:
    """Whether the camera on +z sees each vertex (V,): nothing lies more than `tolerance` metres before it, and it faces the camera."""
    scene = raycasting_scene(vertices, faces)
    depth = cast_depth(scene, vertices[:, 0], vertices[:, 1], float(vertices[:, 2].max()) + 1.0)
    near = ~np.isfinite(depth) | (depth <= vertices[:, 2] + tolerance)
    return near & (vertex_normals(vertices, faces)[:, 2] > 0)


def silhouette_iou(vertices: FloatArray, faces: IntArray, camera: OrthographicCamera, mask: FloatArray) -> float:
    """Intersection over union of the surface's silhouette in the photo and ``mask > 0.5`` (H, W)."""
    seen = np.isfinite(depth_map(vertices, faces, camera, (mask.shape[1], mask.shape[0])))
    person = mask > 0.5
    union = int((seen | person).sum())
    if union == 0:
        raise InputError("neither the surface nor the mask covers a pixel; is this the surface's own camera?")
    return float((seen & person).sum() / union)


def person_box(vertices: FloatArray, person: BoolArray, camera: OrthographicCamera) -> FloatArray:
    """Least and largest corner (2, 3) of the box that holds a body's vertices (V, 3) and, in x and y, a mask (H, W) of `camera`; metres."""
    rows, columns = np.nonzero(person)
    corners = camera.unproject(np.array([[columns.min(), rows.max() + 1], [columns.max() + 1, rows.min()]], np.float64), 0.0)
    low = np.minimum(vertices.min(axis=0), [*corners[0, :2], np.inf])
    high = np.maximum(vertices.max(axis=0), [*corners[1, :2], -np.inf])
    return np.stack([low, high])


def contour_distance(person: BoolArray) -> FloatArray:
    """Signed distance (H, W) to the contour of a binary map, which runs between the pixels; pixels, negative inside."""
    import cv2

    out = cv2.distanceTransform((~person).astype(np.uint8), cv2.DIST_L2, 5)
    into = cv2.distanceTransform(person.astype(np.uint8), cv2.DIST_L2, 5)
    return np.where(person, 0.5 - into, out - 0.5)


def vertex_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Area-weighted unit normals (V, 3) float64."""
    corners = np.asarray(vertices, np.float64)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.stack([np.bincount(faces.ravel(), np.repeat(normals[:, axis], 3), minlength=len(vertices)) for axis in range(3)], axis=1)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20))
