"""Remove the person from the photo: the background is continued from the surroundings."""

from __future__ import annotations

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import srgb_to_linear
from a2v.perception.patch_fill import fill_by_patches
from a2v.types import BoolArray, ByteArray, FloatArray

SIDE = 800
"""Longest side at which the hole is filled, pixels; the photo's own grain beyond is not
continued."""
_SHADOW_SIDE = 200
"""Longest side at which shadows are searched, pixels."""
_REACH = 0.28
"""Largest distance of a shadow from the person, as a fraction of their height."""
_LIGHT = (0.3, 0.95)
"""Range of the share of light in a shadow: darker pixels are things, lighter ones may be noise."""
_CONTACT = 0.06
"""Distance from the person, as a fraction of their height, within which a shadow may be darker."""
_TINT = 0.07
"""Largest standard deviation of this share over the three channels, linear RGB: a shadow hardly
changes the hue."""


def paint_out(photo: ByteArray, mask: FloatArray, *, border: float = 0.012) -> ByteArray:
    """Fill the place of the person, and of the shadow next to them, with pieces of the rest of the
    picture (`fill_by_patches`).

    Pieces keep their structure, so that a horizon or a wall continues behind the person, and take
    the brightness of their surroundings.

    Parameters
    ----------
    photo : (H, W, 3) uint8
        sRGB.
    mask : (H, W) float
        Opacity of the person in [0, 1].
    border : float
        How much wider than the mask the hole is, a fraction of the longer side: hair, blur and
        JPEG's rims.

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
        raise InputError(
            f"the mask is {mask.shape[1]} x {mask.shape[0]}, the photo {width} x {height}; give "
            "both at one size"
        )
    longest = max(height, width)
    hole = _grown(mask > 0.02, round(border * longest))
    if not hole.any():
        return photo.copy()
    if hole.mean() > 0.9:
        raise InputError(
            "the person covers more than nine tenths of the photo, so its background is unknown; "
            "choose a color or the stage"
        )
    hole |= shadow_around(photo, hole)
    colors, missing = _small(photo, hole, SIDE)
    filled = cv2.cvtColor(fill_by_patches(colors, missing), cv2.COLOR_Lab2RGB)
    behind = cv2.resize(
        np.clip(255 * filled, 0, 255), (width, height), interpolation=cv2.INTER_CUBIC
    )
    # from the hole's rim inwards, so that fine grain does not end in a line
    rim = max(2.0, 0.004 * longest)
    inward = np.clip(cv2.distanceTransform(hole.astype(np.uint8), cv2.DIST_L2, 5) / rim, 0, 1)[
        ..., None
    ]
    return np.asarray(np.rint(np.clip(photo + inward * (behind - photo), 0, 255)), np.uint8)


def shadow_around(photo: ByteArray, hole: BoolArray) -> BoolArray:
    """The person's shadow: pixels (H, W) next to the `hole` (H, W) that are darker than the
    surroundings.

    A wider hole is filled. Where the photo is darker than this filling, of the same hue and joined
    to the person, there is the shadow.
    """
    import cv2

    height, width = hole.shape
    colors, missing = _small(photo, hole, _SHADOW_SIDE)
    rows = np.flatnonzero(missing.any(axis=1))
    reach = _REACH * (rows[-1] - rows[0] + 1)
    wide = _grown(missing, round(reach))
    if wide.mean() > 0.9:
        return np.zeros(hole.shape, bool)
    expected = fill_by_patches(colors, wide)
    given = np.where(missing[..., None], expected, colors), expected
    light = [
        cv2.GaussianBlur(srgb_to_linear(cv2.cvtColor(lab, cv2.COLOR_Lab2RGB)), (0, 0), 1.0)
        for lab in given
    ]
    share = light[0] / np.maximum(light[1], 1e-3)
    left = share.mean(axis=-1)
    near = _grown(missing, round(_CONTACT * (rows[-1] - rows[0] + 1)))
    dark = (
        wide
        & ~missing
        & ((left > _LIGHT[0]) | near)
        & (left < _LIGHT[1])
        & (share.std(axis=-1) < _TINT)
    )
    dark = cv2.morphologyEx(
        dark.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)
    ).astype(bool)
    _, names = cv2.connectedComponents((dark | missing).astype(np.uint8))
    dark = dark | (
        cv2.morphologyEx(
            (dark | missing).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)
        ).astype(bool)
        & ~missing
        & near
    )
    joined = dark & np.isin(names, np.unique(names[missing]))
    large = (
        cv2.resize(
            _grown(joined, 2).astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR
        )
        > 0.5
    )
    return np.asarray(large & ~hole)


def _small(photo: ByteArray, hole: BoolArray, side: int) -> tuple[FloatArray, BoolArray]:
    """The photo in CIELAB (h, w, 3) and the hole (h, w), with the longer side at most `side`
    pixels."""
    import cv2

    height, width = hole.shape
    scale = min(1.0, side / max(height, width))
    size = max(round(scale * width), 8), max(round(scale * height), 8)
    colors = cv2.cvtColor(
        cv2.resize(photo, size, interpolation=cv2.INTER_AREA).astype(np.float32) / 255,
        cv2.COLOR_RGB2Lab,
    )
    return colors, cv2.resize(hole.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.01


def _grown(mask: np.ndarray, pixels: int) -> np.ndarray:
    import cv2

    if not mask.any():
        return mask
    reach = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5)
    grown: np.ndarray = reach <= pixels
    return grown


def in_photo(mask: FloatArray, crop: tuple[int, ...], photo_size: tuple[int, ...]) -> FloatArray:
    """The mask (H, W) of a `Subject`, which lies over its `crop`, over the whole photo of
    `photo_size` (width, height)."""
    import cv2

    left, top, right, bottom = crop
    width, height = photo_size
    whole = cv2.resize(
        np.asarray(mask, np.float32), (right - left, bottom - top), interpolation=cv2.INTER_LINEAR
    )
    placed = np.zeros((height, width), np.float32)
    x0, y0, x1, y1 = max(left, 0), max(top, 0), min(right, width), min(bottom, height)
    placed[y0:y1, x0:x1] = whole[y0 - top : y1 - top, x0 - left : x1 - left]
    return placed
