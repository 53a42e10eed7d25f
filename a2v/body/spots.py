"""Positions on a body's skin of nearby points: part, position at rest, and the mirrored
position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS
from a2v.geometry.mesh import vertex_normals
from a2v.types import Body, BoolArray, FloatArray, IntArray

TURNED = 0.05
"""Distance that equals a difference of one unit between normals, meters. It keeps the front of an
arm from counting as near its back."""
_HELIX = 0.97
"""Vertices of a head at least at this fraction of its largest half width belong to the ears."""
_CHEEK = 0.03
"""Distance in front of the ears' rims at which the face begins, meters."""
_FOREHEAD = 0.4
"""Height at which the face ends, as a fraction of the way from the upper half of the ears to the
top."""
_EARS = 0.012
"""Distance behind the ears' rims from which hair grows, meters."""
_NAPE = 0.045
"""Distance below the upper half of the ears down to which hair grows, meters."""
_CROWN = 0.6
"""Fraction of the way from there to the top above which hair grows everywhere."""
_TEMPLE = 0.035, 0.025
"""Height above the upper half of the ears from which hair also grows in front of their rims, and
the distance in front of them, meters."""


@dataclass(frozen=True, eq=False)
class Spots:
    """Spots of a body's skin, one for each of V points.

    Attributes
    ----------
    parts : (V,) int8
        Index into `a2v.body.PARTS`.
    places : (V, 3) float64
        Position in the body's rest pose, meters; the person's left on +x, y up, facing +z.
    normals : (V, 3) float64
        Normals of the skin.
    scalp : (V,) bool
        Area where hair can grow: behind the ears down to the nape, and the crown.
    bare : (V,) bool
        Area without hair except beards: the face in front of the ears, up to the forehead.
    """

    parts: IntArray
    places: FloatArray
    normals: FloatArray
    scalp: BoolArray
    bare: BoolArray

    def twins(self, among: BoolArray, *, within: float) -> IntArray:
        """Return for each point the index (V,) of the point nearest to its mirrored spot.

        Only points in the mask `among` (V,) count. -1 if none is `within` meters.
        """
        from scipy.spatial import cKDTree

        other = np.array([-1.0, 1.0, 1.0])
        here, there = (
            np.concatenate([self.places * side, TURNED * self.normals * side], axis=1)
            for side in (1.0, other)
        )
        numbers = np.flatnonzero(among)
        if not len(numbers):
            return np.full(len(among), -1)
        way, nearest = cKDTree(here[numbers]).query(there, workers=1)
        return np.where(way < within, numbers[nearest], -1)


def nearest_spots(vertices: FloatArray, body: Body) -> Spots:
    """Return the spot of a body's skin nearest to each point (V, 3), meters.

    It is fast and coarse; `a2v.animation.bind` also compares normals.
    """
    from scipy.spatial import cKDTree

    return spots_of(np.asarray(cKDTree(body.vertices).query(vertices, workers=1)[1]), body)


def spots_of(nearest: IntArray, body: Body) -> Spots:
    """The spots of vertices (V,) of a body."""
    rest = rest_vertices(body)
    normals = np.asarray(vertex_normals(rest, np.asarray(body.faces)), np.float64)
    parts = np.asarray(body.parts)
    return Spots(
        parts[nearest].astype(np.int8),
        rest[nearest],
        normals[nearest],
        *(area[nearest] for area in _hair_line(rest, parts)),
    )


def bones_from_rest(body: Body) -> FloatArray:
    """Return the transform (B, 3, 4) float64 of each bone from its rest pose."""
    moved = body.bone_transforms.astype(np.float64) @ np.linalg.inv(
        body.rest_transforms.astype(np.float64)
    )
    return np.asarray(moved[:, :3])


def moved_from_rest(body: Body) -> FloatArray:
    """Return for each vertex the blended transform (V, 3, 4) float64 of its bones from rest."""
    return np.asarray(np.tensordot(body.weights.astype(np.float64), bones_from_rest(body), axes=1))


def rest_vertices(body: Body) -> FloatArray:
    """Return a body's vertices (V, 3) float64 in its rest pose, meters, by inverse linear blend
    skinning."""
    blended = moved_from_rest(body)
    away = np.asarray(body.vertices, np.float64) - blended[..., 3]
    return np.asarray(np.linalg.solve(blended[..., :3], away[..., None])[..., 0])


def _hair_line(rest: FloatArray, parts: IntArray) -> tuple[BoolArray, BoolArray]:
    """Return masks of the vertices (V, 3) of a body at rest that carry hair, and of the face."""
    head = parts == PARTS.index("head")
    if not head.any():
        return np.zeros(len(rest), bool), np.zeros(len(rest), bool)
    x, y, z = (rest - [np.median(rest[head, 0]), 0, 0]).T
    ears = head & (np.abs(x) > _HELIX * np.abs(x[head]).max())
    level, depth, top = y[ears].mean(), z[ears].mean(), y[head].max()
    behind = (z < depth - _EARS) & (y > level - _NAPE) | (z < depth + _TEMPLE[1]) & (
        y > level + _TEMPLE[0]
    )
    scalp = (head | (parts == PARTS.index("neck"))) & (
        behind | (y > level + _CROWN * (top - level))
    )
    return scalp, head & (z > depth + _CHEEK) & (y < level + _FOREHEAD * (top - level))
