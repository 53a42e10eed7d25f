"""Find long hair in the photo: hair beside the neck, from the ears down to the shoulders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.colors import lab_of_bytes
from a2v.reconstruction.palettes import clustered_colors, palette_distance
from a2v.reconstruction.reading.record import HairSeen
from a2v.reconstruction.reading.skin import face_tone
from a2v.types import Body, BoolArray, Camera, FloatArray, Subject

SHADE = np.array([0.35, 1.0, 1.0])
"""Weights of lightness, a and b: hair shines, and lies in its own shadow."""
_BLUR = 0.004
"""Blur of the photo, meters."""
_CENTERS = 4
"""Number of typical colors of the hair, and of the clothes."""
_SHARE = 0.06
"""Smallest share of the pixels for a typical color."""
_ALIKE = 11.0
"""Largest distance of a pixel of hair from a typical color of the hair, CIELAB units."""
_SKIN = 0.85
"""A pixel of hair is nearer to the hair than this share of its distance from the skin."""
_GROWTH = 3
"""Rounds in which the colors of what was found are those of hair in the next round."""
_SHADES = 14.0
"""Largest distance of another shade of the hair from the colors of the crown, CIELAB units."""
_NEARER = 0.6
"""Largest ratio of this distance and that from the colors of the clothes."""
_FEW = 40
"""Smallest number of pixels on the crown."""
_BELOW = 0.33
"""Largest distance of hair below the chin, meters."""
_CLOTH = (0.06, 0.3)
"""Range below the shoulder joints in which the trunk shows the colors of the clothes, meters."""
_BESIDE = (0.035, 0.17)
"""Range beside the middle of the neck in which hair hangs, meters."""
_FROM_CHIN = 0.02
"""Height above the chin from which on hair beside the neck counts, meters."""
_DOWN = 0.05
"""Smallest distance below the chin to which it is looked for, meters."""
_TO_SHOULDER = 0.035
"""Height above the shoulder joints down to which it counts, meters."""
_WIDE = 0.018
"""Smallest width of hair beside the neck, meters."""
_ROWS = 0.5
"""Smallest share of the rows with such hair, on the side with more of it."""
_FREE = 0.3
"""Share of ends of hair over background or skin above which hair does not continue behind the
shoulders."""
_UNDER = 0.012
"""Distance below an end of hair at which the photo shows what is there, meters."""
_UPRIGHT = 35.0
"""Largest angle of the head from the vertical, degrees."""
_CHIN = 152
"""Landmark of the chin in mediapipe's face mesh."""
_FOREHEAD = 10
"""Landmark of the upper end of the forehead."""


@dataclass(frozen=True, eq=False)
class HeadColors:
    """Colors around a head in the upper h rows of the photo.

    Attributes
    ----------
    lab : (h, W, 3) float64
        The blurred photo, CIELAB.
    face : (478, 2) float64
        Landmarks of the face, pixels.
    outside : (h, W) bool
        Pixels of the person outside the face.
    from_skin : (h, W) float64
        Distance from the skin of the face, CIELAB units, weighted by `SHADE`.
    crown : (h, W) bool
        Pixels of hair, or of a hat, above the forehead.
    """

    lab: FloatArray
    face: FloatArray
    outside: BoolArray
    from_skin: FloatArray
    crown: BoolArray


