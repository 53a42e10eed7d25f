"""Draw the sheet of a photo: the character as photographed, in T-pose from four sides, in two
frames of motion; its head from five sides, with closed eyes and with an open mouth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.geometry.colors import to_bytes
from a2v.lab.evaluation.photos.made import HEAD_EXTENT, Made, turned
from a2v.types import ByteArray, FloatArray

SIDES: tuple[float, ...] = (0.0, 90.0, 180.0, 270.0)
"""Turns of the pictures of the T-pose, degrees."""
HEAD_SIDES: tuple[float, ...] = (0.0, 40.0, 90.0, 180.0, 270.0)
"""Turns of the pictures of the head, degrees."""
FRAME_TURN = 25.0
"""Turn of the pictures of frames, degrees."""
_WHITE = 255


def photo_sheet(made: Made, lines: Sequence[str], *, size: int = 280) -> ByteArray:
    """Draw a sheet (H, 8 size, 3): a row of bodies, a row of heads, and `lines` of text below."""
    shown = made.beside(size=2 * size)
    body = [
        _fitted(to_bytes(shown.image), size),
        _fitted(to_bytes(np.where(shown.shown[..., None], shown.colors, 0.92)), size),
        *(turned(made.t_pose(), side, size) for side in SIDES),
        *(turned(frame, FRAME_TURN, size) for frame in made.frames()),
    ]
    heads = [
        _head_in_photo(made, size),
        *(made.head(azimuth=side, size=size)[0] for side in HEAD_SIDES),
        *(made.head(size=size, expression=name)[0] for name in ("blink", "open mouth")),
    ]
    rows = [np.hstack(body), np.hstack(heads)]
    return np.vstack([*rows, _text(lines, rows[0].shape[1])])


def _head_in_photo(made: Made, size: int) -> ByteArray:
    """The square of the photo around the head of the character."""
    parts = np.asarray(made.character.parts)
    own = made.surface.vertices[: len(parts)][parts == 0]
    pixels = made.camera.project(own.astype(np.float64))
    middle = (pixels.min(axis=0) + pixels.max(axis=0)) / 2
    half = max(float(np.ptp(pixels, axis=0).max()) / 2, made.camera.scale * HEAD_EXTENT / 2)
    return _cut(made.subject.image, middle, half, size)


def _cut(image: ByteArray, middle: FloatArray, half: float, size: int) -> ByteArray:
    """A square of a photo around `middle` (2,), white beyond its borders."""
    import cv2

    scale = size / (2 * half)
    move = np.array(
        [[scale, 0, size / 2 - scale * middle[0]], [0, scale, size / 2 - scale * middle[1]]]
    )
    return np.asarray(
        cv2.warpAffine(image, move, (size, size), flags=cv2.INTER_AREA, borderValue=(_WHITE,) * 3)
    )


def _fitted(picture: ByteArray, size: int) -> ByteArray:
    """A picture in the middle of a white square."""
    import cv2

    height, width = picture.shape[:2]
    scale = size / max(height, width)
    small = cv2.resize(
        picture,
        (max(1, round(scale * width)), max(1, round(scale * height))),
        interpolation=cv2.INTER_AREA,
    )
    square = np.full((size, size, 3), _WHITE, np.uint8)
    top, left = (size - small.shape[0]) // 2, (size - small.shape[1]) // 2
    square[top : top + small.shape[0], left : left + small.shape[1]] = small
    return square


def _text(lines: Sequence[str], width: int) -> ByteArray:
    """Lines of text on white."""
    from PIL import Image, ImageDraw

    picture = Image.new("RGB", (width, 16 * len(lines) + 4), "white")
    for row, line in enumerate(lines):
        ImageDraw.Draw(picture).text((6, 16 * row + 2), line, fill="black")
    return np.asarray(picture)
