"""Find the smallest and smoothest turns over time that keep points out of half-spaces."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray

_WIDTH = 0.01
"""Violation of a half-space by a point that costs 1, meters."""
_SIZE = 0.3
"""Weight of the square of a turn in radians."""
_SECONDS = 0.1
"""Time scale of a turn, seconds."""
_CHANGES = 6
"""Largest number of changes of the active half-spaces."""


def smooth_turns(
    slopes: FloatArray, missing: FloatArray, turned: FloatArray, fps: float
) -> FloatArray:
    """Find turns near the given ones that move points out of their half-spaces.

    Minimize the squares of the points' misses, of the turns and of their second differences over
    time. A half-space is active if its point is not yet outside; the active set is updated after
    each solution. One banded system is solved for all frames.

    Parameters
    ----------
    slopes : (T, M, C) float64
        Displacement of each of M points for each of C turns, meters per radian.
    missing : (T, M) float64
        Distance that each point must move from its place at the given turns, meters; negative if
        outside.
    turned : (T, C) float64
        The given turns, radians.
    fps : float

    Returns
    -------
    (T, C) float64
    """
    from scipy.linalg import solveh_banded

    frames, count = turned.shape
    smoothness = _smoothness(frames, count, _SIZE * (_SECONDS * fps) ** 4)
    asked = missing + np.einsum("tmc,tc->tm", slopes, turned)
    found, counts = turned, missing > 0
    for _ in range(_CHANGES):
        weights = counts / _WIDTH**2
        products = np.einsum("tm,tmc,tmd->tcd", weights, slopes, slopes)
        bands = smoothness.copy()
        bands[0] += _SIZE
        for lower in range(count):
            for column in range(count - lower):
                bands[lower, column::count] += products[:, column + lower, column]
        right = np.einsum("tm,tmc,tm->tc", weights, slopes, asked)
        found = solveh_banded(bands, right.reshape(-1), lower=True).reshape(frames, count)
        now = asked > np.einsum("tmc,tc->tm", slopes, found)
        if (now == counts).all():
            break
        counts = now
    return found


def _smoothness(frames: int, count: int, weight: float) -> FloatArray:
    """Lower bands (2 C + 1, T C) of the squares of second differences of C curves over T frames."""
    bands = np.zeros((2 * count + 1, frames * count))
    for begin in range(frames - 2):
        for first in range(3):
            for second in range(first, 3):
                at = (begin + first) * count
                bands[(second - first) * count, at : at + count] += (
                    weight * _DIFFERENCE[first] * _DIFFERENCE[second]
                )
    return bands


_DIFFERENCE = (1.0, -2.0, 1.0)
"""The second difference of three frames."""
