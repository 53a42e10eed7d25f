"""Unroll a surface into the plane of the photo: a frame at each vertex along the limb and around
it."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS
from a2v.geometry.vectors import unit
from a2v.reconstruction.backs.pieces import neighbor_mean
from a2v.types import FloatArray, IntArray


def unrolling(
    vertices: FloatArray, normals: FloatArray, parts: IntArray, neighbors: IntArray
) -> FloatArray:
    """Return linear maps (V, 2, 3) from meters on the surface to meters in the photo's plane, x to
    the right and y up.

    Surface that faces the camera is mapped as by the camera. Around a limb the plane is rolled: on
    the side and on the back, the direction around the limb is mapped to the direction across it in
    the photo, and the direction along the limb to that along it. So a pattern that is continued by
    these maps keeps its size on the sides, and stripes around a trunk, a sleeve or a leg remain
    rings.
    """
    axis = _limb_axes(vertices, parts, neighbors)
    along = unit(axis - (axis * normals).sum(axis=1, keepdims=True) * normals, least=1e-6)
    around = np.cross(normals, along)
    flat = axis[:, :2]
    # a limb that points at the camera has no direction in the picture: upright is used
    flat = unit(flat + np.array([0.0, -1e-3]), least=1e-6)
    across = np.stack([-flat[:, 1], flat[:, 0]], axis=1)
    return np.asarray(
        flat[:, :, None] * along[:, None, :] + across[:, :, None] * around[:, None, :]
    )


def _limb_axes(vertices: FloatArray, parts: IntArray, neighbors: IntArray) -> FloatArray:
    """Return unit vectors (V, 3) along the limb of each vertex, away from the trunk, smooth between
    limbs."""
    axis = np.tile(np.array([0.0, -1.0, 0.0]), (len(vertices), 1))
    middle = {number: vertices[parts == number].mean(axis=0) for number in np.unique(parts)}
    for number, own in middle.items():
        name = PARTS[number]
        if name == "torso" or name.endswith("foot") or (parts == number).sum() < 20:
            continue
        points = vertices[parts == number] - own
        way = np.linalg.svd(points[:: max(1, len(points) // 500)], full_matrices=False)[2][0]
        start = middle.get(PARTS.index("torso"), own)
        if name in ("head", "neck"):
            way = np.array([0.0, -1.0, 0.0])
        elif name.endswith("hand"):
            before = middle.get(PARTS.index(name.replace("hand", "lower_arm")))
            way = way if before is None else own - before
        elif way @ (own - start) < 0:
            way = -way
        axis[parts == number] = way / max(float(np.linalg.norm(way)), 1e-9)
    mixing = neighbor_mean(neighbors)
    for _ in range(6):
        axis = unit(mixing @ axis + 0.2 * axis, least=1e-6)
    return axis
