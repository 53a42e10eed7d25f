"""Find pixels of the person's mask that show an object in a hand: a bag, a phone, a ball."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS
from a2v.geometry.colors import lab_of_bytes
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, Subject

_WRISTS = (15, 16)
"""BlazePose's wrists."""
_SURE = 0.5
"""Landmarks of less confidence than this are not used."""
_REACH = 0.5
"""A held object lies within this distance of a hand, meters."""
_HAND = 0.06
"""It begins within this distance of a hand, meters."""
_OWN = 0.32
"""The person's colors are sampled farther than this from both hands, meters."""
_STRANGE = 14.0
"""Distance up to which a sample has the same color, CIELAB units."""
_COMMON = 0.004
"""Share of samples of the same color from which on a color is common."""
_SAMPLES = 2000
"""Largest number of samples of the person."""
_ROUNDED = 3.0
"""Colors that are rounded to the same multiple of this, CIELAB units, are compared once."""
_LEAST = 0.004
"""A held object shows at least this area in front of the body, and beside it, square meters."""
_MOST = 0.16
"""It shows at most this area in all: a larger one is background, square meters."""
_OPENED = 0.006
"""Bridges up to twice this, meters, do not connect two objects."""
_CLOSED = 0.02
"""Gaps up to twice this, meters, do not split an object."""
_CLOTHES = 0.7
"""It covers less than this share of trunk and thighs at its height: a skirt between the hands
covers all of them."""
_BORDER = 0.03
"""A region that comes this near to the end of `_REACH` continues beyond it, so it is background,
meters."""


def held_things(subject: Subject, shown: IntArray, scale: float) -> BoolArray:
    """Return which pixels (h, w) of the person's mask show an object that a hand holds.

    An object begins at a hand, ends within `_REACH` of it, lies in front of the fitted body (not of
    its head) and beside it, and has colors that neither the rest of the person nor the background
    has.

    Parameters
    ----------
    subject : Subject
        Its picture, mask and keypoints are taken at the resolution of `shown`.
    shown : (h, w) int
        Part of the posed body in each pixel; -1 for none.
    scale : float
        Pixels of `shown` per meter.
    """
    import cv2
    from scipy import ndimage

    size = shown.shape[::-1]
    mask = cv2.resize(subject.mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.5
    result = np.zeros(shown.shape, bool)
    away = _from_hands(subject, shown) / scale
    lab = lab_of_bytes(np.asarray(cv2.resize(subject.image, size, interpolation=cv2.INTER_AREA)))
    head = np.isin(shown, [PARTS.index("head"), PARTS.index("neck")])
    near = (away < _REACH) & ~head
    trunk = np.isin(shown, [PARTS.index(name) for name in ("torso", "left_thigh", "right_thigh")])
    own = lab[mask & (head | ((shown >= 0) & (away > _OWN)))]
    if not len(own) or (mask & near).sum() < _LEAST * scale**2:
        return result
    strange = np.zeros(shown.shape, np.uint8)
    strange[near] = ~_common(lab[near], own)
    around = lab[~mask & (shown < 0) & (away > _REACH)]
    if len(around):
        strange[near] &= ~_common(lab[near], around)
    strange = cv2.morphologyEx(strange, cv2.MORPH_OPEN, _disk(_OPENED * scale))
    strange = cv2.morphologyEx(strange, cv2.MORPH_CLOSE, _disk(_CLOSED * scale))
    pieces, count = ndimage.label(ndimage.binary_fill_holes(strange))
    for piece in range(1, count + 1):
        chosen = pieces == piece
        on_body = (chosen & (shown >= 0) & mask).sum() / scale**2
        beside = (chosen & (shown < 0)).sum() / scale**2
        if (
            min(on_body, beside) > _LEAST
            and on_body + beside < _MOST
            and away[chosen].min() < _HAND
            and away[chosen].max() < _REACH - _BORDER
            and _share_of_trunk(chosen, trunk) < _CLOTHES
        ):
            result |= chosen & mask
    return result


def _share_of_trunk(chosen: BoolArray, trunk: BoolArray) -> float:
    """Share of the `trunk` (h, w), at the heights of the inner half of the `chosen` (h, w) pixels,
    that these cover."""
    first, last = np.quantile(np.nonzero(chosen)[0], [0.25, 0.75]).astype(int)
    rows = slice(first, last + 1)
    return float((chosen & trunk)[rows].sum() / max(trunk[rows].sum(), 1))


def _from_hands(subject: Subject, shown: IntArray) -> FloatArray:
    """Return the distance (h, w), pixels, from the nearest hand of the body or wrist in the photo;
    infinite if neither is visible."""
    import cv2

    at = np.isin(shown, [number for number, name in enumerate(PARTS) if name.endswith("hand")])
    step = subject.mask.shape[0] / shown.shape[0]
    for column, row, sure in subject.keypoints[list(_WRISTS), :3]:
        place = int(row / step), int(column / step)
        if sure > _SURE and 0 <= place[0] < at.shape[0] and 0 <= place[1] < at.shape[1]:
            at[place] = True
    if not at.any():
        return np.full(shown.shape, np.inf)
    return np.asarray(cv2.distanceTransform((~at).astype(np.uint8), cv2.DIST_L2, 5))


def _common(colors: FloatArray, own: FloatArray) -> BoolArray:
    """Return which colors (n, 3) are common among the samples (m, 3)."""
    from scipy.spatial import cKDTree

    if not len(colors):
        return np.zeros(0, bool)
    samples = own[:: max(1, len(own) // _SAMPLES)]
    steps = np.rint(colors / _ROUNDED)
    # one number per color: sorting rows takes ten times as long
    low = steps.min(axis=0)
    spans = (steps.max(axis=0) - low + 1).astype(np.int64)
    key = np.ravel_multi_index(tuple((steps - low).astype(np.int64).T), tuple(spans))
    asked, number = np.unique(key, return_inverse=True)
    places = np.stack(np.unravel_index(asked, tuple(spans)), axis=-1) + low
    alike = cKDTree(samples).query_ball_point(
        places * _ROUNDED, _STRANGE, workers=1, return_length=True
    )
    return np.asarray((alike >= _COMMON * len(samples))[number.ravel()])


def _disk(radius: float) -> ByteArray:
    """A round kernel of this radius, pixels."""
    import cv2

    side = 2 * max(1, round(radius)) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
