"""Typical colors of a region, and the distance of colors from them."""

from __future__ import annotations

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
    return np.asarray(
        np.min([np.linalg.norm((lab - color) * shade, axis=-1) for color in palette], axis=0)
    )
