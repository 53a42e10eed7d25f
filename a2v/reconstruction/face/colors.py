"""Color the occluded parts of a face: the inside of the mouth, and the eyeballs under the lids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.face import gums
from a2v.face import FACE_KINDS
from a2v.geometry.images import sample_image
from a2v.reconstruction.face.places import LEFT_EYE, LEFT_IRIS, RIGHT_EYE, RIGHT_IRIS
from a2v.types import BoolArray, FloatArray, IntArray, Surface

EYE = FACE_KINDS.index("eye")
_DARK = np.array([0.17, 0.06, 0.06])
_TONGUE = np.array([0.66, 0.34, 0.33])
_TEETH = np.array([0.88, 0.85, 0.78])
_GUM = np.array([0.72, 0.4, 0.38])
_WHITE = np.array([0.84, 0.81, 0.79])
_LASHES = 0.04
"""Width of the border around the opening of an eye in which the eyeball keeps the colors of the
photo, in widths of the eye."""
_BALL = 1.2
"""Distance from the middle of an eye up to which its ball is painted, in widths of the eye. The
other eye begins at 1.5."""
_DEEP = 0.022
"""Distance behind the lips beyond which the mouth is dark, meters."""


@dataclass(frozen=True)
class FacePaint:
    """Colors of the face that the photo does not show.

    Attributes
    ----------
    kinds : (V,) int
        Index into `FACE_KINDS` of every vertex of the surface.
    inner : (n,) int
        Vertices behind the lips.
    colors : (n, 3)
        Their colors, sRGB in [0, 1].
    eyes : (H, W, 3) float32
        The photo with whole eyeballs, without lids.
    far : (V,) bool
        Vertices of the eyeball that a turned face hides.
    """

    kinds: IntArray
    inner: IntArray
    colors: FloatArray
    eyes: FloatArray
    far: BoolArray


def face_paint(surface: Surface, photo: FloatArray) -> FacePaint | None:
    """Color the face of a surface from the `photo` (H, W, 3), sRGB in [0, 1]; None for a surface
    without a face."""
    face = surface.face
    if face is None:
        return None
    points = face.landmarks[:, :2].astype(np.float64)
    kinds = np.zeros(len(surface.vertices), np.int64)
    kinds[face.patch] = face.kinds
    inner = np.flatnonzero(kinds > EYE)
    lip = np.clip(
        np.median(
            sample_image(
                photo,
                np.stack(
                    [
                        (points[a] + points[b]) / 2
                        for a, b in ((17, 14), (84, 87), (314, 317), (0, 13))
                    ]
                ),
            ),
            axis=0,
        ),
        0,
        1,
    )
    light = float(
        np.clip(sample_image(photo, points[[205, 425, 199]]).max(axis=1).mean() / 0.75, 0.45, 1.1)
    )
    depth = surface.vertices[kinds == 0][:, 2]
    lips = surface.vertices[face.patch[face.kinds == 2]][:, 2]
    front = float(lips.max()) if len(lips) else float(depth.max())
    share = np.clip((front - surface.vertices[inner, 2]) / _DEEP, 0, 1)[:, None]
    shaded = (1 - share) * lip * 0.8 + share * _DARK * light
    gum = np.zeros((len(surface.vertices), 1))
    gum[face.patch[face.kinds == FACE_KINDS.index("teeth")], 0] = gums()
    row = (1 - gum[inner]) * _TEETH + gum[inner] * _GUM
    tongue, row = (
        light * _TONGUE * (1 - 0.4 * share),
        light * ((1 - share) * row + share * (0.25 * row + _DARK)),
    )
    which = kinds[inner, None]
    colors = np.where(
        which == FACE_KINDS.index("mouth"),
        shaded,
        np.where(which == FACE_KINDS.index("tongue"), tongue, row),
    )
    return FacePaint(
        kinds,
        inner,
        np.clip(colors, 0, 1),
        _eyeballs(photo, points, light),
        _far_eye(surface, kinds == EYE),
    )


def _far_eye(surface: Surface, eyes: BoolArray) -> BoolArray:
    """Return which vertices (V,) of the `eyes` (V,) belong to the farther one of a turned face."""
    if not surface.provenance.get("turned_face") or surface.standing is None or not eyes.any():
        return np.zeros_like(eyes)
    across = surface.standing.vertices[:, 0]
    left = eyes & (across > across[eyes].mean())
    depth = surface.vertices[:, 2]
    nearer = depth[left].mean() > depth[eyes & ~left].mean()
    return np.asarray(eyes & ~left if nearer else left)


def _eyeballs(photo: FloatArray, points: FloatArray, light: float) -> FloatArray:
    """The photo with the whites and irises of both eyes extended beyond their lids."""
    made = np.array(photo, np.float32)
    eyes = points[[*RIGHT_EYE, *RIGHT_IRIS, *LEFT_EYE, *LEFT_IRIS]]
    # nothing farther than three widths of the eyes from them changes
    reach = 3 * float(np.ptp(eyes, axis=0).max()) + 8
    low = np.maximum(np.floor(eyes.min(axis=0) - reach), 0).astype(np.int64)
    high = np.maximum(np.ceil(eyes.max(axis=0) + reach), 0).astype(np.int64)
    window = (slice(low[1], high[1]), slice(low[0], high[0]))
    if made[window].size:
        made[window] = _with_eyeballs(made[window], points - low, light)
    return made


def _with_eyeballs(photo: FloatArray, points: FloatArray, light: float) -> FloatArray:
    """`_eyeballs` in a window of the photo around the eyes."""
    import cv2

    made = photo
    height, width = photo.shape[:2]
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    for opening, iris in ((RIGHT_EYE, RIGHT_IRIS), (LEFT_EYE, LEFT_IRIS)):
        corners = points[list(opening)]
        wide = float(np.linalg.norm(corners[0] - corners[8]))
        middle, radius = (
            points[iris[0]],
            float(np.linalg.norm(points[list(iris[1:])] - points[iris[0]], axis=1).mean()),
        )
        large = np.zeros((height, width), np.uint8)
        cv2.fillPoly(
            large,
            [np.round((corners - 0.5) * 16).astype(np.int32)],
            255,
            lineType=cv2.LINE_AA,
            shift=4,
        )
        within = cv2.GaussianBlur(
            cv2.erode(large.astype(np.float32) / 255, np.ones((2, 2))),
            (0, 0),
            max(0.5, 0.02 * wide),
        )
        away = np.hypot(columns - middle[0], rows - middle[1])
        color = _white(photo, (within > 0.6) & (away > 1.15 * radius), large > 64, light)
        dark = (within > 0.6) & (away < 0.9 * radius)
        of_iris = (
            np.median(photo[dark], axis=0) if dark.sum() >= 2 else np.array([0.25, 0.18, 0.14])
        )
        disc = np.clip((radius - away) / max(0.8, 0.15 * radius) + 0.5, 0, 1)[..., None]
        ball = disc * of_iris + (1 - disc) * color
        near = np.clip(
            5
            * (
                _BALL - np.hypot(columns - corners[:, 0].mean(), rows - corners[:, 1].mean()) / wide
            ),
            0,
            1,
        )[..., None]
        # Up to the lids: their lashes and shadow belong on the ball, which otherwise would show a
        # bright rim in the photo's eye.
        outside = cv2.distanceTransform(
            np.where(large > 127, 0, 255).astype(np.uint8), cv2.DIST_L2, 5
        )
        alpha = np.clip(1 - (outside - _LASHES * wide) / (2 * _LASHES * wide), 0, 1)[..., None]
        made = near * (alpha * made + (1 - alpha) * ball) + (1 - near) * made
    return np.asarray(made, np.float32)


def _white(photo: FloatArray, clear: BoolArray, opening: BoolArray, light: float) -> FloatArray:
    """Color (3,) of the white of an eye: of the brighter half of the `clear` (H, W) pixels; without
    any, of the opening."""
    pixels = photo[clear if clear.sum() >= 4 else opening]
    if not len(pixels):
        return light * _WHITE
    bright = pixels[np.argsort(pixels.sum(axis=1))[len(pixels) // 2 :]].mean(axis=0)
    return np.asarray(
        0.8 * bright + 0.2 * np.minimum(light * _WHITE, 1.5 * bright)
        if clear.sum() >= 4
        else bright
    )
