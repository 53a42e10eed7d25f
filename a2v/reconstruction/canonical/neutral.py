"""Paint the model's own face in the person's skin and hair color, where the photo has no face that
can be used."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from a2v.animation.expressions import BLINK
from a2v.body.face import points_on_face
from a2v.body.parts import on_parts
from a2v.body.spots import Spots
from a2v.geometry.images import nearest_known, sample_image
from a2v.geometry.mesh import within
from a2v.geometry.rays import texels
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.backs.seen import HANDS
from a2v.reconstruction.canonical.mean_face import EXTENT, mean_face
from a2v.reconstruction.face.colors import EYE, face_paint
from a2v.reconstruction.face.places import (
    BROWS,
    LEFT_EYE,
    LEFT_IRIS,
    RIGHT_EYE,
    RIGHT_IRIS,
)
from a2v.reconstruction.palettes import lab_of
from a2v.reconstruction.reading.skin import is_skin, skin_of_hands
from a2v.types import BoolArray, ByteArray, Face, FloatArray, Surface

SKIN = np.array([0.76, 0.58, 0.48])
"""Color of skin if the photo shows none, sRGB."""
HAIR = np.array([0.20, 0.15, 0.12])
"""Color of hair if the photo shows none, sRGB."""
_FEW = 40
"""Smallest number of visible vertices that give a color."""
_UNLIKE = 18.0
"""Smallest distance of the color of hair from that of the skin, CIELAB units."""
_FADE = 0.012
"""Distance from the rim of the face over which its colors fade into those around it, meters."""
_SIZE = 640
"""Width of the drawing of the face, pixels."""
_BROW = 0.55
"""Share of the color of the hair in the brows."""
_BROW_SOFT = 6.0
"""Width of their borders, pixels of the drawing."""
_IRIS = np.array([0.32, 0.22, 0.15])
"""Color of the irises, sRGB."""
_WHITE = np.array([0.86, 0.84, 0.82])
"""Color of the white of the eyes, sRGB."""
_PUPIL = np.array([0.10, 0.07, 0.06])
"""Color of the pupils, sRGB."""
_LID = 0.002
"""Way of the skin in a blink from which on it belongs to the lids, meters."""
_AROUND = 40
"""Number of vertices around one that smooth the hairline."""


def with_neutral_face(surface: Surface, spots: Spots, *, whole: bool) -> Surface:
    """Paint the head of a canonical person in the colors of skin and hair that the photo shows
    elsewhere. Unless it is the `whole` head, where hair grows it keeps its colors.

    Parameters
    ----------
    surface : Surface
        Colored, with `standing` and `face`.
    spots : Spots
        Of its vertices.
    """
    face, standing = surface.face, surface.standing
    assert face is not None
    assert standing is not None
    skin, hair = skin_and_hair(surface, spots)
    rest = standing.vertices.astype(np.float64)
    points = points_on_face(rest)
    middle = points[:, :2].mean(axis=0)
    scale = _SIZE / EXTENT
    places = (points[:, :2] - middle) * [1, -1] * scale + _SIZE / 2
    drawn, eyed = _drawing(places, skin, hair)
    drawn_at = np.column_stack([places, points[:, 2] * scale]).astype(np.float32)
    front = dataclasses.replace(
        surface,
        vertices=standing.vertices,
        face=dataclasses.replace(face, landmarks=drawn_at),
    )
    paint = face_paint(front, eyed)
    assert paint is not None
    pixels = (rest[:, :2] - middle) * [1, -1] * scale + _SIZE / 2
    grown = _smoothed(spots.scalp, rest)[:, None] * whole
    base = grown * hair + (1 - grown) * skin
    on_face = _on_face(rest, face)
    colors = np.array(surface.colors, np.float64)
    own = _smoothed(on_parts(spots.parts, "head") & (whole | ~spots.scalp), rest)
    inside = (on_face * ~_lids(face, len(rest)))[:, None]
    full = inside * sample_image(drawn, pixels) + (1 - inside) * base
    full[paint.inner] = paint.colors
    own[paint.inner] = 1.0
    eyes = paint.kinds == EYE
    full[eyes] = sample_image(paint.eyes, pixels[eyes])
    own[eyes] = 1.0
    colors += own[:, None] * (full - colors)
    made = dataclasses.replace(surface, colors=np.clip(colors, 0, 1).astype(np.float32))
    if surface.texture is None or surface.uv is None:
        return made
    faces = np.asarray(surface.faces, np.int64)
    chosen = np.flatnonzero((own[faces] > 0).any(axis=1))
    size = surface.texture.shape[0]
    texel, weights = texels(surface.uv[chosen].astype(np.float64) * size, size)
    rows, columns = np.nonzero(texel >= 0)
    corner, weight = faces[chosen[texel[rows, columns]]], weights[rows, columns][..., None]
    at, kinds = within(pixels, corner, weight), paint.kinds[corner].max(axis=1)[:, None]
    share = within(inside, corner, weight)
    sharp = share * sample_image(drawn, at) + (1 - share) * within(base, corner, weight)
    sharp = np.where(kinds == EYE, sample_image(paint.eyes, at), sharp)
    sharp = np.where(kinds > EYE, within(full, corner, weight), sharp)
    old = surface.texture[rows, columns] / 255.0
    mixed = old + within(own[:, None], corner, weight) * (sharp - old)
    texture = np.array(surface.texture)
    texture[rows, columns] = np.clip(255 * mixed + 0.5, 0, 255).astype(np.uint8)
    return dataclasses.replace(made, texture=_padded(texture, texel >= 0))


def skin_and_hair(surface: Surface, spots: Spots) -> tuple[FloatArray, FloatArray]:
    """The colors (3,) of a person's skin and hair, by what the photo shows: the face, else the
    hands; the scalp. Without any they are `SKIN` and `HAIR`."""
    colors = np.asarray(surface.colors, np.float64)
    seen: BoolArray = (
        np.ones(len(colors), bool) if surface.visible is None else np.asarray(surface.visible)
    )
    skin = None
    cheeks = colors[seen & spots.bare]
    if len(cheeks) >= _FEW and is_skin(lab_of(np.median(cheeks, axis=0))):
        lit = cheeks.sum(axis=1)
        skin = np.median(cheeks[lit >= np.median(lit)], axis=0)
    if skin is None:
        skin = skin_of_hands(colors[seen & on_parts(spots.parts, *HANDS)])
    if skin is None:
        skin = SKIN
    scalp = colors[seen & spots.scalp & on_parts(spots.parts, "head")]
    scalp = scalp[np.linalg.norm(lab_of(scalp) - lab_of(skin), axis=1) > _UNLIKE]
    hair = np.median(scalp, axis=0) if len(scalp) >= _FEW else HAIR
    return np.asarray(skin), np.asarray(hair)


def _on_face(rest: FloatArray, face: Face) -> FloatArray:
    """Weight (V,) of the painted face: 1 on it, 0 outside of it and at its rim."""
    from scipy.spatial import cKDTree

    own = np.zeros(len(rest), bool)
    own[face.patch] = True
    weight = np.zeros(len(rest))
    away = cKDTree(rest[~own]).query(rest[own], workers=1)[0]
    weight[own] = smoothstep(away, 0.0, _FADE)
    return weight


def _lids(face: Face, count: int) -> BoolArray:
    """Return which of `count` vertices belong to the lids, which lie folded behind the brow."""
    own = np.zeros(count, bool)
    for name in BLINK:
        moved, offsets = face.target(name)
        own[moved[np.linalg.norm(offsets, axis=1) > _LID]] = True
    return own


def _smoothed(chosen: BoolArray, rest: FloatArray) -> FloatArray:
    """Share (V,) of chosen vertices (V,) around each one, so that a border is no zigzag."""
    from scipy.spatial import cKDTree

    near = cKDTree(rest).query(rest, k=_AROUND, workers=1)[1]
    return np.asarray(smoothstep(chosen[near].mean(axis=1), 0.2, 0.8))


def _drawing(
    places: FloatArray, skin: FloatArray, hair: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Front views of the face without and with eyes (S, S, 3) float32, sRGB in [0, 1], with
    landmarks at `places` (478, 2), pixels. Eyeballs have the second one."""
    picture = np.asarray(mean_face(places, skin, _SIZE), np.float64)
    brow = _BROW * hair + (1 - _BROW) * skin
    for half in (BROWS[:10], BROWS[10:]):
        picture = _filled(picture, _hull(places[list(half)]), brow, soft=_BROW_SOFT)
    eyed = picture
    for opening, iris in ((RIGHT_EYE, RIGHT_IRIS), (LEFT_EYE, LEFT_IRIS)):
        lids = places[list(opening)]
        inside = _filled(eyed, lids, _WHITE, soft=0.7)
        # the model's landmarks of the irises are high: it looks up
        middle = np.array([places[iris[0], 0], lids[:, 1].mean()])
        radius = float(np.linalg.norm(places[list(iris[1:])] - places[iris[0]], axis=1).mean())
        for color, size in ((0.6 * _IRIS, 1.0), (_IRIS, 0.88), (_PUPIL, 0.42)):
            inside = _filled(inside, _circle(middle, size * radius), color, soft=0.7)
        eyed = _lashes(_mixed(eyed, inside, lids, soft=0.7), lids, 0.3 * skin)
    return np.asarray(picture, np.float32), np.asarray(eyed, np.float32)


