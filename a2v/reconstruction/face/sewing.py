"""A hole cut into a surface where a patch lies over it, and the two sewn together."""

from __future__ import annotations

import numpy as np

from a2v.geometry.mesh import border_loops
from a2v.geometry.sewing import sew_in, single_rim
from a2v.reconstruction.face.patch import Patch
from a2v.types import BoolArray, FloatArray, IntArray, Surface

_REACH = 0.06
"""What lies farther from the patch, meters, stays."""
_GAP = 0.004
"""Cloth of the seam between rim and hole: so wide at least, meters."""


def cut_and_sew(
    surface: Surface, bent: FloatArray, body_faces: IntArray, patch: Patch
) -> tuple[FloatArray | None, IntArray, IntArray, IntArray]:
    """Cut the surface open under the patch, and sew the patch in.

    Parameters
    ----------
    surface : Surface
    bent : (13854, 3)
        Where the body's vertices and teeth lie.
    body_faces : (F, 3) int
    patch : Patch

    Returns
    -------
    vertices : (N, 3), or None where the hole has no single rim
        First what is kept of the surface, then the patch.
    faces : (M, 3)
    kept : (n,) int
        Vertices of the surface that are kept.
    own : (K,) int
        Places of the patch's vertices.
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
    """Which vertices (V,) of a surface lie at the patch: the nearest of the body's visible front is
    of it, or of what borders on it."""
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
