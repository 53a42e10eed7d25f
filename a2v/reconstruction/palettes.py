"""Typical colors of a region, and the distance of colors from them."""

from __future__ import annotations

import functools
import warnings

import numpy as np

from a2v.types import FloatArray


def clustered_colors(
    lab: FloatArray, count: int, *, shade: FloatArray, share: float, rounds: int
) -> FloatArray:
    """Return at most `count` centers (n, 3) of CIELAB colors (N, 3), by k-means.

    Distances are weighted by `shade` (3,). Clusters with at most the `share` of the colors are
    left out.
    """
    from scipy.cluster.vq import kmeans2

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a palette may have fewer colors
        centers, member = kmeans2(lab * shade, count, minit="++", seed=0, iter=rounds)
    large = np.bincount(member, minlength=count) / len(member) > share
    return np.asarray(centers[large] / shade)


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
