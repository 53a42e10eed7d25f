"""The hem of a skirt on legs that are together: no gap between them tells of cloth, but bare legs
come out of one piece of it."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS, on_parts
from a2v.reconstruction.canvas import STEP, body_shown
from a2v.reconstruction.limbs_seen import lit_skin
from a2v.types import Body, BoolArray, Camera, FloatArray, IntArray, Subject

_ALONG = np.linspace(0.3, 1.75, 88)
"""Where both legs are asked: 0 at the hip, 1 at the knee, 2 at the ankle."""
_CLOTH = 0.5
"""Up to here legs tell the colors of what they wear."""
_ACROSS = 0.025
"""So far beside a leg's axis, meters, pixels are asked."""
_LIGHT = 0.15
"""What lightness counts for: legs lie in the shadow of a skirt."""
_HUES = (60.0, 8.0)
"""And a and b, which fade in the shadow too: times the first, divided by lightness and the
second."""
_SKIN = 20.0
"""Colors so near to the face's skin, in units of `_stuff`, may be a leg's."""
_RIGHT = 0.85
"""So large a share of both sides of a hem is cloth above and skin below."""
_BARE = 6
"""At least so many places below it are asked."""
_LOWEST = 1.6
"""Farther down it is no hem of a skirt whose legs are together, but of trousers."""
_UNEVEN = 0.14
"""Hems of both legs lie at most so far apart along them, meters: above a raised knee it slides
up."""
_OVER = (0.03, 0.08)
"""The cloth between both legs is asked so far above the hem, meters."""
_APART = 0.04
"""Legs whose axes are nearer to each other there, meters, have nothing between them."""
_ALIKE = 14.0
"""What lies between has a color of the legs' cloth, in units of `_stuff`."""
_FILLED = 0.9
"""So large a share of it."""
_SEAM = 6.0
"""Between the legs of shorts lies a shadow: by so much less is the lightness there, CIELAB."""
_TROUSERS = (0.6, 0.9, 1.2)
"""Where trousers show it, in terms of `_ALONG`: a fold of a skirt does not run down the middle
everywhere."""


