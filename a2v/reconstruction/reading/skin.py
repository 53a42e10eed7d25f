"""Skin in the photo: its tone in the face, and what is like it."""

from __future__ import annotations

import numpy as np

from a2v.geometry.colors import lab_of_bytes
from a2v.reconstruction.palettes import lab_of
from a2v.reconstruction.reading.shown import STEP
from a2v.types import BoolArray, FloatArray, Subject

_HUES = (25.0, 85.0)
"""Range of the hue of skin, degrees in CIELAB: reddish to yellow."""
_CHROMA = 8.0
"""Smallest chroma of skin, CIELAB units: gloves, hair and masks are grayer."""
_WEIGHTS = np.array([0.35, 1.0, 1.0])
"""Weights of lightness, a and b: the light on hands differs from that on the face."""
_LIKE = 15.0
"""Largest distance of skin from the color of the face, CIELAB units."""
_FEW = 40
"""Smallest number of vertices of hands that give the color of skin."""
_LEAST = 10
"""Smallest number of colors of skin that give a tone."""
_SHARE = 0.25
"""Smallest share of them."""


def is_skin(lab: FloatArray) -> BoolArray:
    """Return which CIELAB colors (..., 3) have a hue of skin."""
    hue = np.degrees(np.arctan2(lab[..., 2], lab[..., 1]))
    colored = np.hypot(lab[..., 1], lab[..., 2]) > _CHROMA
    return np.asarray((hue > _HUES[0]) & (hue < _HUES[1]) & colored)


def like_skin(lab: FloatArray, tone: FloatArray) -> BoolArray:
    """Return which CIELAB colors (..., 3) are like a tone (3,), in any light."""
    return np.asarray(np.linalg.norm((lab - tone) * _WEIGHTS, axis=-1) < _LIKE)


def tone_of(lab: FloatArray) -> FloatArray | None:
    """Return the tone (3,) of the lighter half of the CIELAB colors (n, 3) that are skin; None if
    there are few.

    The darker half is hair and shadow.
    """
    skin = lab[is_skin(lab)]
    if len(skin) < _LEAST or len(skin) < _SHARE * len(lab):
        return None
    return np.asarray(np.median(skin[skin[:, 0] >= np.median(skin[:, 0])], axis=0))


def face_tone(subject: Subject) -> FloatArray | None:
    """Return the tone (3,), CIELAB, of the face in the photo; None if that is not visible."""
    import cv2

    if subject.face is None:
        return None
    height, width = (side // STEP for side in subject.mask.shape)
    small = cv2.resize(subject.image, (width, height), interpolation=cv2.INTER_AREA)
    column, row = (subject.face[:, :2] / STEP).astype(np.int64).T
    pixels = small[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
    return tone_of(lab_of(pixels / 255.0))


def photo_and_tone(
    subject: Subject, shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray] | None:
    """The photo (h, w, 3) at every `STEP`-th pixel and the tone (3,) of the face, CIELAB; None if
    this is not visible."""
    import cv2

    tone = face_tone(subject)
    if tone is None:
        return None
    small = cv2.resize(subject.image, shape[::-1], interpolation=cv2.INTER_AREA)
    return lab_of_bytes(np.asarray(small)), tone


def within_mask(subject: Subject, shape: tuple[int, ...]) -> BoolArray:
    """Pixels (h, w) of a smaller picture that lie inside of the person's mask."""
    import cv2

    small = cv2.resize(subject.mask.astype(np.float32), shape[::-1], interpolation=cv2.INTER_AREA)
    return np.asarray(small > 0.9)


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


def skin_of_hands(colors: FloatArray) -> FloatArray | None:
    """Return the color (3,) of the skin from the colors of the hands (n, 3), sRGB in [0, 1]; None
    if these are too few, or the color of gloves."""
    if len(colors) < _FEW:
        return None
    color = np.median(colors, axis=0)
    return color if is_skin(lab_of(color)) else None
