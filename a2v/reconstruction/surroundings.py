"""Pixels that the mask has for the person and that show what lies around: between two legs, under
an arm, beside a hip."""

from __future__ import annotations

import numpy as np

from a2v.types import BoolArray, FloatArray, IntArray, Subject

_DOUBTFUL = 0.09
"""Pixels of the mask up to so far, meters, from where body or mask show nobody are looked at."""
_DEEP = 0.02
"""What lies deeper than this within the body, meters, is the person's."""
_RIM = 0.015
"""Between this, meters, beside the mask and ..."""
_NEAR = 0.3
"""... this lies what tells the surroundings' colors."""
_COLOR = 9.0
"""So many CIELAB units count like `_PLACE`."""
_PLACE = 0.3
"""So many meters count like `_COLOR`."""
_ALIKE = 1.2
"""A pixel shows the surroundings where it is nearer to one of their samples than this, of color
and place together, and ..."""
_RATIO = 0.6
"""... than this share of its distance from the nearest of the person's."""
_SAMPLES = 6000


def like_surroundings(subject: Subject, shown: IntArray, scale: float) -> BoolArray:
    """Which pixels (h, w) of the person's mask look like what is around the person, and not like
    the person next to there.

    Parameters
    ----------
    subject : Subject
        Its picture and mask are looked at in `shown`'s resolution.
    shown : (h, w) int
        Part that the posed body shows; -1 for none.
    scale : float
        Pixels of `shown` per meter.
    """
    import cv2
    from scipy.spatial import cKDTree
    from skimage.color import rgb2lab

    size = shown.shape[::-1]
    mask = cv2.resize(subject.mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    lab = np.asarray(
        rgb2lab(cv2.resize(subject.image, size, interpolation=cv2.INTER_AREA)), np.float64
    )
    deep = (_away(shown < 0) > _DEEP * scale) & (mask > 0.9)
    outside = _away(mask > 0.1)
    around = (outside > _RIM * scale) & (outside < _NEAR * scale)
    doubtful = (
        (mask > 0.5) & ~deep & (np.minimum(_away(shown < 0), _away(mask < 0.5)) < _DOUBTFUL * scale)
    )
    result = np.zeros(shown.shape, bool)
    if not (deep.any() and around.any() and doubtful.any()):
        return result
    own, other, asked = (_features(lab, chosen, scale) for chosen in (deep, around, doubtful))
    to_own, to_other = (
        cKDTree(samples[:: max(1, len(samples) // _SAMPLES)]).query(asked, workers=1)[0]
        for samples in (own, other)
    )
    result[doubtful] = (to_other < _ALIKE) & (to_other < _RATIO * to_own)
    return result


def _away(where: BoolArray) -> FloatArray:
    """Pixels (h, w) from the nearest one of `where` (h, w)."""
    import cv2

    return np.asarray(cv2.distanceTransform((~where).astype(np.uint8), cv2.DIST_L2, 5))


def _features(lab: FloatArray, chosen: BoolArray, scale: float) -> FloatArray:
    """Color and place (n, 5) of the chosen pixels."""
    row, column = np.nonzero(chosen)
    place = np.stack([row, column], axis=1) / (scale * _PLACE)
    return np.concatenate([lab[chosen] / _COLOR, place], axis=1)
