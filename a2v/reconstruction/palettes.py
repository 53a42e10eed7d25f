"""CIELAB, typical colors of a region, and the distance of colors from them."""

from __future__ import annotations

import functools
import warnings

import numpy as np

from a2v.types import FloatArray


def lab_of(colors: FloatArray) -> FloatArray:
    """CIELAB (..., 3) of sRGB in [0, 1] (..., 3)."""
    from skimage.color import rgb2lab

    lab: FloatArray = rgb2lab(np.clip(colors, 0, 1))
    return lab


def color_clusters(
    lab: FloatArray, count: int, *, shade: FloatArray, rounds: int
) -> tuple[FloatArray, FloatArray]:
    """Return `count` centers (n, 3) of CIELAB colors (N, 3), by k-means, and the number (n,) of
    colors of each, which may be 0. Distances are weighted by `shade` (3,)."""
    from scipy.cluster.vq import kmeans2

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a palette may have fewer colors
        centers, member = kmeans2(lab * shade, count, minit="++", seed=0, iter=rounds)
    return np.asarray(centers / shade), np.bincount(member, minlength=count).astype(np.float64)


def clustered_colors(
    lab: FloatArray, count: int, *, shade: FloatArray, share: float, rounds: int
) -> FloatArray:
    """Return the centers (n, 3) of `color_clusters` without those that have at most the `share` of
    the colors (N, 3)."""
    centers, size = color_clusters(lab, count, shade=shade, rounds=rounds)
    return centers[size / len(lab) > share]


def palette_distance(lab: FloatArray, palette: FloatArray, shade: FloatArray) -> FloatArray:
    """Return the distance (...) of CIELAB colors (..., 3) from the nearest color of a palette
    (n, 3), n > 0, weighted by `shade` (3,)."""
    planes = np.ascontiguousarray(np.moveaxis(lab, -1, 0))  # four times as fast as the last axis

    def square(color: FloatArray) -> FloatArray:
        first, *others = (
            ((plane - value) * weight) ** 2
            for plane, value, weight in zip(planes, color, shade, strict=True)
        )
        return np.asarray(sum(others, first))

    return np.asarray(np.sqrt(functools.reduce(np.minimum, map(square, palette))))
