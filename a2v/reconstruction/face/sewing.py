"""Cut a hole into a surface under a patch, and sew both together."""

from __future__ import annotations

import numpy as np

from a2v.geometry.mesh import border_loops
from a2v.geometry.sewing import sew_in, single_rim
from a2v.reconstruction.face.patch import Patch
from a2v.types import BoolArray, FloatArray, IntArray, Surface

_REACH = 0.06
"""Distance from the patch beyond which the surface stays, meters."""
_GAP = 0.004
"""Smallest width of the seam between rim and hole, meters."""


def cut_and_sew(
    surface: Surface, bent: FloatArray, body_faces: IntArray, patch: Patch
) -> tuple[FloatArray | None, IntArray, IntArray, IntArray]:
    """Cut the surface open under the patch, and sew the patch in.

    Parameters
    ----------
    surface : Surface
    bent : (13854, 3)
        Vertices and teeth of the body, meters.
    body_faces : (F, 3) int
    patch : Patch

    Returns
    -------
    vertices : (N, 3), or None if the hole has not one single rim
        First the kept vertices of the surface, then the patch.
    faces : (M, 3)
    kept : (n,) int
        Vertices of the surface that are kept.
    own : (K,) int
        Indices of the vertices of the patch.
    """
    vertices, faces = surface.vertices.astype(np.float64), surface.faces.astype(np.int64)
    covered = _covered(vertices, bent, body_faces, patch)
    staying = faces[single_rim(faces, ~covered[faces].any(axis=1))]
    loops = border_loops(staying)
    if not loops or len(loops[0]) < 12 or len(loops) > 1:
        return None, faces, np.unique(staying), np.zeros(0, np.int64)
    every, made, kept = sew_in(
        vertices, staying, loops[0], bent[patch.vertices], patch.faces, patch.rim
    )
    return every, made, kept, len(kept) + np.arange(len(patch.vertices))


def _covered(
    vertices: FloatArray, bent: FloatArray, body_faces: IntArray, patch: Patch
) -> BoolArray:
    """Return which vertices (V,) of a surface lie at the patch.

    Their nearest vertex of the visible front of the body belongs to the patch, or is adjacent to
    it.
    """
    from scipy.spatial import cKDTree

    from a2v.geometry.rays import ray_scene

    near = cKDTree(bent[patch.vertices[patch.kinds == 0]]).query(
        vertices, distance_upper_bound=_REACH
    )[0]
    ids = np.flatnonzero(np.isfinite(near))
    front = np.union1d(
        patch.front, np.flatnonzero(patch.within & np.isin(np.arange(len(body_faces)), patch.front))
    )
    found = ray_scene(bent, body_faces[front]).compute_closest_points(
        vertices[ids].astype(np.float32)
    )
    on = front[found["primitive_ids"].numpy()]
    rim = bent[patch.vertices[patch.rim]]
    to_rim = cKDTree(rim).query(vertices[ids])[0]
    covered = np.zeros(len(vertices), bool)
    covered[ids] = patch.within[on] | (to_rim < _GAP)
    return covered
