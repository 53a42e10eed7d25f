"""The photo without the person: what stood behind is continued from what is around."""

from __future__ import annotations

import numpy as np

from a2v.errors import InputError
from a2v.types import ByteArray, FloatArray

SIDE = 400
"""Longest side at which the hole is filled, pixels: the time goes with its square, and what is behind a person is mostly soft."""


def paint_out(photo: ByteArray, mask: FloatArray, *, border: float = 0.012) -> ByteArray:
    """Fill the person's place with shifted pieces of the rest of the picture (He and Sun, ECCV 2012; OpenCV's shift maps).

    Pieces keep their structure, so a horizon or a wall goes on behind the person, where diffusion would smear it.

    Parameters
    ----------
    photo : (H, W, 3) uint8
        sRGB.
    mask : (H, W) float
        Opacity of the person in [0, 1].
    border : float
        How much wider than the mask the hole is, a fraction of the longer side: hair, blur and JPEG's rims.

    Returns
    -------
    (H, W, 3) uint8
        `photo` itself outside of the hole.

    Raises
    ------
    InputError
        The mask has another size, or leaves less than a tenth of the photo to continue from.
    """
    import cv2

    height, width = photo.shape[:2]
    if mask.shape != (height, width):
        raise InputError(f"the mask is {mask.shape[1]} x {mask.shape[0]}, the photo {width} x {height}; give both at one size")
    longest = max(height, width)
    hole = _grown(mask > 0.02, round(border * longest))
    if not hole.any():
        return photo.copy()
    if hole.mean() > 0.9:
        raise InputError("the person covers more than nine tenths of the photo, so its background is unknown; choose a colour or the stage")
    scale = min(1.0, SIDE / longest)
    size = max(round(scale * width), 8), max(round(scale * height), 8)
    small = cv2.cvtColor(cv2.resize(photo, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2Lab)
    known = (cv2.resize(hole.astype(np.float32), size, interpolation=cv2.INTER_AREA) < 0.01).astype(np.uint8)
    filled = small.copy()
    cv2.xphoto.inpaint(small, 255 * known, filled, cv2.xphoto.INPAINT_SHIFTMAP)
    behind = cv2.resize(cv2.cvtColor(filled, cv2.COLOR_Lab2RGB), (width, height), interpolation=cv2.INTER_CUBIC)
    # from the hole's rim inwards, so that fine grain does not end in a line
    rim = max(2.0, 0.004 * longest)
    inward = np.clip(cv2.distanceTransform(hole.astype(np.uint8), cv2.DIST_L2, 5) / rim, 0, 1)[..., None]
    return np.asarray(np.rint(photo + inward * (behind.astype(np.float32) - photo)), np.uint8)


def _grown(mask: np.ndarray, pixels: int) -> np.ndarray:
    import cv2

    if not mask.any():
        return mask
    reach = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5)
    grown: np.ndarray = reach <= pixels
    return grown


def in_photo(mask: FloatArray, crop: tuple[int, ...], photo_size: tuple[int, ...]) -> FloatArray:
    """The mask (H, W) of a `Subject`, which lies over its `crop`, over the whole photo of `photo_size` (width, height)."""
    import cv2

    left, top, right, bottom = crop
    width, height = photo_size
    whole = cv2.resize(np.asarray(mask, np.float32), (right - left, bottom - top), interpolation=cv2.INTER_LINEAR)
    placed = np.zeros((height, width), np.float32)
    x0, y0, x1, y1 = max(left, 0), max(top, 0), min(right, width), min(bottom, height)
    placed[y0:y1, x0:x1] = whole[y0 - top : y1 - top, x0 - left : x1 - left]
    return placed
