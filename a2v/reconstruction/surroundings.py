"""Find pixels of the person's mask that show the background: between two legs, under an arm, beside
a hip."""

from __future__ import annotations

import numpy as np

from a2v.types import BoolArray, FloatArray, IntArray, Subject

_DOUBTFUL = 0.09
"""Distance from pixels without body or mask up to which pixels of the mask are tested, meters."""
_DEEP = 0.02
"""Depth within the body from which on a pixel belongs to the person, meters."""
_RIM = 0.015
"""Distance from the mask at which the background begins to be sampled, meters."""
_NEAR = 0.3
"""Distance from the mask up to which the background is sampled, meters."""
_COLOR = 9.0
"""Difference of color, CIELAB units, that counts like the distance `_PLACE`."""
_PLACE = 0.3
"""Distance, meters, that counts like the difference of color `_COLOR`."""
_ALIKE = 1.2
"""Largest distance, of color and place together, of a background pixel from a sample of the
background."""
_RATIO = 0.6
"""Largest ratio of this distance to that from the nearest sample of the person."""
_SAMPLES = 6000
"""Largest number of samples of each kind."""


def like_surroundings(subject: Subject, shown: IntArray, scale: float) -> BoolArray:
    """Return which pixels (h, w) of the person's mask look like the background, and not like the
    person next to them.

    Parameters
    ----------
    subject : Subject
        Its picture and mask are resized to the resolution of `shown`.
    shown : (h, w) int
        Part of the posed body in each pixel; -1 for none.
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
    deep = (_distance_from(shown < 0) > _DEEP * scale) & (mask > 0.9)
    outside = _distance_from(mask > 0.1)
    around = (outside > _RIM * scale) & (outside < _NEAR * scale)
    doubtful = (
        (mask > 0.5)
        & ~deep
        & (np.minimum(_distance_from(shown < 0), _distance_from(mask < 0.5)) < _DOUBTFUL * scale)
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


def _distance_from(where: BoolArray) -> FloatArray:
    """Distance (h, w), pixels, from the nearest pixel of `where` (h, w)."""
    import cv2

    return np.asarray(cv2.distanceTransform((~where).astype(np.uint8), cv2.DIST_L2, 5))


def _features(lab: FloatArray, chosen: BoolArray, scale: float) -> FloatArray:
    """Color and place (n, 5) of the chosen pixels."""
    row, column = np.nonzero(chosen)
    place = np.stack([row, column], axis=1) / (scale * _PLACE)
    return np.concatenate([lab[chosen] / _COLOR, place], axis=1)