def head_colors(
    subject: Subject, scale: float, *, rows: int, blur: float, middle: float | None = None
) -> HeadColors | None:
    """Return the colors around a head; None if the photo does not show the skin of its face.

    They are those of the upper `rows` rows of the photo, and of more if the face ends below. The
    colors of the whole photo would be the same there, and take several times as long.

    `scale` is in pixels per meter, `blur` in meters. The crown lies around the column `middle`;
    None: that of the face.
    """
    import cv2

    if subject.face is None:
        return None
    height, width = subject.mask.shape
    face = subject.face[:, :2].astype(np.float64)
    lowest = int(np.clip(np.rint(face[:, 1].max()), 0, height - 1))
    rows = min(max(rows, lowest + 1), height)
    mask, sigma = subject.mask[:rows] > 0.5, max(blur * scale, 0.1)
    # the blur reads the rows within four deviations
    image = subject.image[: rows + int(np.ceil(4 * sigma)) + 1]
    lab = lab_of_bytes(np.asarray(cv2.GaussianBlur(image, (0, 0), sigma)[:rows]))
    tone = face_tone(subject)
    if tone is None:
        return None
    row, columns = np.ogrid[:rows, :width]
    hull = np.zeros(mask.shape, np.uint8)
    cv2.fillConvexPoly(hull, cv2.convexHull(face.astype(np.int32)), 1)
    outside = mask & (hull == 0)
    from_skin = np.linalg.norm((lab - tone) * SHADE, axis=-1)
    crown = (
        outside
        & (row < face[_FOREHEAD, 1])
        & (np.abs(columns - (face[:, 0].mean() if middle is None else middle)) < 0.09 * scale)
        & (from_skin > _ALIKE)
    )
    return HeadColors(lab, face, outside, from_skin, crown)


