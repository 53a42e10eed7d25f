"""Cloth that hangs between the legs: no displacement of a leg."""

from __future__ import annotations

import numpy as np

from a2v.geometry.mesh import face_normals
from a2v.geometry.rays import RayScene
from a2v.types import Body, Surface

HANGS = "a skirt or a coat hangs between the legs: the character is one fused surface"
_GAP = 0.05
"""Where the legs' skins are nearer to each other, metres, what lies between says nothing."""
_SHARE = 0.5
"""Of the places between the legs that tell, at least so many lie within cloth."""
_LEAST = 3


def hangs_between_legs(surface: Surface, body: Body) -> bool:
    """Whether a reconstructed surface (closed, in the photo's pose) is filled between a body's thighs or shins where the legs stand apart."""
    from scipy.spatial import cKDTree

    heads = body.bone_transforms[:, :3, 3].astype(np.float64)
    hips, knees, ankles = (np.stack([heads[body.bone_names.index(f"{bone}{side}")] for side in (".L", ".R")]) for bone in ("upperleg01", "lowerleg01", "foot"))
    along = [(1 - t) * hips + t * knees for t in np.linspace(0.45, 1.0, 8)] + [(1 - t) * knees + t * ankles for t in np.linspace(0.1, 0.5, 4)]
    middle = np.stack([pair.mean(axis=0) for pair in along])
    telling = 2 * cKDTree(body.vertices).query(middle)[0] > _GAP
    if telling.sum() < _LEAST:
        return False
    flat = face_normals(surface.vertices, np.asarray(surface.faces, np.int64))
    within = RayScene(surface.vertices, surface.faces).crossings(np.asarray(middle[telling], np.float32), flat) > 0
    return bool(within[: max(_LEAST, int(within.size * 0.6))].mean() >= _SHARE)
