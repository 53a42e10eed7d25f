"""Remove the person from the photo by continuing the background."""

from __future__ import annotations

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import srgb_to_linear
from a2v.perception.behind import fill_by_regions, find_regions, fit_shading
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

SIDE = 800
"""Longest side of the picture in which the hole is filled, pixels. Finer grain of the photo is not
continued."""
_BLUR = 0.004
"""Light is compared after smoothing by this, a fraction of the longer side."""
_THINNEST = 0.008
"""Half of the narrowest shadow, a fraction of the longer side."""
_REACH = 0.28
"""Largest distance of a shadow from the person, as a fraction of their height."""
_LIGHT = (0.08, 0.95)
"""Range of the share of light in a shadow: darker pixels are objects, lighter ones may be noise."""
_GRAIN = 1.0
"""A shadow is darker than its surface by at least this many standard deviations of the surface's
texture."""
_SHARP = 0.04
"""Largest sharp shadow, a fraction of the picture."""
_CONTACT = 0.06
"""Distance from the person, as a fraction of their height, within which a shadow may be darker."""
_TINT = 0.15
"""Largest standard deviation of this share over the three channels, linear RGB: a shadow hardly
changes the hue."""


def paint_out(photo: ByteArray, mask: FloatArray, *, border: float = 0.012) -> ByteArray:
    """Fill the area of the person, and of the shadow next to them, with pieces of the picture.

    Pieces (`fill_by_patches`) keep their structure, so that a horizon or a wall continues behind
    the person. Their brightness is adapted to the surroundings.

    Parameters
    ----------
    photo : (H, W, 3) uint8
        sRGB.
    mask : (H, W) float
        Opacity of the person in [0, 1].
    border : float
        Margin of the hole around the mask, as a fraction of the longer side. It covers hair, blur
        and JPEG artifacts.

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
            "both the same size"
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
    colors, missing = _reduced(photo, hole, SIDE)
    shadow, regions = shadow_around(colors, missing, find_regions(colors, missing))
    filled = cv2.cvtColor(fill_by_regions(colors, missing, regions, shadow), cv2.COLOR_Lab2RGB)
    behind = cv2.resize(
        np.clip(255 * filled, 0, 255), (width, height), interpolation=cv2.INTER_CUBIC
    )
    # from the hole's rim inwards, so that fine grain does not end in a line
    rim = max(2.0, 0.004 * longest)
    hole |= cv2.resize(shadow.astype(np.float32), (width, height)) > 0.01
    inward = np.clip(cv2.distanceTransform(hole.astype(np.uint8), cv2.DIST_L2, 5) / rim, 0, 1)[
        ..., None
    ]
    return np.asarray(np.rint(np.clip(photo + inward * (behind - photo), 0, 255)), np.uint8)


def shadow_around(
    colors: FloatArray, hole: BoolArray, regions: IntArray
) -> tuple[BoolArray, IntArray]:
    """Find the person's shadow: pixels (H, W) that are darker than the shading of their region.

    The shadow has nearly the hue of the region, and is connected to the person.

    Parameters
    ----------
    colors : (H, W, 3) float32
        CIELAB.
    hole : (H, W) bool
        The person.
    regions : (H, W) int
        See `a2v.perception.behind.find_regions`.

    Returns
    -------
    shadow : (H, W) bool
    regions : (H, W) int
        With sharp shadows as parts of the regions on which they fall.
    """
    import cv2
    from scipy.ndimage import binary_fill_holes

    rows = np.flatnonzero(hole.any(axis=1))
    tall = rows[-1] - rows[0] + 1
    wide, near = _grown(hole, round(_REACH * tall)), _grown(hole, round(_CONTACT * tall))
    regions = _without_shadows(colors, hole, regions, wide)
    shading = fit_shading(colors, regions, wide, near)
    blur = max(1.0, _BLUR * max(hole.shape))
    light, expected = (
        cv2.GaussianBlur(srgb_to_linear(cv2.cvtColor(lab, cv2.COLOR_Lab2RGB)), (0, 0), blur)
        for lab in (np.where(hole[..., None], shading, colors), shading)
    )
    share = light / np.maximum(expected, 1e-3)
    left = share.mean(axis=-1)
    least = np.full(left.shape, _LIGHT[1])
    for label in np.unique(regions[wide]):
        plain = (regions == label) & ~wide
        if plain.sum() > 50:
            least[regions == label] = min(_LIGHT[1], 1 - _GRAIN * float(left[plain].std()))
    dark = (
        wide & ~hole & ((left > _LIGHT[0]) | near) & (left < least) & (share.std(axis=-1) < _TINT)
    )
    size = 2 * round(_THINNEST * max(hole.shape)) + 1
    square = np.ones((size, size), np.uint8)
    joined = cv2.morphologyEx((dark | hole).astype(np.uint8), cv2.MORPH_OPEN, square)
    _, names = cv2.connectedComponents(((joined > 0) | hole).astype(np.uint8))
    found = np.isin(names, np.unique(names[hole])) & (joined > 0)
    closed = cv2.morphologyEx((found | hole).astype(np.uint8), cv2.MORPH_CLOSE, square) > 0
    grown = _grown(binary_fill_holes(closed), round(blur))
    return np.asarray(grown & ~hole & wide), regions


def _without_shadows(
    colors: FloatArray, hole: BoolArray, regions: IntArray, wide: BoolArray
) -> IntArray:
    """Merge each sharp shadow of the person with the region on which it falls.

    That is an adjacent region with the same color in more light.
    """
    import cv2

    light = srgb_to_linear(cv2.cvtColor(colors, cv2.COLOR_Lab2RGB))
    square = np.ones((5, 5), np.uint8)
    beside = cv2.dilate(hole.astype(np.uint8), square).astype(bool) & ~hole
    result = regions.copy()
    for name in np.unique(regions[beside]):
        own = (regions == name) & ~hole
        if own.mean() > _SHARP or wide[own].mean() < 0.9:
            continue
        rim = cv2.dilate(own.astype(np.uint8), square).astype(bool) & ~own & ~hole
        for other in np.unique(regions[rim]):
            lit = (regions == other) & ~hole & wide
            if not lit.any():
                continue
            share = light[own].mean(axis=0) / np.maximum(light[lit].mean(axis=0), 1e-3)
            if _LIGHT[0] < share.mean() < _LIGHT[1] and share.std() < _TINT * share.mean():
                result[regions == name] = other
                break
    return result


def _reduced(photo: ByteArray, hole: BoolArray, side: int) -> tuple[FloatArray, BoolArray]:
    """Return the photo in CIELAB (h, w, 3) and the hole (h, w), with the longer side at most `side`
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
    """Place the mask (H, W) of a `Subject`, which covers its `crop`, in the whole photo of
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
