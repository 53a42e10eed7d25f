"""Make a skirt (also of a dress or a coat): a closed layer around both legs that hangs from the
hips and follows both thighs."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.body.face import SKIN
from a2v.body.parts import on_parts
from a2v.geometry.mesh import face_normals, vertex_normals
from a2v.geometry.rays import RayScene
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.canonical.binding import posed_by
from a2v.reconstruction.canonical.hanging import hanging
from a2v.reconstruction.canonical.layers import Layer, closed_faces
from a2v.reconstruction.canonical.several import Sight
from a2v.reconstruction.canonical.shape import RestMesh, solve_offsets
from a2v.types import Body, BoolArray, FloatArray, IntArray, Surface

COLUMNS = 192
"""Number of vertices around the skirt."""
_ROW = 0.016
"""Distance of rows, meters."""
_ABOVE = 0.14
"""Height above the hip joints at which the layer begins, within the trunk, meters."""
_TUCKED = 0.05
"""Length over which the layer comes out of the trunk, meters."""
_UNDER = 0.012
"""Depth of its upper end within the trunk, meters."""
_THICK = 0.003
"""Thickness of the cloth, meters."""
_BAND = 0.02
"""Height above and below a row within which skin gives the width of the legs, meters."""
_START = 0.06
"""Depth within the hull of the legs at which rays start, meters."""
_MOST = 0.28
"""Largest distance of cloth from the hull of the legs, meters."""
_SMOOTH = 0.03
"""Length over which displacements are smoothed, meters."""
_BREAK = 3
"""Number of rows without cloth between the legs that end the skirt."""
BELOW = 0.05
"""Distance below the lowest point of a visible hem beyond which legs are bare, meters. There the
surface steps back to the legs."""
_LEAST = 0.15
"""Smallest length of a skirt, meters; shorter cloth is a displacement of the trunk."""
_STEPS = (0.04, 0.65)
"""If the distance of cloth from the legs exceeds the first value, meters, the cloth ends where the
distance falls below the second value times its maximum."""
_AS_ONE: tuple[tuple[str, ...], ...] = (
    ("spine05", "root", "pelvis.L", "pelvis.R"),
    *(
        (f"{bone}01.{side}", f"{bone}02.{side}")
        for side in ("L", "R")
        for bone in ("upperleg", "lowerleg")
    ),
)
"""Groups of Anny's bones that move cloth as one; the first takes the weight."""
SHARE = 0.2
"""Height of the strip of the skirt at the bottom of the texture, by which the layout of the body
shrinks."""
_INNER = 0.03
"""Height of the strip of the inner side."""


@dataclass(frozen=True, eq=False)
class Skirt(Layer):
    """The layer, row by row from the top.

    Attributes
    ----------
    hem : float
        Height of its lower end at rest, meters.
    """

    hem: float


