"""Draw pictures of evaluated photos."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.geometry.colors import to_bytes
from a2v.lab.evaluation.reconstruction.maps import mask_in_photo
from a2v.lab.evaluation.reconstruction.methods import Result
from a2v.types import ByteArray, Surface


def picture_rows(result: Result, *, size: int = 200) -> dict[str, ByteArray]:
    """Draw pictures (size, W, 3) uint8 of an evaluated photo: "truth" and one per method.

    Each has the photo (for methods the mask), front, left, back and right unlit, then front, left
    and back as clay.
    """
    import cv2

    from a2v.rendering.preview import PreviewStyle, preview_surface

    case = result.case
    low, high = case.surface.vertices.min(axis=0), case.surface.vertices.max(axis=0)
    center, extent = (low + high) / 2, 1.1 * float((high - low).max())
    wide = min(
        1.0, 1.25 * float(np.hypot(*(high - low)[[0, 2]])) / extent
    )  # for any turn of the person
    border = round((1 - wide) / 2 * size)

    def look(surface: Surface, azimuth: float, clay: bool = False) -> ByteArray:
        picture = preview_surface(
            surface,
            azimuth=azimuth,
            size=size,
            center=center,
            extent=extent,
            style=PreviewStyle(shaded=False, plain=clay),
        )
        return picture[:, border : size - border]

    mask = np.zeros((size, size, 3), np.uint8)
    if result.subject is not None:
        small = cv2.resize(
            mask_in_photo(result.subject), (size, size), interpolation=cv2.INTER_AREA
        )
        mask[:] = to_bytes(small)[..., None]
    rows = {}
    for name, surface in {"truth": case.surface, **result.surfaces}.items():
        first = (
            cv2.resize(case.image, (size, size), interpolation=cv2.INTER_AREA)
            if name == "truth"
            else mask
        )
        turned = [look(surface, turn) for turn in (0, 90, 180, 270)] + [
            look(surface, turn, clay=True) for turn in (0, 90, 180)
        ]
        rows[name] = np.hstack([first, *turned])
        label = f"{case.name} {case.index}" if name == "truth" else name
        cv2.putText(rows[name], label, (size + 4, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.38, (40, 40, 40))
    return rows


def stack_rows(rows: Sequence[ByteArray]) -> ByteArray:
    """Stack pictures below each other; narrower ones are padded in light gray."""
    width = max(row.shape[1] for row in rows)
    return np.vstack(
        [
            np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0)), constant_values=235)
            for row in rows
        ]
    )
