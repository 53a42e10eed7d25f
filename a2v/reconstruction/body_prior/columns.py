"""Maps (nx, ny) of the mask and of the skin over the grid's columns, as the photo's camera sees
them."""

from __future__ import annotations

import numpy as np

from a2v.errors import InputError
from a2v.geometry.images import contour_distance, sample_index, trace_contours
from a2v.geometry.rays import ray_scene
from a2v.geometry.visibility import cast_depth
from a2v.geometry.volume import Grid
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera


def mask_distance(mask: FloatArray, camera: OrthographicCamera, grid: Grid) -> FloatArray:
    """Return the signed distance (nx, ny) to the mask's contour at the grid's columns, meters,
    negative inside.

    The opacity makes it sub-pixel.
    """
    import cv2
    from scipy.spatial import cKDTree

    x, y = np.meshgrid(grid.axis(0), grid.axis(1), indexing="ij")
    pixels = camera.project(np.stack([x, y, np.zeros_like(x)], axis=-1)).astype(np.float32)
    per_cell = camera.scale * grid.cell
    soft = cv2.GaussianBlur(mask, (0, 0), max(0.5, 0.35 * per_cell))
    opacity = cv2.remap(
        soft,
        pixels[..., 0] - 0.5,
        pixels[..., 1] - 0.5,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=0,
    )
    contours = trace_contours(soft)
    if not contours:
        raise InputError(
            "the subject's mask has no contour; expected a person in front of a background"
        )
    distance = (
        np.reshape(
            cKDTree(np.concatenate(contours)).query(pixels.reshape(-1, 2), workers=1)[0], x.shape
        )
        / camera.scale
    )
    return np.where(opacity > 0.5, -distance, distance).astype(np.float32)


def front_seen(skin: FloatArray, faces: IntArray, grid: Grid) -> FloatArray:
    """Return the front depth (nx, ny) of the skin at the grid's columns, meters; -inf outside."""
    x, y = np.meshgrid(grid.axis(0), grid.axis(1), indexing="ij")
    return cast_depth(ray_scene(skin, faces, threads=0), x, y, float(skin[:, 2].max()) + 1)


def columns_seen(skin: FloatArray, faces: IntArray, grid: Grid) -> tuple[FloatArray, FloatArray]:
    """Return front and back depth (nx, ny) of the skin at the grid's columns, meters; -inf and +inf
    outside."""
    return front_seen(skin, faces, grid), -front_seen(
        skin * np.array([1.0, 1.0, -1.0]), faces, grid
    )


def binary_distance(inside: BoolArray, cell: float) -> FloatArray:
    """Return the signed distance of a binary map, meters, negative inside.

    The contour is between the nodes, lightly smoothed.
    """
    import cv2

    return np.asarray(
        cv2.GaussianBlur((contour_distance(inside) * cell).astype(np.float32), (0, 0), 1.0)
    )


def sample_columns(values: FloatArray, points: FloatArray, grid: Grid) -> FloatArray:
    """Sample a column map (nx, ny) bilinearly at x, y of points (N, 3); returns (N,)."""
    place = (points[:, :2] - grid.origin[:2]) / grid.cell
    return sample_index(values, columns=place[:, 1], rows=place[:, 0], linear=True)
