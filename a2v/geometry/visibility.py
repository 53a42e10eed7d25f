"""Visibility of a surface from the photo's camera, by ray casting (Embree through Open3D)."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import ray_scene
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera


def cast_depth(scene: Any, x: FloatArray, y: FloatArray, front: float) -> FloatArray:
    """Return the z of the first hit from the camera's side at points (x, y), meters; -inf if
    nothing is hit.

    `x` and `y` may have any shape. `front` is a z in front of everything: the photo's camera is on
    +z and looks down -z.
    """
    rays = np.empty((*x.shape, 6), np.float32)
    rays[..., 0], rays[..., 1], rays[..., 2] = x, y, front
    rays[..., 3:] = (0, 0, -1)
    distance = scene.cast_rays(rays)["t_hit"].numpy()
    return np.where(np.isfinite(distance), front - distance, -np.inf).astype(np.float32)


def depth_map(
    vertices: FloatArray, faces: IntArray, camera: OrthographicCamera, size: tuple[int, int]
) -> FloatArray:
    """Return the front depth (H, W) float32, meters, at the centers of the photo's pixels; -inf
    outside the surface.

    `size` is the crop's (width, height).
    """
    columns, rows = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    points = camera.unproject(np.stack([columns, rows], axis=-1), 0.0)
    scene = ray_scene(vertices, faces, threads=0)
    return cast_depth(scene, points[..., 0], points[..., 1], float(np.max(vertices[:, 2])) + 1.0)


def visible_vertices(
    vertices: FloatArray, faces: IntArray, *, tolerance: float = 0.002
) -> BoolArray:
    """Return whether the camera on +z sees each vertex (V,).

    A vertex is visible if it faces the camera and no surface is more than `tolerance` meters in
    front of it.
    """
    scene = ray_scene(vertices, faces, threads=0)
    depth = cast_depth(scene, vertices[:, 0], vertices[:, 1], float(vertices[:, 2].max()) + 1.0)
    near = ~np.isfinite(depth) | (depth <= vertices[:, 2] + tolerance)
    return near & (vertex_normals(vertices, faces)[:, 2] > 0)


def silhouette_iou(
    vertices: FloatArray, faces: IntArray, camera: OrthographicCamera, mask: FloatArray
) -> float:
    """Return the intersection over union of the surface's silhouette in the photo and ``mask >
    0.5`` (H, W)."""
    seen = np.isfinite(depth_map(vertices, faces, camera, (mask.shape[1], mask.shape[0])))
    person = mask > 0.5
    union = int((seen | person).sum())
    if union == 0:
        raise InputError(
            "neither the surface nor the mask covers a pixel; is this the surface's own camera?"
        )
    return float((seen & person).sum() / union)


def person_box(vertices: FloatArray, person: BoolArray, camera: OrthographicCamera) -> FloatArray:
    """Return the least and largest corners (2, 3), meters, of a box around a body's vertices (V, 3)
    and a mask.

    The mask (H, W) of `camera` extends the box only in x and y.
    """
    rows, columns = np.nonzero(person)
    corners = camera.unproject(
        np.array([[columns.min(), rows.max() + 1], [columns.max() + 1, rows.min()]], np.float64),
        0.0,
    )
    low = np.minimum(vertices.min(axis=0), [*corners[0, :2], np.inf])
    high = np.maximum(vertices.max(axis=0), [*corners[1, :2], -np.inf])
    return np.stack([low, high])
