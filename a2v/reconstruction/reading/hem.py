"""Find the hem of a skirt on legs that are together: there is no gap between the legs, but bare
legs below one piece of cloth."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS, on_parts
from a2v.body.spots import rest_vertices
from a2v.geometry.colors import lab_of_bytes, lightness_of_bytes
from a2v.reconstruction.reading.shown import STEP, body_shown, pixels_beside
from a2v.reconstruction.reading.skin import face_tone
from a2v.types import Body, BoolArray, ByteArray, Camera, FloatArray, IntArray, Subject

_ALONG = np.linspace(0.3, 1.75, 88)
"""Places along both legs at which the photo is sampled: 0 at the hip, 1 at the knee, 2 at the
ankle."""
_CLOTH = 0.5
"""Place up to which legs give the colors of the cloth."""
_ACROSS = 0.025
"""Distance beside the axis of a leg within which pixels are sampled, meters."""
_LIGHT = 0.15
"""Weight of lightness: legs lie in the shadow of a skirt."""
_HUES = (60.0, 8.0)
"""Weight of a and b, which fade in the shadow, too: the first value divided by the sum of lightness
and the second."""
_SKIN = 20.0
"""Largest distance of the color of a leg from the skin of the face, in units of `_stuff`."""
_CLEAR = 10.0
"""Difference, in units of `_stuff`, from which on a color is surely skin or surely cloth."""
_RIGHT = 0.85
"""Smallest share of cloth above a hem, and of skin below it."""
_BARE = 6
"""Smallest number of places sampled below the hem."""
_LOWEST = 1.6
"""Place below which a hem belongs to trousers."""
_UNEVEN = 0.14
"""Largest difference of height between the hems of both legs, meters: above a raised knee it slides
up."""
_OVER = (0.03, 0.08)
"""Range of heights above the hem in which the cloth between both legs is sampled, meters."""
_APART = 0.04
"""Distance of the axes of the legs below which there is nothing between them, meters."""
_ALIKE = 14.0
"""Largest distance of the color between the legs from that of their cloth, in units of `_stuff`."""
_FILLED = 0.9
"""Smallest share of the samples between the legs with such a color."""
_SEAM = 6.0
"""Difference in lightness, CIELAB, of the shadow between the legs of shorts."""
_LINE_ABOVE = 0.02
"""Height above the end of the cloth at which a line between the legs ends, meters."""
_LINE_WITHIN = (0.3, 0.7)
"""Range of such a line between the axis of the left leg (0) and that of the right leg (1)."""
_LINE_COLUMNS = 25
"""Number of places across this range."""
_LINE_SIDES = (0.02, 0.03)
"""Distances of the pixels on both sides of a line with which it is compared, meters."""
_LINE_BLUR = 0.003
"""Standard deviation of the blur of the photo, against noise, meters."""
_LINE_BLACK = 10.0
"""Lightness that is added to that of a line, so that noise in black cloth is no line, CIELAB."""
_LINE_DEPTH = 0.15
"""Smallest difference in lightness between a line and its sides, as a share of its lightness."""
_LINE_SHARE = 0.7
"""Share of the heights with a line above which the legs part."""
_FLARE = 0.05
"""Smallest distance of the outline of a flared skirt from the legs, meters."""
_FLARE_ABOVE = 0.04
"""Height above the end of the cloth at which it is found, meters."""
_FLARE_BAND = 0.02
"""Height above and below within which the skin gives the sides of the legs, meters."""
_LEGS = ("left_thigh", "right_thigh", "left_shin", "right_shin")
_LEAST_HEIGHTS = 6
"""Smallest number of heights at which there may be a line."""


def skirt_hem(subject: Subject, body: Body, camera: Camera) -> tuple[float, float] | None:
    """Find the height at rest, meters, of the hem of a skirt above bare legs, and of its lowest
    point.

    None if there is no such hem, or the photo does not show it. Down both legs the photo changes
    from cloth to the color of the face's skin. Just above, between the legs, there is cloth without
    the gap or the shadow of two trouser legs. Shorts whose legs touch can be like that, too
    (`line_between_legs`).
    """

    tone = face_tone(subject)
    if tone is None:
        return None
    lab = lab_of_bytes(subject.image)
    posed, rest = _axes(body)
    shown = _legs_shown(body, camera, subject)
    asked = [_colors(lab, shown, camera, points) for points in posed]
    cloth = np.concatenate([colors[(_ALONG[places] < _CLOTH)] for colors, places in asked])
    if len(cloth) < _BARE:
        return None
    palette = cloth[:: max(1, len(cloth) // 60)]
    found = [_hem(_skin_evidence(colors, tone, palette), places) for colors, places in asked]
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


def rest_height(body: Body, along: float) -> float:
    """Return the height at rest, meters, of a place on the legs: 0 at the hip, 1 at the knee, 2 at
    the ankle."""
    _, rest = _axes(body)
    return float(np.mean([np.interp(along, _ALONG, axis[:, 1]) for axis in rest]))


def _axes(body: Body) -> tuple[list[FloatArray], list[FloatArray]]:
    """Points (n, 3) at `_ALONG` on the axes of the left and the right leg, posed and at rest."""
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
    """Return which pixels (h, w), every `STEP`-th, show legs with nothing in front of them."""
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
    """Median colors (n, 3) across a leg at the visible places of its axis (88, 3), and the indices
    (n,) of these places."""
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


def _skin_evidence(colors: FloatArray, tone: FloatArray, palette: FloatArray) -> FloatArray:
    """Return the evidence (n,) that colors (n, 3) are skin.

    It is 1 for the `tone` (3,) of the skin and -1 for the colors of the cloth (m, 3). Shaded skin,
    which is about as far from both, counts little.
    """
    to_skin = np.linalg.norm(_stuff(colors) - _stuff(tone), axis=1)
    to_cloth = np.linalg.norm(_stuff(colors)[:, None] - _stuff(palette), axis=2).min(axis=1)
    return np.asarray(np.clip((np.minimum(to_cloth, _SKIN) - to_skin) / _CLEAR, -1.0, 1.0))


def _hem(skin: FloatArray, places: IntArray) -> float | None:
    """Place on a leg, in terms of `_ALONG`, at which the samples at `places` (n,) turn from cloth
    to skin. None if they do not.

    Parameters
    ----------
    skin : (n,) float
        Of `_skin_evidence`.
    """
    if (skin > 0).sum() < _BARE or (skin <= 0).sum() < _BARE:
        return None
    cut = int(np.cumsum(skin).argmin())  # most cloth above it, and most skin below it
    below = skin[cut + 1 :]
    bare = (
        max(_share(below), _share(below[: 3 * _BARE])) if len(below) >= _BARE else 0.0
    )  # stockings, shoes and shadows may follow
    if bare < _RIGHT or _share(-skin[: cut + 1]) < _RIGHT or _ALONG[places[cut]] > _LOWEST:
        return None
    return float(_ALONG[places[cut : cut + 2]].mean())


def _share(evidence: FloatArray) -> float:
    """Share of positive `evidence` (n,) in all of it."""
    return float(np.maximum(evidence, 0.0).sum() / max(float(np.abs(evidence).sum()), 1e-9))


def _filled(
    lab: FloatArray, camera: Camera, left: FloatArray, right: FloatArray, palette: FloatArray
) -> bool:
    """Return whether right above the hem, between its places on both axes (3,), there is cloth in
    the colors (m, 3) of the legs, and no shadow of two legs."""
    if np.linalg.norm(left - right) < _APART:
        return True
    colors = _strip(lab, camera, left, right)
    away = np.linalg.norm(_stuff(colors)[:, :, None] - _stuff(palette), axis=-1).min(axis=-1)
    return bool((away < _ALIKE).mean() > _FILLED and _shadow(colors) < _SEAM)


def line_between_legs(subject: Subject, body: Body, camera: Camera, lowest: float) -> bool:
    """Return whether the photo shows a line between both legs down to the height at rest `lowest`,
    meters. Then these are the legs of trousers or shorts.

    The line is a gap in the mask, or it is darker than both of its sides. It begins at the crotch
    and runs near the middle between the axes of the legs. A fold of a skirt is shorter.
    """
    from scipy.ndimage import uniform_filter1d

    posed, rest = _axes(body)
    above = np.mean([axis[:, 1] for axis in rest], axis=0) > lowest + _LINE_ABOVE
    left, right = (axis[above] for axis in posed)
    across = (right - left)[:, None]
    width = np.linalg.norm(across, axis=2, keepdims=True)
    unit = across / np.maximum(width, 1e-9)
    middle = left[:, None] + np.linspace(*_LINE_WITHIN, _LINE_COLUMNS)[None, :, None] * across
    shown = _legs_shown(body, camera, subject)
    beside = [(middle - away * unit, middle + away * unit) for away in _LINE_SIDES]
    every = np.concatenate([middle, *(one for both in beside for one in both)], axis=None)
    lightness = _lightness(subject.image, camera, every.reshape(-1, 3))
    here = _pixels(lightness, camera, middle)
    sides = [np.minimum(*(_pixels(lightness, camera, one) for one in both)) for both in beside]
    line = (np.max(sides, axis=0) - here) / (here + _LINE_BLACK)
    line = np.where(_pixels(subject.mask, camera, middle) < 0.5, 1.0, line)
    seen = (width[:, 0, 0] > _APART) & (_pixels(shown, camera, middle, STEP).mean(axis=1) > 0.8)
    if seen.sum() < _LEAST_HEIGHTS:
        return False
    found = _along_line(uniform_filter1d(line, 3, axis=0, mode="nearest")[seen])
    return bool((found > _LINE_DEPTH).mean() > _LINE_SHARE)


def flares(subject: Subject, body: Body, camera: Camera, end: float) -> bool:
    """Return whether the outline above the end of the cloth, at the height at rest `end`, meters,
    is far from the legs on both sides. Legs of trousers do not flare so much."""
    skin = rest_vertices(body)
    legs = on_parts(body.parts[: len(skin)], *_LEGS)
    band = legs & (np.abs(skin[:, 1] - end - _FLARE_ABOVE) < _FLARE_BAND)
    pixels = camera.project(body.vertices[: len(skin)][band])
    found = []
    mask = subject.mask > 0.5
    for sign, column in ((-1, pixels[:, 0].min()), (1, pixels[:, 0].max())):
        row = int(np.clip(pixels[np.abs(pixels[:, 0] - column).argmin(), 1], 0, len(mask) - 1))
        start = int(np.clip(column, 0, mask.shape[1] - 1))
        found.append(pixels_beside(mask, row, start, sign) or 0)
    return min(found) > _FLARE * camera.scale


def _pixels(
    picture: FloatArray | BoolArray, camera: Camera, points: FloatArray, step: int = 1
) -> FloatArray:
    """Values (n, m, ...) of a picture (h, w, ...), of which every `step`-th pixel is given, at
    points (n, m, 3)."""
    pixels = np.floor(camera.project(points.reshape(-1, 3)) / step).astype(np.int64)
    column, row = np.clip(pixels, 0, np.array(picture.shape[1::-1]) - 1).T
    return np.asarray(picture[row, column], np.float64).reshape(
        points.shape[:2] + picture.shape[2:]
    )


def _lightness(image: ByteArray, camera: Camera, points: FloatArray) -> FloatArray:
    """CIELAB lightness (H, W) of a photo, blurred by `_LINE_BLUR`, in the part of it that has the
    `points` (n, 3); 0 elsewhere."""
    from scipy.ndimage import gaussian_filter

    result = np.zeros(image.shape[:2])
    if not len(points):
        return result
    sigma, size = _LINE_BLUR * camera.scale, np.array(image.shape[1::-1])
    reach = int(np.ceil(4 * sigma)) + 1  # the filter's
    pixels = np.clip(np.floor(camera.project(points)).astype(np.int64), 0, size - 1)
    low = np.maximum(pixels.min(axis=0) - reach, 0)
    high = pixels.max(axis=0) + reach + 1
    part = np.s_[low[1] : high[1], low[0] : high[0]]
    result[part] = gaussian_filter(lightness_of_bytes(image[part]), sigma)
    return result


def _along_line(values: FloatArray) -> FloatArray:
    """Values (n,) of (n, m) along the line from the first row to the last one with the largest sum;
    it moves by at most one column per row, and values over twice `_LINE_DEPTH` count no more."""
    gain = np.clip(values, 0.0, 2 * _LINE_DEPTH)
    total, turns = gain[0], []
    for row in gain[1:]:
        sides = np.pad(total, 1, constant_values=-np.inf)
        ways = np.stack([sides[:-2], sides[1:-1], sides[2:]])
        turns.append(ways.argmax(axis=0) - 1)
        total = ways.max(axis=0) + row
    column = int(total.argmax())
    columns = [column]
    for turn in reversed(turns):
        column += int(turn[column])
        columns.append(column)
    return np.asarray(values[np.arange(len(values)), columns[::-1]])


def _strip(lab: FloatArray, camera: Camera, left: FloatArray, right: FloatArray) -> FloatArray:
    """Colors (5, 15, 3) from a point on the axis of the left leg (3,) to one on that of the right
    leg, at five heights `_OVER` them."""
    over = np.linspace(*_OVER, 5)[:, None, None] * np.array([0.0, 1.0, 0.0])
    return _pixels(lab, camera, left + np.linspace(0.0, 1.0, 15)[:, None] * (right - left) + over)


def _shadow(colors: FloatArray) -> float:
    """Difference in lightness between the ends of a strip (5, 15, 3) and its middle; a fold, which
    is narrow, counts little."""
    light = colors[..., 0].mean(axis=0)
    return float(min(light[:4].mean(), light[-4:].mean()) - np.sort(light[4:11])[1:4].mean())
