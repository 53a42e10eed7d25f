"""Fast pictures of a surface: one ray per pixel, a light at the camera, texture or vertex colors.
Not for videos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import load_open3d
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, Surface


@dataclass(frozen=True, kw_only=True)
class PreviewStyle:
    """Style of a fast picture.

    Attributes
    ----------
    shaded : bool
        Darken by the angle to the camera.
    plain : bool
        White instead of the colors, to show the shape.
    background : tuple of 3 int
        sRGB of the background.
    """

    shaded: bool = True
    plain: bool = False
    background: tuple[int, int, int] = (235, 235, 240)


def preview_surface(
    surface: Surface,
    *,
    azimuth: float = 0.0,
    elevation: float = 0.0,
    size: int = 512,
    center: FloatArray | None = None,
    extent: float | None = None,
    style: PreviewStyle = PreviewStyle(),
) -> ByteArray:
    """Render an orthographic picture of `surface`.

    Parameters
    ----------
    surface : Surface
    azimuth, elevation : float
        Direction of the camera, degrees: (0, 0) in front (+z), azimuth 90 at the person's left
        (+x), 180 behind.
    size : int
        Width and height, pixels.
    center : (3,), optional
        Point in the middle of the picture, meters; default: the middle of the bounds.
    extent : float, optional
        Width of the picture, meters; default: the surface with a border.
    style : PreviewStyle

    Returns
    -------
    (size, size, 3) uint8.
    """
    vertices = np.asarray(surface.vertices, np.float64)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = (low + high) / 2 if center is None else np.asarray(center, np.float64)
    extent = float(np.max(high - low)) * 1.08 if extent is None else extent
    a, e = np.radians([azimuth, elevation])
    backward = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    up = np.cross(backward, right)
    ticks = ((np.arange(size) + 0.5) / size - 0.5) * extent
    origins = middle + ticks[None, :, None] * right - ticks[:, None, None] * up + backward * 10.0
    seen, face, weights = _first_hits(surface, origins, -backward)
    color = np.full((len(face), 3), 0.8) if style.plain else colors_at(surface, face, weights)
    if style.shaded or style.plain:
        normal = (
            vertex_normals(vertices, surface.faces)[surface.faces[face]] * weights[..., None]
        ).sum(axis=1)
        light = backward + 0.35 * up - 0.25 * right
        facing = np.clip(normal @ (light / np.linalg.norm(light)), 0, 1)
        color = color * ((0.25 + 0.75 * facing) if style.plain else (0.7 + 0.3 * facing))[:, None]
    picture = np.empty((size, size, 3), np.uint8)
    picture[:] = style.background
    picture[seen] = np.clip(color * 255 + 0.5, 0, 255).astype(np.uint8)
    return picture


def _first_hits(
    surface: Surface, origins: FloatArray, direction: FloatArray
) -> tuple[BoolArray, IntArray, FloatArray]:
    """Find the first hits of rays from `origins` (H, W, 3).

    Returns the pixels that hit (H, W), and for these N pixels the face (N,) and the barycentric
    weights (N, 3) of its corners.
    """
    rays = np.concatenate([origins, np.broadcast_to(direction, origins.shape)], axis=-1).astype(
        np.float32
    )
    scene: Any = load_open3d().t.geometry.RaycastingScene()
    scene.add_triangles(
        np.ascontiguousarray(surface.vertices, np.float32),
        np.ascontiguousarray(surface.faces, np.uint32),
    )
    hits = scene.cast_rays(rays)
    seen = np.isfinite(hits["t_hit"].numpy())
    second = hits["primitive_uvs"].numpy()[seen].astype(np.float64)
    weights = np.concatenate([1 - second.sum(axis=1, keepdims=True), second], axis=1)
    return seen, hits["primitive_ids"].numpy()[seen].astype(np.int64), weights


def colors_at(surface: Surface, face: IntArray, weights: FloatArray) -> FloatArray:
    """Return sRGB (N, 3) in [0, 1] at points of faces (N,), given by barycentric weights (N, 3)."""
    import cv2

    if surface.uv is None or surface.texture is None:
        mixed: FloatArray = (surface.colors[surface.faces[face]] * weights[..., None]).sum(axis=1)
        return mixed
    rows, columns = surface.texture.shape[:2]
    uv = (surface.uv[face] * weights[..., None]).sum(axis=1)
    x = (uv[:, 0] * columns - 0.5).astype(np.float32)[None]
    y = ((1 - uv[:, 1]) * rows - 0.5).astype(np.float32)[None]
    part = 30000  # cv2.remap takes fewer than 2^15 columns at a time
    chunks = [
        cv2.remap(surface.texture, x[:, i : i + part], y[:, i : i + part], cv2.INTER_LINEAR)[0]
        for i in range(0, x.shape[1], part)
    ]
    return np.concatenate(chunks).reshape(-1, 3) / 255 if chunks else np.zeros((0, 3))