def make_skirt(sight: Sight, body: Body, rest: FloatArray) -> Skirt | None:
    """Make the skirt of a reconstructed surface (closed, in the pose of the photo) on a body whose
    vertices at rest are `rest` (V, 3). None if it would be too short.

    It ends at the hem that the photo shows, else where the surface steps back to the legs.
    """
    from scipy.spatial import cKDTree

    surface = sight.person.surface
    hem = None if sight.reading.hem is None else float(sight.reading.hem[0])
    skin = np.asarray(rest[: SKIN.stop], np.float64)
    low = on_parts(
        body.parts[: SKIN.stop], "torso", "left_thigh", "left_shin", "right_thigh", "right_shin"
    )
    hips, ankles = (
        np.stack(
            [
                body.rest_transforms[body.bone_names.index(f"{bone}{side}"), :3, 3]
                for side in (".L", ".R")
            ]
        ).mean(axis=0)
        for bone in ("upperleg01", "foot")
    )
    heights = np.arange(hips[1] + _ABOVE, ankles[1] + 0.04, -_ROW)
    base, weights = _hull(skin, low, heights, hips), _blended(body, skin, low, heights)
    four, bones = _largest(weights, body.bone_names)
    posed = posed_by(four, bones, body, base)
    rows = (
        _rows_of_cloth(surface, posed.reshape(len(heights), COLUMNS, 3), heights < hips[1] - 0.12)
        if hem is None
        else int((heights >= hem).sum())
    )
    if heights[0] - heights[rows - 1] < _LEAST:
        return None
    count = rows * COLUMNS
    base, four, bones, posed = base[:count], four[:count], bones[:count], posed[:count]
    faces = _tube(rows)
    found, known = _observed(surface, posed, faces, body)
    rows = _hem(found, known, rows) if hem is None else rows
    count = rows * COLUMNS
    base, four, bones, found, known, faces = (
        base[:count],
        four[:count],
        bones[:count],
        found[:count],
        known[:count],
        _tube(rows),
    )
    twin = np.arange(count).reshape(rows, COLUMNS)[:, -np.arange(COLUMNS) % COLUMNS].ravel()
    tube = RestMesh(vertices=base, faces=faces, parts=np.zeros(count, np.int64), twin=twin)
    offset = solve_offsets(
        tube, found, known.astype(np.float64), fixed=np.zeros(count, bool), smoothing=_SMOOTH
    )
    offset = hanging(sight, offset.reshape(rows, COLUMNS), posed[:count], base)
    offset = np.maximum(offset.ravel(), 0.004)
    out = smoothstep(heights[0] - base[:, 1], 0.0, _TUCKED)
    offset = out * offset - (1 - out) * _UNDER
    normals = vertex_normals(base, faces).astype(np.float64)
    normals[:, 1] *= 0.3
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    outer = base + offset[:, None] * normals
    anchors = np.flatnonzero(low)[cKDTree(skin[low]).query(outer, workers=1)[1]]
    return Skirt(
        np.concatenate([outer, outer - _THICK * normals]),
        np.tile(four, (2, 1)),
        np.tile(bones, (2, 1)),
        np.tile(anchors, 2),
        float(heights[rows - 1]),
    )


def covered(skirt: Skirt, rest: FloatArray, parts: IntArray, lowest: float) -> BoolArray:
    """Return which vertices (V, 3) at rest, on `parts` (V,), lie under the skirt, down to the
    height `lowest`, meters: the body has no clothes there."""
    low, top = (
        on_parts(parts, "torso", "left_thigh", "left_shin", "right_thigh", "right_shin"),
        float(skirt.vertices[:, 1].max()),
    )
    return np.asarray(low & (rest[:, 1] > min(lowest, skirt.hem)) & (rest[:, 1] < top - _TUCKED))


def skirt_faces(count: int) -> IntArray:
    """Return the faces (f, 3) of a layer of `count` vertices: both sides, and the strips that join
    them."""
    rows = count // (2 * COLUMNS)
    around = np.append(np.arange(COLUMNS), 0)
    last = (rows - 1) * COLUMNS + around
    return closed_faces(_tube(rows), [(around, False), (last, True)])


@functools.lru_cache(maxsize=4)
def skirt_layout(count: int) -> FloatArray:
    """Return the texture coordinates (f, 3, 2) of `skirt_faces` in a strip at the bottom: the angle
    to the right, the height up, the inner side below."""
    rows = count // (2 * COLUMNS)
    faces = skirt_faces(count)
    inner = (faces >= rows * COLUMNS).all(axis=1)
    own = faces % (rows * COLUMNS)
    column, row = (own % COLUMNS).astype(np.float64), own // COLUMNS
    column += COLUMNS * ((column == 0) & (column.max(axis=1) == COLUMNS - 1)[:, None])
    v = 1 - row / (rows - 1)
    high = np.where(
        inner[:, None], 0.004 + (_INNER - 0.008) * v, _INNER + 0.004 + (SHARE - _INNER - 0.012) * v
    )
    return np.asarray(np.stack([0.004 + 0.992 * column / COLUMNS, high], axis=-1), np.float32)


