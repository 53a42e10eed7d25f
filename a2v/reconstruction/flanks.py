"""The flank beside a hanging arm: pixels there are often shade, background, or the arm."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS
from a2v.types import BoolArray, FloatArray, IntArray, Surface

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
_UPPER_ARMS = [number for number, name in enumerate(PARTS) if name.endswith("upper_arm")]
_LOWER_ARMS = [number for number, name in enumerate(PARTS) if name.endswith(("lower_arm", "hand"))]


def flanks_beside_arms(
    surface: Surface,
    vertex: IntArray,
    shown: IntArray,
    layers: BoolArray,
    lab: FloatArray,
    scale: float,
) -> dict[int, BoolArray]:
    """For trunk and upper arms by their number in `PARTS`: pixels (h, w) that belong to another.

    They are those of the other that only touch the part: both grow into each other at the shoulder,
    but not along a hanging arm. At the rim of the trunk they are also those of a strange color.

    Parameters
    ----------
    vertex, shown : (h, w) int
        A vertex of the posed surface at each pixel, and its part; -1 for none.
    layers : (V,) bool
        Vertices of separate layers of cloth or hair.
    lab : (h, w, 3)
        The picture, CIELAB.
    scale : float
        Pixels per meter.
    """
    if surface.standing is None:
        return {}
    rest, trunk = np.asarray(surface.standing.vertices, np.float64), PARTS.index("torso")
    body = (vertex >= 0) & ~layers[vertex]
    result = {trunk: np.zeros(shown.shape, bool)}
    own = body & (shown == trunk)
    for number in _UPPER_ARMS:
        arm = body & (shown == number)
        result[trunk] |= only_touching(vertex, own, arm, rest, scale)
        result[number] = only_touching(vertex, arm, own, rest, scale)
    arms = np.isin(shown, _LOWER_ARMS) | result[trunk]
    result[trunk] |= strange_rim(lab, shown == trunk, arms, scale)
    return result


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
