"""Make long hair: a closed layer that hangs from the head over neck and shoulders."""

from __future__ import annotations

import functools

import numpy as np

from a2v.body.face import SKIN
from a2v.body.parts import on_parts
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.reconstruction.canonical.binding import posed_by
from a2v.reconstruction.canonical.hair_outline import (
    hair_around,
    resampled,
    shown_places,
    strand_ends,
    to_outline,
)
from a2v.reconstruction.canonical.layers import Layer, closed_faces
from a2v.reconstruction.canonical.strands import (
    COLUMNS,
    STEPS,
    TEMPLES,
    HairlessPerson,
    HairSolid,
    bound,
    evened_strands,
    head_place,
    least_distance,
    strand_paths,
)
from a2v.reconstruction.reading import HairSeen
from a2v.types import Body, BoolArray, Camera, FloatArray, IntArray

_EARS = 0.115
"""Depth of the ears' upper ends below the top of the head, meters."""
ROWS = 48
"""Number of vertices of a strand."""
_FADE = 0.05
"""Height above and below the base of the neck over which these displacements fade out: lower hair
lies on the trunk, meters."""
_ROUNDS = 2
"""Number of displacements to the outline."""
_THICK = (0.004, 0.001)
"""Thickness of the layer at the roots and at the tips, meters."""
SHARE = 0.14
"""Height of the strip of the hair in the texture."""
_INNER = 0.03
"""Height of the strip of the inner side."""


def under_hair(rest: FloatArray, parts: IntArray, normals: FloatArray) -> BoolArray:
    """Return which vertices (V, 3) at rest, with `normals` (V, 3), on `parts` (V,), lie under long
    hair: ears, nape and the sides of the neck. There the surface is hair, and not skin."""
    top, middle = head_place(rest, parts)
    ahead = rest[:, 2] - middle
    beside = np.abs(np.degrees(np.arctan2(rest[:, 0], ahead))) > TEMPLES - 4
    head = on_parts(parts, "head") & beside & (rest[:, 1] < top - _EARS)
    return np.asarray(head | (on_parts(parts, "neck") & (normals[:, 2] < 0.6)))


def make_hair(person: HairlessPerson, body: Body, seen: HairSeen, camera: Camera) -> Layer:
    """Make the layer of long hair.

    1. Strands run down from a ring around the head, outside the body, and end where they lie flat.
    2. They are moved to the outline of the hair in the photo.
    3. They end where the photo shows that hair ends. Unseen strands have the length of the mirrored
       ones, or the usual one.
    """
    from scipy.spatial import cKDTree

    base = float(body.rest_transforms[body.bone_names.index("neck01"), 1, 3])
    solid = HairSolid(person.rest, person.faces)
    grid = strand_paths(person, solid).transpose(1, 0, 2).reshape(-1, 3)
    binding = bound(grid, body)
    away = grid * [1, 0, 1] - [0, 0, head_place(person.rest, person.parts)[1]]
    ways = unit(away, least=1e-9)
    fade = smoothstep(grid[:, 1], base - _FADE, base + _FADE)
    for _ in range(_ROUNDS):
        posed = posed_by(*binding, body, grid)
        beside = posed_by(*binding, body, grid + 0.01 * ways)
        offset = fade * to_outline(posed, beside, seen, camera).ravel()
        grid = evened_strands(grid + offset[:, None] * ways)
        grid = solid.pushed(grid, least_distance(grid, base))
    posed = posed_by(*bound(grid, body), body, grid)
    rows = grid.reshape(STEPS, COLUMNS, 3)
    shown, hair = shown_places(posed, person, camera), hair_around(posed, seen, camera)
    outer = resampled(rows, strand_ends(rows, shown, hair, base, free=seen.free), ROWS).reshape(
        -1, 3
    )
    weights, bones = bound(outer, body)
    normals = vertex_normals(outer, sheet(ROWS)).astype(np.float64)
    along = np.repeat(np.linspace(0, 1, ROWS), COLUMNS)
    thick = _THICK[0] + (_THICK[1] - _THICK[0]) * smoothstep(along, 0.6, 1.0)
    skin = np.asarray(body.vertices[: SKIN.stop])
    own = on_parts(body.parts[: SKIN.stop], "head")
    posed = posed_by(weights, bones, body, outer)
    anchors = np.flatnonzero(own)[cKDTree(skin[own]).query(posed, workers=1)[1]]
    return Layer(
        np.concatenate([outer, outer - thick[:, None] * normals]),
        np.tile(weights, (2, 1)),
        np.tile(bones, (2, 1)),
        np.tile(anchors, 2),
    )


@functools.cache
def hair_faces() -> IntArray:
    """The faces (f, 3) of the layer: both sides, and the strips that join them."""
    number = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
    edges = [(number[0], False), (number[-1], True), (number[:, 0], True), (number[:, -1], False)]
    return closed_faces(sheet(ROWS), edges)


@functools.cache
def hair_layout() -> FloatArray:
    """The texture coordinates (f, 3, 2) of `hair_faces` in a strip at the bottom, of height
    `SHARE`: strands run up, the inner side is below."""
    faces, half = hair_faces(), ROWS * COLUMNS
    inner = (faces >= half).all(axis=1)
    own = faces % half
    column, v = own % COLUMNS, 1 - own // COLUMNS / (ROWS - 1)
    high = np.where(
        inner[:, None], 0.004 + (_INNER - 0.008) * v, _INNER + 0.004 + (SHARE - _INNER - 0.012) * v
    )
    across = 0.004 + 0.992 * column / (COLUMNS - 1)
    return np.asarray(np.stack([across, high], axis=-1), np.float32)


def hair_twins() -> IntArray:
    """Index (n,) of the mirrored vertex of each vertex."""
    count = 2 * ROWS * COLUMNS
    return np.asarray(np.arange(count).reshape(-1, COLUMNS)[:, ::-1].ravel())


def strand_numbers(count: int) -> IntArray:
    """Number of the strand (count,) of the last vertices of `count`, which are the layer."""
    return np.asarray((np.arange(count) - count) % COLUMNS)


def sheet(rows: int) -> IntArray:
    """Faces (f, 3) of an open sheet of `rows` rows, oriented outwards."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(COLUMNS - 1), indexing="ij")
    one, two = row * COLUMNS + column, row * COLUMNS + column + 1
    below, beside = one + COLUMNS, two + COLUMNS
    return np.concatenate(
        [
            np.stack([one, below, two], axis=-1).reshape(-1, 3),
            np.stack([two, below, beside], axis=-1).reshape(-1, 3),
        ]
    )
