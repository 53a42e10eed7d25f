"""Skin in the photo: its tone in the face, and what is like it."""

from __future__ import annotations

import numpy as np

from a2v.reconstruction.palettes import lab_of
from a2v.types import BoolArray, FloatArray, Subject

_SKIN_HUES = (25.0, 85.0)
"""Range of the hue of skin, degrees in CIELAB: reddish to yellow."""
CHROMA = 8.0
"""Smallest chroma of skin, CIELAB units."""
_HUE = np.array([0.35, 1.0, 1.0])
"""Weights of lightness, a and b: the light on hands differs from that on the face."""
_LIKE = 15.0
"""Largest distance of skin from the color of the face, CIELAB units."""


def photo_and_skin(
    subject: Subject, shape: tuple[int, ...], step: int
) -> tuple[FloatArray, FloatArray] | None:
    """The photo (h, w, 3) at every `step`-th pixel and the skin (3,) of its face, CIELAB; None if
    this is not visible."""
    import cv2
    from skimage.color import rgb2lab

    if subject.face is None:
        return None
    small = cv2.resize(subject.image, shape[::-1], interpolation=cv2.INTER_AREA)
    lab = np.asarray(rgb2lab(small), np.float64)
    column, row = (subject.face[:, :2] / step).astype(np.int64).T
    tone = lit_skin(lab[np.clip(row, 0, shape[0] - 1), np.clip(column, 0, shape[1] - 1)])
    return None if tone is None else (lab, tone)


def within_mask(subject: Subject, shape: tuple[int, ...]) -> BoolArray:
    """Pixels (h, w) of a smaller picture that lie inside of the person's mask."""
    import cv2

    small = cv2.resize(subject.mask.astype(np.float32), shape[::-1], interpolation=cv2.INTER_AREA)
    return np.asarray(small > 0.9)


def like_skin(lab: FloatArray, tone: FloatArray) -> BoolArray:
    """Which colors (..., 3), CIELAB, are like a tone (3,), in any light."""
    return np.asarray(np.linalg.norm((lab - tone) * _HUE, axis=-1) < _LIKE)


def lit_skin(lab: FloatArray) -> FloatArray | None:
    """Return the tone (3,), CIELAB, of the lighter half of the colors (n, 3) with hues of skin;
    None if there are few.

    The darker half is hair and shadow.
    """
    hue = np.degrees(np.arctan2(lab[:, 2], lab[:, 1]))
    skin = lab[
        (hue > _SKIN_HUES[0]) & (hue < _SKIN_HUES[1]) & (np.hypot(lab[:, 1], lab[:, 2]) > CHROMA)
    ]
    if len(skin) < 10 or len(skin) < 0.25 * len(lab):
        return None
    return np.asarray(np.median(skin[skin[:, 0] >= np.median(skin[:, 0])], axis=0))


def head_box(
    subject: Subject, *, least: float = 0.3
) -> tuple[float, float, float, float, float] | None:
    """Left, top, right, chin and eye line of the head in the photo, pixels; None without a face's
    landmarks."""
    points = subject.keypoints
    eyes, mouth, sides = points[[2, 5]], points[[9, 10]], points[[7, 8]]
    if min(eyes[:, 2].min(), mouth[:, 2].min()) < least:
        return None
    eye_line = float(eyes[:, 1].mean())
    drop = float(mouth[:, 1].mean()) - eye_line
    # in profile the landmarks of the face are close together, so its height is a safer measure than
    # its width
    unit = max(drop, 0.5 * float(np.ptp(sides[:, 0])), 1.0)
    rows = np.nonzero(subject.mask.max(axis=1) > 0.5)[0]
    middle = float(np.concatenate([eyes, sides])[:, 0].mean())
    top = max(float(rows[0]) if len(rows) else 0.0, eye_line - 4.0 * unit)
    return middle - 2.0 * unit, top, middle + 2.0 * unit, eye_line + 2.1 * unit, eye_line


def seen_face(
    subject: Subject,
    pixels: FloatArray,
    colors: FloatArray,
    *,
    known: BoolArray,
    head: BoolArray | None,
) -> tuple[BoolArray, FloatArray | None]:
    """Find the vertices (V,), at `pixels` (V, 2), in the face, and the color (3,) of its cheeks
    (None if they are not visible).

    `colors` (V, 3) are those of the photo at the vertices, `known` (V,) the visible vertices,
    `head` (V,) those of head and neck.
    """
    none, box = np.zeros(len(pixels), bool), head_box(subject)
    ahead = subject.keypoints_3d[0, 2] - subject.keypoints_3d[[7, 8], 2].mean()
    if box is None or ahead < 0:  # landmarks of a face are also guessed on the back of a head
        return none, None
    left, _, right, chin, eye_line = box
    unit, across = (chin - eye_line) / 2.1, np.abs(pixels[:, 0] - (left + right) / 2)
    row = pixels[:, 1]
    face = known & (across < 1.4 * unit) & (row > eye_line - unit) & (row < chin + 0.1 * unit)
    face &= head if head is not None else True
    cheeks = face & (np.abs(row - eye_line - 0.65 * unit) < 0.35 * unit) & (across < unit)
    return face, np.median(colors[cheeks], axis=0) if cheeks.sum() >= 5 else None


def skin_like(color: FloatArray) -> bool:
    """Return whether a color (3,) may be that of a face. Hair and masks in front of the cheeks are
    too gray, and faces in green or blue light are too rare."""
    _, a, b = lab_of(color)
    return bool(np.hypot(a, b) > 5 and -10 < np.degrees(np.arctan2(b, a)) < 95)


def skin_of_hands(colors: FloatArray) -> FloatArray | None:
    """Return the color (3,) of the skin from the colors of the hands (n, 3).

    None if these are too few, or the color of gloves: skin is reddish to yellow.
    """
    if len(colors) < 40:
        return None
    color = np.median(colors, axis=0)
    _, a, b = lab_of(color)
    return color if np.hypot(a, b) > 8 and 25 < np.degrees(np.arctan2(b, a)) < 80 else None