def skirt_twins(count: int) -> IntArray:
    """Index (count,) of the mirrored vertex of each vertex."""
    return np.asarray(
        np.arange(count).reshape(-1, COLUMNS)[:, -np.arange(COLUMNS) % COLUMNS].ravel()
    )


def shown_around(posed: FloatArray) -> IntArray:
    """Index (n,) of the vertex of the visible side whose texture a vertex can take, at the same
    height: the quarter that faces the camera (+z), mirrored again and again around the skirt.

    `posed` (n, 3) are the vertices in the photo.
    """
    count = len(posed) // 2
    normals = vertex_normals(posed[:count], _tube(count // COLUMNS))
    facing = normals[:, 2].reshape(-1, COLUMNS).mean(axis=0)
    middle = 2 * np.pi * np.arange(COLUMNS) / COLUMNS
    middle = np.angle((np.maximum(facing, 0.0) * np.exp(1j * middle)).sum())
    quarter = COLUMNS // 4
    start = round(float(middle) / (2 * np.pi) * COLUMNS) - quarter // 2
    turn = (np.arange(COLUMNS) - start) % (2 * quarter)
    column = (start + np.minimum(turn, 2 * quarter - 1 - turn)) % COLUMNS
    return np.asarray(np.arange(len(posed)).reshape(-1, COLUMNS)[:, column].ravel())


def _angles() -> FloatArray:
    """Angles of the columns: 0 in front, growing to the person's left (+x)."""
    return 2 * np.pi * np.arange(COLUMNS) / COLUMNS


def _hull(skin: FloatArray, low: BoolArray, heights: FloatArray, hips: FloatArray) -> FloatArray:
    """Points (n, 3) at rest on the horizontal hull of both legs, row by row."""
    angles = _angles()
    ways = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    apart = np.cos(angles[:, None] - angles)
    rows, radii, middles = [], [], []
    for height in heights:
        band = skin[low & (np.abs(skin[:, 1] - height) < _BAND)][:, [0, 2]]
        middle = np.array([hips[0], (band[:, 1].min() + band[:, 1].max()) / 2])
        support = ((band - middle) @ ways.T).max(axis=0)
        reach = np.where(apart > 0.05, support / np.maximum(apart, 0.05), np.inf)
        radii.append(reach.min(axis=1))
        middles.append(middle)
    from scipy.ndimage import gaussian_filter1d

    smooth = gaussian_filter1d(np.stack(radii), 2.0, axis=0, mode="nearest")
    centers = gaussian_filter1d(np.stack(middles), 2.0, axis=0, mode="nearest")
    for height, radius, middle in zip(heights, smooth, centers, strict=True):
        flat = middle + radius[:, None] * ways
        rows.append(np.stack([flat[:, 0], np.full(COLUMNS, height), flat[:, 1]], axis=1))
    return np.concatenate(rows)


def _blended(body: Body, skin: FloatArray, low: BoolArray, heights: FloatArray) -> FloatArray:
    """Weights (n, B) of the columns, row by row: those of each leg at that height, blended between
    the legs by the angle."""
    from scipy.ndimage import gaussian_filter1d

    sides = []
    for sign in (1, -1):
        own = np.flatnonzero(low & (sign * skin[:, 0] > 0.0))
        per_row = [
            body.weights[own[np.abs(skin[own, 1] - height) < 2 * _BAND]].mean(axis=0)
            for height in heights
        ]
        sides.append(
            gaussian_filter1d(np.stack(per_row).astype(np.float64), 2.0, axis=0, mode="nearest")
        )
    sine = np.sin(_angles())
    # by the angle alone, thighs come through the cloth; by the sine alone, it tears in kicks
    share = (smoothstep(sine, -1.0, 1.0) + smoothstep(np.arcsin(sine), -np.pi / 2, np.pi / 2)) / 2
    mixed = (
        share[None, :, None] * sides[0][:, None] + (1 - share)[None, :, None] * sides[1][:, None]
    )
    return np.asarray(mixed.reshape(-1, body.weights.shape[1]))


def _largest(weights: FloatArray, names: Sequence[str]) -> tuple[FloatArray, IntArray]:
    """The four largest weights (n, 4) of each row of (n, B), and their bones (n, 4).

    One bone of each group of `_AS_ONE` takes the weight of the group. Otherwise cloth between the
    legs has more than four bones, neighboring rows drop different ones, and the cloth tears between
    them.
    """
    weights = weights.copy()
    for group in _AS_ONE:
        first, *others = (names.index(name) for name in group)
        weights[:, first] += weights[:, others].sum(axis=1)
        weights[:, others] = 0.0
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    four = np.take_along_axis(weights, bones, axis=1)
    return four / four.sum(axis=1, keepdims=True), bones


def _rows_of_cloth(surface: Surface, posed: FloatArray, below: BoolArray) -> int:
    """Number of rows, from the top, down to which the surface is filled between the legs; `posed`
    (R, C, 3), and `below` (R,) the rows below the crotch."""
    middle = posed.mean(axis=1)
    flat = face_normals(surface.vertices, np.asarray(surface.faces, np.int64))
    filled = (
        RayScene(surface.vertices, surface.faces).crossings(np.asarray(middle, np.float32), flat)
        > 0
    )
    last, missing = int(below.argmax()), 0
    for row in range(last, len(filled)):
        missing = 0 if filled[row] else missing + 1
        if missing >= _BREAK:
            break
        if filled[row]:
            last = row
    return last + 1


def _observed(
    surface: Surface, posed: FloatArray, faces: IntArray, body: Body
) -> tuple[FloatArray, BoolArray]:
    """Displacements (n,) of the posed hull (n, 3) along its normals to the surface, and which of
    them (n,) are known."""
    from scipy.spatial import cKDTree

    normals = vertex_normals(posed, faces).astype(np.float64)
    scene = RayScene(surface.vertices, surface.faces)
    hits = scene.cast(
        np.asarray(posed - _START * normals, np.float32), np.asarray(normals, np.float32)
    )
    flat = face_normals(surface.vertices, np.asarray(surface.faces, np.int64))
    met = flat[np.where(hits.hit, hits.face, 0)]
    offset = np.where(hits.hit, hits.distance - _START, 0.0)
    arms = body.vertices[
        on_parts(
            body.parts,
            *(f"{side}_{part}" for side in ("left", "right") for part in ("hand", "lower_arm")),
        )
    ]
    away = cKDTree(arms).query(posed + offset[:, None] * normals, workers=1)[0]
    known = (
        hits.hit
        & ((met * normals).sum(axis=1) > 0.1)
        & (offset < _MOST)
        & (offset > -_START / 2)
        & (away > 0.04)
    )
    return np.where(known, offset, 0.0), known


def _hem(found: FloatArray, known: BoolArray, rows: int) -> int:
    """Number of `rows` down to the hem, where the surface steps back to the legs; `found` and
    `known` (rows C,) as in `_observed`."""
    wide = np.where(known, found, np.nan).reshape(rows, COLUMNS)
    first, most = int(np.ceil(_LEAST / _ROW)), 0.0
    for row in range(first, rows):
        told = wide[row][np.isfinite(wide[row])]
        if len(told) < COLUMNS // 8:
            continue
        now = float(np.median(told))
        if most > _STEPS[0] and now < _STEPS[1] * most:
            return row - 1
        most = max(most, now)
    return rows


def _tube(rows: int) -> IntArray:
    """Faces (f, 3) of an open tube of `rows` rows, oriented outwards."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(COLUMNS), indexing="ij")
    one, two = row * COLUMNS + column, row * COLUMNS + (column + 1) % COLUMNS
    below, beside = one + COLUMNS, two + COLUMNS
    return np.concatenate(
        [
            np.stack([one, below, two], axis=-1).reshape(-1, 3),
            np.stack([two, below, beside], axis=-1).reshape(-1, 3),
        ]
    )
