"""The flank beside a hanging arm: pixels there are often shade, background, or the arm."""

from __future__ import annotations

import numpy as np

from a2v.types import BoolArray, FloatArray, IntArray

_FAR = 0.1
"""Distance at rest from which on trunk and upper arm only touch in the photo, meters."""
_REACH = 0.03
"""Largest distance in the picture at which they touch, meters."""
_RIM = 0.04
"""Width of the rim of the trunk, beside an arm, whose colors are checked, meters."""
_DEEP = 0.03
"""Pixels at least this deep within the trunk give its colors, meters."""
_HEIGHT = 0.12
"""Difference in height that counts like `_ALIKE`, meters."""
_ALIKE = 9.0
"""Largest difference of similar colors at the same height, CIELAB units."""
_ENOUGH = 5
"""Number of similar samples with which a color is one of the trunk."""
_SAMPLES = 4000
"""Largest number of samples."""
_LEAST_REACH = 2.0
"""Smallest reach in small photos, pixels."""


def only_touching(
    vertex: IntArray, own: BoolArray, joined: BoolArray, rest: FloatArray, scale: float
) -> BoolArray:
    """Return which pixels (h, w) of a `joined` (h, w) part lie beside the part `own` (h, w) in the
    picture, but not at rest: an arm hangs beside the trunk, and grows out of it at the shoulder.

    Parameters
    ----------
    vertex : (h, w) int
        A vertex of the character at each pixel.
    rest : (V, 3)
        Vertices at rest, meters.
    scale : float
        Pixels per meter.
    """
    import cv2

    result = np.zeros(own.shape, bool)
    if not own.any() or not joined.any():
        return result
    away, labels = cv2.distanceTransformWithLabels(
        (~own).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    near = joined & (away < max(_REACH * scale, _LEAST_REACH))
    nearest = np.zeros(int(labels.max()) + 1, np.int64)
    nearest[labels[own]] = vertex[own]
    apart = rest[vertex[near]] - rest[nearest[labels[near]]]
    result[near] = np.linalg.norm(apart, axis=1) > _FAR
    return result


def strange_rim(lab: FloatArray, trunk: BoolArray, arms: BoolArray, scale: float) -> BoolArray:
    """Return which pixels (h, w) at the rim of the `trunk` (h, w) beside `arms` (h, w) have a color
    that does not occur deep within the trunk near that height.

    The picture `lab` (h, w, 3) is in CIELAB, and has `scale` pixels per meter.
    """
    import cv2
    from scipy.spatial import cKDTree

    result = np.zeros(trunk.shape, bool)
    away = cv2.distanceTransform((~arms).astype(np.uint8), cv2.DIST_L2, 5) / scale
    within = cv2.distanceTransform(trunk.astype(np.uint8), cv2.DIST_L2, 5) / scale
    deep, asked = within > _DEEP, trunk & (away < _RIM)
    if deep.sum() < _ENOUGH or not arms.any() or not asked.any():
        return result

    def features(chosen: BoolArray) -> FloatArray:
        height = np.nonzero(chosen)[0] / (scale * _HEIGHT)
        return np.concatenate([lab[chosen] / _ALIKE, height[:, None]], axis=1)

    samples = features(deep)
    tree = cKDTree(samples[:: max(1, len(samples) // _SAMPLES)])
    found = tree.query(features(asked), k=[_ENOUGH], distance_upper_bound=1.0, workers=1)[0]
    result[asked] = ~np.isfinite(found[:, 0])
    return result
