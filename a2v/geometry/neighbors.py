"""Interpolation among scattered points that does not jump when they move."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray, IntArray


def shares_around(
    points: FloatArray, wanted: FloatArray, *, count: int = 3
) -> tuple[IntArray, FloatArray]:
    """Return the `count` nearest of `points` to each wanted one, and their shares of it.

    The shares are Shepard's with the support of Franke and Nielson (1980): they are continuous,
    also where another point becomes one of the nearest.

    Parameters
    ----------
    points : (m, d) float, m > `count`
    wanted : (n, d) float

    Returns
    -------
    nearest : (n, count) int64
    shares : (n, count) float64
        Each row sums to one.
    """
    from scipy.spatial import cKDTree

    gaps, nearest = cKDTree(points).query(wanted, k=count + 1)
    gaps = np.maximum(gaps, 1e-9)
    far = gaps[:, -1:]
    shares = np.maximum((far - gaps[:, :-1]) / (far * gaps[:, :-1]), 1e-6) ** 2
    return nearest[:, :-1].astype(np.int64), shares / shares.sum(axis=1, keepdims=True)
