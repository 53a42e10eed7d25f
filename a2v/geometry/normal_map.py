"""Normal maps: the detail of a fine mesh for a coarse one with the same texture coordinates."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import texels
from a2v.geometry.vectors import unit
from a2v.system import thread_count
from a2v.types import ByteArray, FloatArray, IntArray

_PADDING = 6
"""Width of the border of texels around charts that are filled with the nearest normal."""
_BAND = 64
"""Number of rows of the map that a thread computes at a time."""
_LEAST_HEIGHT = 0.2
"""Smallest cosine between a normal and the surface. Normals that lean farther are raised to it:
they are errors of the correspondence."""


def corner_tangents(vertices: FloatArray, faces: IntArray, uv: FloatArray) -> FloatArray:
    """Return glTF tangents (F, 3, 4) of the faces' corners: the surface direction of growing u, and
    the sign of the bitangent.

    Corners of a vertex with the same texture coordinates share a tangent: the sum over their faces,
    made perpendicular to the vertex's normal.

    Parameters
    ----------
    vertices : (V, 3)
    faces : (F, 3)
    uv : (F, 3, 2)
        Origin at the lower left.
    """
    points, tri = np.asarray(vertices, np.float64), np.asarray(faces, np.int64)
    normals = vertex_normals(points, tri)
    edges, steps = (
        values[:, 1:] - values[:, :1] for values in (points[tri], np.asarray(uv, np.float64))
    )
    area = steps[:, 0, 0] * steps[:, 1, 1] - steps[:, 1, 0] * steps[:, 0, 1]
    sign = np.where(area < 0, -1.0, 1.0)
    along = sign[:, None] * (edges[:, 0] * steps[:, 1, 1:] - edges[:, 1] * steps[:, 0, 1:])
    rows = np.concatenate(
        [
            tri.reshape(-1, 1),
            np.ascontiguousarray(uv.reshape(-1, 2), np.float32).view(np.int32),
            np.repeat(sign > 0, 3)[:, None],
        ],
        axis=1,
    )
    _, wedge = np.unique(rows, axis=0, return_inverse=True)
    wedge = np.asarray(wedge).reshape(-1)
    total = np.stack(
        [np.bincount(wedge, np.repeat(along[:, axis], 3)) for axis in range(3)], axis=-1
    )[wedge]
    normal = normals[tri].reshape(-1, 3)
    total -= (total * normal).sum(axis=1, keepdims=True) * normal
    lost = np.linalg.norm(total, axis=1) < 1e-12
    total[lost] = np.cross(
        normal[lost], np.where(np.abs(normal[lost, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    )
    return np.asarray(
        np.concatenate([unit(total, least=1e-20), np.repeat(sign, 3)[:, None]], axis=1).reshape(
            -1, 3, 4
        )
    )


def bake_normal_map(
    fine: tuple[FloatArray, IntArray, FloatArray],
    coarse: tuple[FloatArray, IntArray, FloatArray],
    *,
    size: int,
) -> ByteArray:
    """Bake the normals of a fine mesh in the tangent space of a coarse one: (size, size, 3) uint8,
    row 0 is the top.

    Both meshes are (vertices (V, 3), faces (F, 3), uv (F, 3, 2)); a texel must show the same place
    of both.
    """
    (points, tri, uv), (true, true_tri, true_uv) = coarse, fine
    face, weights = texels(np.asarray(uv, np.float64) * size, size)
    own = face >= 0
    true_face, true_weights = texels(np.asarray(true_uv, np.float64) * size, size)
    both = own & (true_face >= 0)
    true_normals = vertex_normals(true.astype(np.float64), true_tri.astype(np.int64))[true_tri]
    normals = vertex_normals(points.astype(np.float64), tri.astype(np.int64))[tri]
    tangents = corner_tangents(points, tri, uv)
    flat = np.zeros((size, size, 3))
    flat[..., 2] = 1.0

    def fill(top: int) -> None:
        """Compute the rows of the map from `top` on; each band writes only its own rows."""
        band = slice(top, top + _BAND)
        known = both[band]
        own_face, own_weights = face[band][known], weights[band][known]
        wanted = _mixed(true_normals, true_face[band][known], true_weights[band][known])
        normal = _mixed(normals, own_face, own_weights)
        tangent = _mixed(tangents[..., :3], own_face, own_weights)
        tangent = unit(
            tangent - (tangent * normal).sum(axis=1, keepdims=True) * normal, least=1e-12
        )
        bitangent = np.cross(normal, tangent) * tangents[own_face, 0, 3:]
        local = np.stack(
            [(wanted * axis).sum(axis=1) for axis in (tangent, bitangent, normal)], axis=-1
        )
        local[:, 2] = np.maximum(local[:, 2], _LEAST_HEIGHT)
        flat[band][known] = unit(local, least=1e-12)

    with ThreadPoolExecutor(thread_count()) as threads:
        list(threads.map(fill, range(0, size, _BAND)))
    return np.asarray(np.rint(255 * (0.5 + 0.5 * _spread(flat, both))), np.uint8)


def _mixed(corners: FloatArray, face: IntArray, weights: FloatArray) -> FloatArray:
    """Interpolate corners' values (F, 3, 3) at points of faces (n,) by barycentric weights (n, 3);
    unit vectors (n, 3)."""
    return np.asarray(unit(np.einsum("nk,nkc->nc", weights, corners[face]), least=1e-12))


def _spread(values: FloatArray, known: np.ndarray) -> FloatArray:
    """Fill unknown texels near known ones (H, W) with the nearest value of `values` (H, W, 3).

    Mipmaps would mix them in.
    """
    from scipy.ndimage import distance_transform_edt

    if not known.any():
        return values
    distance, (rows, columns) = distance_transform_edt(~known, return_indices=True)
    return np.asarray(np.where((distance < _PADDING)[..., None], values[rows, columns], values))
