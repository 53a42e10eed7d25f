"""Pictures side by side and in grids."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.errors import InputError
from a2v.types import ByteArray


def side_by_side(
    images: Sequence[ByteArray], *, gap: int = 0, color: tuple[int, int, int] = (255, 255, 255)
) -> ByteArray:
    """Place pictures (H, W, 3) uint8 in a row; smaller ones are centered on the tallest.

    Raises
    ------
    InputError
        No picture, or one that is not (H, W, 3) uint8.
    """
    return contact_sheet(images, rows=1, cols=len(images), gap=gap, color=color)


def contact_sheet(
    images: Sequence[ByteArray],
    rows: int | None = None,
    cols: int | None = None,
    labels: Sequence[str] | None = None,
    *,
    gap: int = 4,
    color: tuple[int, int, int] = (255, 255, 255),
) -> ByteArray:
    """Place pictures in a grid, row by row, each under its label.

    Parameters
    ----------
    images : sequence of (H, W, 3) uint8
        Sizes may differ; each is centered in its cell.
    rows, cols : int or None
        Size of the grid. A missing one follows from the number of pictures.
    labels : sequence of str or None
    gap : int
        Pixels between cells.
    color : tuple of 3 int
        sRGB of the gaps.

    Raises
    ------
    InputError
        No picture, one that is not (H, W, 3) uint8, or more pictures than the grid holds.
    """
    if not images:
        raise InputError("no picture to put on the sheet")
    for image in images:
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise InputError(
                f"a picture has shape {image.shape} and type {image.dtype}; expected (height, "
                "width, 3) uint8"
            )
    count = len(images)
    if cols is None:
        cols = -(-count // rows) if rows else int(np.ceil(np.sqrt(count)))
    if rows is None:
        rows = -(-count // cols)
    if rows * cols < count:
        raise InputError(f"{count} pictures do not fit on a sheet of {rows} x {cols}")
    height, width = max(image.shape[0] for image in images), max(image.shape[1] for image in images)
    band = 0 if labels is None else max(16, height // 16)
    sheet = np.empty((rows * (height + band + gap) - gap, cols * (width + gap) - gap, 3), np.uint8)
    sheet[:] = color
    for index, image in enumerate(images):
        top, left = (index // cols) * (height + band + gap) + band, (index % cols) * (width + gap)
        y, x = top + (height - image.shape[0]) // 2, left + (width - image.shape[1]) // 2
        sheet[y : y + image.shape[0], x : x + image.shape[1]] = image
    if labels is None:
        return sheet
    from PIL import Image, ImageDraw, ImageFont

    picture = Image.fromarray(sheet)
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(size=0.75 * band)
    ink = (0, 0, 0) if sum(color) > 384 else (255, 255, 255)
    for index, label in enumerate(labels[:count]):
        top, left = (index // cols) * (height + band + gap), (index % cols) * (width + gap)
        draw.text((left + width / 2, top + band / 2), label, fill=ink, font=font, anchor="mm")
    return np.asarray(picture)


def with_caption(picture: ByteArray, lines: Sequence[str], *, size: int = 14) -> ByteArray:
    """Add lines of black text on white below a picture (H, W, 3) uint8.

    The text is `size` pixels tall, or smaller if a line would be wider than the picture.
    """
    from PIL import Image, ImageDraw, ImageFont

    if not lines:
        return picture
    width = picture.shape[1]
    widest = max(ImageFont.load_default(size=size).getlength(line) for line in lines)
    size = max(6, min(size, int(size * (width - 8) / widest)))
    band = round(1.4 * size)
    sheet = Image.fromarray(
        np.pad(picture, ((0, band * len(lines)), (0, 0), (0, 0)), constant_values=255)
    )
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=size)
    for row, line in enumerate(lines):
        place = (4, picture.shape[0] + band * (row + 0.5))
        draw.text(place, line, fill=(0, 0, 0), font=font, anchor="lm")
    return np.asarray(sheet)