def long_hair(subject: Subject, body: Body, camera: Camera) -> HairSeen | None:
    """Find long hair; None if the photo does not clearly show it.

    The colors above the forehead are those of the hair. Long hair is connected to them, and
    reaches along the neck down to the shoulders, where short hair leaves the background visible.
    """
    import cv2

    if subject.face is None:
        return None
    place = _Place.of(body, camera, subject.face[:, :2].astype(np.float64))
    if not place.upright:
        return None
    lowest = max(place.chin + _BELOW * camera.scale, place.shoulder + _CLOTH[1] * camera.scale)
    seen = head_colors(
        subject,
        camera.scale,
        rows=max(int(np.ceil(lowest + _UNDER * camera.scale)) + 2, 1),
        blur=_BLUR,
        middle=place.middle,
    )
    if seen is None:
        return None
    lab, outside, crown = seen.lab, seen.outside, seen.crown
    mask, far_from_skin = subject.mask[: len(lab)] > 0.5, seen.from_skin
    rows, columns = np.ogrid[: mask.shape[0], : mask.shape[1]]
    if crown.sum() < _FEW:
        return None
    first = typical_colors(lab[crown])
    like = palette_distance(lab, first, SHADE)
    cloth = outside & (rows > place.shoulder + _CLOTH[0] * camera.scale)
    cloth &= (rows < place.shoulder + _CLOTH[1] * camera.scale) & (
        np.abs(columns - place.middle) < 0.13 * camera.scale
    )
    clothes = typical_colors(lab[cloth]) if cloth.sum() > _FEW else np.zeros((0, 3))
    if len(clothes):
        # hair on the chest gives typical colors of "clothes", too, and a hood those of "hair"
        main = np.median(lab[crown], axis=0)[None]
        clothes = clothes[palette_distance(clothes, main, SHADE) > _ALIKE]
    if len(clothes):
        hood = palette_distance(first, clothes, SHADE) < _ALIKE
        first = first if hood.all() else first[~hood]
    like_cloth = bool(cloth.sum() > _FEW and (like[cloth] < _ALIKE).mean() > 0.5)
    allowed = outside & (rows < place.chin + _BELOW * camera.scale)
    if like_cloth:
        allowed &= rows < place.shoulder - _TO_SHOULDER * camera.scale
    like_clothes = palette_distance(lab, clothes, SHADE) if len(clothes) else None
    face_row = float(seen.face[:, 1].mean())
    ears = (outside & (far_from_skin < _ALIKE) & (rows < place.chin)).astype(np.uint8)
    hair, found = first, crown
    # tips are lighter than roots, and both shades lie side by side; without the colors of clothes
    # a collar could be such a shade
    for number in range(_GROWTH if len(clothes) else 1):
        if number:
            shades = typical_colors(lab[found])
            own = palette_distance(shades, first, SHADE)
            alike = own < np.minimum(_SHADES, _NEARER * palette_distance(shades, clothes, SHADE))
            hair = np.concatenate([first, shades[alike]])
        before, like = found, palette_distance(lab, hair, SHADE)
        found = allowed & (like < _ALIKE) & (like < _SKIN * far_from_skin)
        if like_clothes is not None:
            found &= (like < like_clothes) | (rows < face_row)
        found = cv2.morphologyEx(found.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        _, label = cv2.connectedComponents(found | ears)  # an ear does not cut hair in two
        held = np.unique(label[crown & (found > 0)])
        found = (found > 0) & np.isin(label, held[held > 0])
        if not found.any():
            return None
        if number and (found == before).all():  # so is what would follow
            break
    neck = np.abs(columns - place.middle) < _BESIDE[0] * camera.scale
    found &= (rows < place.chin) | ~neck  # its shade has the color of hair
    if not _reaches_down(found, place, camera):
        return None
    bare = ~mask | (far_from_skin < _ALIKE)
    pixels = np.zeros(subject.mask.shape, bool)
    pixels[: len(found)] = found
    free = _ends_free(found, bare, place, camera)
    return HairSeen(pixels=pixels, like_cloth=like_cloth, free=free)


@dataclass(frozen=True)
class _Place:
    """Rows and columns of a head in the photo, pixels."""

    middle: float
    chin: float
    shoulder: float
    upright: bool

    @classmethod
    def of(cls, body: Body, camera: Camera, face: FloatArray) -> _Place:
        heads = {
            name: camera.project(body.bone_transforms[body.bone_names.index(name), None, :3, 3])[0]
            for name in ("neck01", "head", "upperarm01.L", "upperarm01.R")
        }
        head = body.bone_names.index("head")
        turn = body.bone_transforms[head, :3, :3] @ body.rest_transforms[head, :3, :3].T
        return cls(
            middle=float((heads["neck01"][0] + heads["head"][0]) / 2),
            chin=float(face[_CHIN, 1]),
            shoulder=float((heads["upperarm01.L"][1] + heads["upperarm01.R"][1]) / 2),
            upright=bool(turn[1, 1] > np.cos(np.radians(_UPRIGHT))),
        )


def _reaches_down(found: BoolArray, place: _Place, camera: Camera) -> bool:
    """Return whether hair lies beside the neck from the chin down to the shoulders, on at least one
    side."""
    low, high = (int(side * camera.scale) for side in _BESIDE)
    first = int(place.chin - _FROM_CHIN * camera.scale)
    last = int(max(place.shoulder - _TO_SHOULDER * camera.scale, place.chin + _DOWN * camera.scale))
    middle = int(place.middle)
    sides = []
    for window in (
        found[first:last, max(middle - high, 0) : max(middle - low, 0)],
        found[first:last, middle + low : middle + high],
    ):
        sides.append((window.sum(axis=1) > _WIDE * camera.scale).mean() if window.size else 0.0)
    return max(sides) > _ROWS


def _ends_free(found: BoolArray, bare: BoolArray, place: _Place, camera: Camera) -> bool:
    """Return whether many of the lower ends of hair beside the neck lie above `bare` (H, W) pixels:
    background or skin."""
    away = np.abs(np.arange(found.shape[1]) - place.middle) / camera.scale
    asked = found.any(axis=0) & (away > _BESIDE[0]) & (away < _BESIDE[1])
    low = len(found) - 1 - found[::-1].argmax(axis=0)
    asked &= low > place.chin - _FROM_CHIN * camera.scale
    columns = np.flatnonzero(asked)
    below = np.minimum(low[columns] + round(_UNDER * camera.scale), len(found) - 1)
    return bool(len(columns) and bare[below, columns].mean() > _FREE)


def typical_colors(lab: FloatArray) -> FloatArray:
    """Typical colors (n, 3) of CIELAB colors (N, 3)."""
    if len(lab) < 4 * _CENTERS or lab.std(axis=0).max() < 0.5:
        return np.asarray(np.median(lab, axis=0)[None])
    return clustered_colors(lab, _CENTERS, shade=SHADE, share=_SHARE, rounds=10)