def _lashes(picture: FloatArray, lids: FloatArray, color: FloatArray) -> FloatArray:
    """Draw the upper border of the opening of an eye (16, 2)."""
    import cv2

    line = np.zeros(picture.shape[:2], np.uint8)
    upper = np.round(16 * np.concatenate([lids[8:], lids[:1]])).astype(np.int32)
    cv2.polylines(line, [upper], False, 255, 3, cv2.LINE_AA, 4)
    share = cv2.GaussianBlur(line.astype(np.float32) / 255, (0, 0), 0.8)[..., None]
    return np.asarray(picture + share * (color - picture))


def _filled(
    picture: FloatArray, outline: FloatArray, color: FloatArray, *, soft: float
) -> FloatArray:
    """Fill an outline (n, 2), pixels, with a border that is `soft` pixels wide."""
    return _mixed(picture, np.broadcast_to(color, picture.shape), outline, soft=soft)


def _mixed(
    picture: FloatArray, other: FloatArray, outline: FloatArray, *, soft: float
) -> FloatArray:
    """The other picture inside an outline (n, 2)."""
    import cv2

    region = np.zeros(picture.shape[:2], np.uint8)
    cv2.fillPoly(region, [np.round(16 * outline).astype(np.int32)], 255, cv2.LINE_AA, 4)
    share = cv2.GaussianBlur(region.astype(np.float32) / 255, (0, 0), soft)[..., None]
    return np.asarray(picture + share * (other - picture))


def _hull(points: FloatArray) -> FloatArray:
    import cv2

    return np.asarray(cv2.convexHull(points.astype(np.float32))[:, 0], np.float64)


def _circle(middle: FloatArray | Sequence[float], radius: float) -> FloatArray:
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    return np.asarray(middle + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))


def _padded(texture: ByteArray, painted: BoolArray) -> ByteArray:
    """Give the texels beside the painted ones, in the padding of the charts, their colors."""
    import cv2

    rim = (cv2.dilate(painted.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0) & ~painted
    row, column = nearest_known(painted)
    texture[rim] = texture[row[rim], column[rim]]
    return texture
