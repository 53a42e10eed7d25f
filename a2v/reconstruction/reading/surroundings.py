"""Find pixels of the person's mask that show the background: between two legs, under an arm, beside
a hip."""

from __future__ import annotations

import numpy as np

from a2v.geometry.colors import lab_of_bytes
from a2v.system import thread_count
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

    size = shown.shape[::-1]
    mask = cv2.resize(subject.mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    lab = lab_of_bytes(np.asarray(cv2.resize(subject.image, size, interpolation=cv2.INTER_AREA)))
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
    like_other = _nearest(other, asked, _ALIKE)
    close = np.flatnonzero(like_other < _ALIKE)
    # a sample of the person beyond this bound cannot decide
    like_own = _nearest(own, asked[close], _ALIKE / _RATIO)
    result[doubtful] = np.isin(
        np.arange(len(asked)), close[like_other[close] < _RATIO * like_own], assume_unique=True
    )
    return result


def _nearest(samples: FloatArray, asked: FloatArray, most: float) -> FloatArray:
    """Distance (n,) of features (n, 5) from the nearest of some `samples` (m, 5); infinite from
    `most` on, which makes the search several times as fast."""
    from scipy.spatial import cKDTree

    tree = cKDTree(samples[:: max(1, len(samples) // _SAMPLES)])
    return np.asarray(
        tree.query(asked, distance_upper_bound=most, workers=thread_count())[0], np.float64
    )


def _distance_from(where: BoolArray) -> FloatArray:
    """Distance (h, w), pixels, from the nearest pixel of `where` (h, w)."""
    import cv2

    return np.asarray(cv2.distanceTransform((~where).astype(np.uint8), cv2.DIST_L2, 5))


def _features(lab: FloatArray, chosen: BoolArray, scale: float) -> FloatArray:
    """Color and place (n, 5) of the chosen pixels."""
    row, column = np.nonzero(chosen)
    place = np.stack([row, column], axis=1) / (scale * _PLACE)
    return np.concatenate([lab[chosen] / _COLOR, place], axis=1)