def skirt_hem(subject: Subject, body: Body, camera: Camera) -> tuple[float, float] | None:
    """Height at rest, meters, of the hem of a skirt out of which bare legs come, and of its lowest
    place; None where there is none, or the photo does not tell.

    Down both legs the photo turns from cloth to the face's skin, and right above, between the legs,
    there is cloth without the gap or the shadow of two trouser legs.
    """
    from skimage.color import rgb2lab

    if subject.face is None:
        return None
    lab = np.asarray(rgb2lab(subject.image), np.float64)
    column, row = np.rint(subject.face[:, :2]).astype(np.int64).T
    tone = lit_skin(lab[np.clip(row, 0, len(lab) - 1), np.clip(column, 0, lab.shape[1] - 1)])
    if tone is None:
        return None
    posed, rest = _axes(body)
    shown = _legs_shown(body, camera, subject)
    asked = [_colors(lab, shown, camera, points) for points in posed]
    cloth = np.concatenate([colors[(_ALONG[places] < _CLOTH)] for colors, places in asked])
    if len(cloth) < _BARE:
        return None
    palette = cloth[:: max(1, len(cloth) // 60)]
    found = [_hem(_is_skin(colors, tone, palette), places) for colors, places in asked]
    places = [place for place in found if place is not None]
    if len(places) < 2:
        return None
    hems = [
        float(np.interp(place, _ALONG, axis[:, 1]))
        for place, axis in zip(places, rest, strict=True)
    ]
    left, right = (
        np.array([np.interp(min(places), _ALONG, axis[:, k]) for k in range(3)]) for axis in posed
    )
    if abs(hems[0] - hems[1]) > _UNEVEN or not _filled(lab, camera, left, right, palette):
        return None
    return float(np.mean(hems)), min(hems)


def _axes(body: Body) -> tuple[list[FloatArray], list[FloatArray]]:
    """Places (n, 3) at `_ALONG` on the axes of the left and the right leg, posed and at rest."""
    result = []
    for transforms in (body.bone_transforms, body.rest_transforms):
        sides = []
        for letter in (".L", ".R"):
            joints = np.stack(
                [
                    transforms[body.bone_names.index(f"{bone}{letter}"), :3, 3]
                    for bone in ("upperleg01", "lowerleg01", "foot")
                ]
            )
            sides.append(
                np.stack(
                    [
                        np.interp(_ALONG, [0.0, 1.0, 2.0], joints[:, k].astype(np.float64))
                        for k in range(3)
                    ],
                    axis=1,
                )
            )
        result.append(sides)
    return result[0], result[1]


def _legs_shown(body: Body, camera: Camera, subject: Subject) -> BoolArray:
    """Which pixels (h, w), every `STEP`-th, show legs, and nothing before them."""
    shown = body_shown(body, subject, camera)
    near = on_parts(
        np.arange(len(PARTS)),
        "torso",
        *(f"{side}_{part}" for side in ("left", "right") for part in ("thigh", "shin", "foot")),
    )
    return np.asarray((shown < 0) | near[shown])


def _colors(
    lab: FloatArray, shown: BoolArray, camera: Camera, points: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Colors (n, 3), the medians across a leg, at those places (n,) of its axis (88, 3) that the
    photo shows."""
    pixels = camera.project(points)
    beside = np.linspace(-1, 1, 5)[:, None] * _ACROSS * camera.scale * np.array([1.0, 0.0])
    where = np.floor(pixels[:, None] + beside).astype(np.int64)
    inside = ((where >= 0) & (where < lab.shape[1::-1])).all(axis=2)
    column, row = np.clip(where, 0, np.array(lab.shape[1::-1]) - 1).transpose(2, 0, 1)
    high, wide = np.array(shown.shape) - 1
    good = inside & shown[np.minimum(row // STEP, high), np.minimum(column // STEP, wide)]
    places = np.flatnonzero(good[:, 2])
    return np.asarray(np.median(lab[row[places], column[places]], axis=1)), places


def _stuff(lab: FloatArray) -> FloatArray:
    """Features (..., 3) of CIELAB colors (..., 3) that change little between light and shadow."""
    scale = _HUES[0] / (lab[..., :1] + _HUES[1])
    return np.concatenate([_LIGHT * lab[..., :1], scale * lab[..., 1:]], axis=-1)


def _is_skin(colors: FloatArray, tone: FloatArray, palette: FloatArray) -> BoolArray:
    """Which colors (n, 3) are nearer to the skin's `tone` (3,) than to those of the cloth (m,
    3)."""
    to_skin = np.linalg.norm(_stuff(colors) - _stuff(tone), axis=1)
    to_cloth = np.linalg.norm(_stuff(colors)[:, None] - _stuff(palette), axis=2).min(axis=1)
    return np.asarray((to_skin < _SKIN) & (to_skin < to_cloth))


def _hem(skin: BoolArray, places: IntArray) -> float | None:
    """Where on a leg, in `_ALONG`'s terms, what is asked at `places` (n,) turns from cloth to skin;
    None where it does not."""
    if skin.sum() < _BARE or (~skin).sum() < _BARE:
        return None
    upto = np.cumsum(np.where(skin, 1, -1))  # skin above a cut less cloth above it
    cut = int(upto.argmin())
    below = skin[cut + 1 :]
    bare = (
        max(below.mean(), below[: 3 * _BARE].mean()) if len(below) >= _BARE else 0.0
    )  # stockings and shoes may come after it, and shadows
    if bare < _RIGHT or (~skin[: cut + 1]).mean() < _RIGHT or _ALONG[places[cut]] > _LOWEST:
        return None
    return float(_ALONG[places[cut : cut + 2]].mean())


def _filled(
    lab: FloatArray, camera: Camera, left: FloatArray, right: FloatArray, palette: FloatArray
) -> bool:
    """Whether right above the hem, between its places on both axes (3,), there is cloth of the
    legs' colors (m, 3), and no shadow of two legs."""
    if np.linalg.norm(left - right) < _APART:
        return True
    colors = _strip(lab, camera, left, right, _OVER)
    away = np.linalg.norm(_stuff(colors)[:, :, None] - _stuff(palette), axis=-1).min(axis=-1)
    return bool((away < _ALIKE).mean() > _FILLED and _shadow(colors) < _SEAM)


def shadow_between_legs(subject: Subject, body: Body, camera: Camera) -> bool:
    """Whether the photo shows a shadow down the middle between both legs: these are trousers,
    though nothing else lies between."""
    from skimage.color import rgb2lab

    lab, (posed, _) = np.asarray(rgb2lab(subject.image), np.float64), _axes(body)
    shadows = []
    for place in _TROUSERS:
        left, right = (
            np.array([np.interp(place, _ALONG, axis[:, k]) for k in range(3)]) for axis in posed
        )
        shadows.append(
            bool(np.linalg.norm(left - right) > _APART)
            and _shadow(_strip(lab, camera, left, right, (-0.03, 0.03))) > _SEAM
        )
    return all(shadows)


def _strip(
    lab: FloatArray,
    camera: Camera,
    left: FloatArray,
    right: FloatArray,
    heights: tuple[float, float],
) -> FloatArray:
    """Colors (5, 15, 3) from a place on the left leg's axis (3,) to one on the right leg's, so far
    above it, meters."""
    share = np.linspace(0.0, 1.0, 15)[:, None]
    rows = []
    for over in np.linspace(*heights, 5):
        pixels = np.floor(camera.project(left + share * (right - left) + [0.0, over, 0.0])).astype(
            np.int64
        )
        column, row = np.clip(pixels, 0, np.array(lab.shape[1::-1]) - 1).T
        rows.append(lab[row, column])
    return np.stack(rows)


def _shadow(colors: FloatArray) -> float:
    """By how much darker the middle of a strip (5, 15, 3) is than both its ends; a fold, which is
    narrow, counts little."""
    light = colors[..., 0].mean(axis=0)
    return float(min(light[:4].mean(), light[-4:].mean()) - np.sort(light[4:11])[1:4].mean())
