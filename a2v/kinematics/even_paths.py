"""Smoothing of paths over time that leaves slow parts unchanged, unlike a Gaussian."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray

_THIRD = (-1.0, 3.0, -3.0, 1.0)
"""The third difference of four frames."""


def evened(paths: FloatArray, width: float) -> FloatArray:
    """Smooth paths (..., T, C) by least squares of the distances and of third differences over time
    (Whittaker 1923).

    One banded system is solved for all paths. Parabolas are unchanged, also at the ends.

    Parameters
    ----------
    paths : (..., T, C) float
        Fewer than four frames are returned unchanged.
    width : float
        Width in frames: waves of about 2 pi times this length lose half of their amplitude.
    """
    from scipy.linalg import solveh_banded

    frames = paths.shape[-2]
    if frames < 4 or width <= 0:
        return paths
    bands = np.zeros((4, frames))
    for first in range(4):
        for second in range(first, 4):
            bands[second - first, first : first + frames - 3] += (
                width**6 * _THIRD[first] * _THIRD[second]
            )
    bands[0] += 1
    flat = np.moveaxis(paths, -2, 0)
    solved = solveh_banded(bands, flat.reshape(frames, -1), lower=True).reshape(flat.shape)
    even: FloatArray = np.moveaxis(solved, 0, -2)
    return even


def evened_cycle(paths: FloatArray, width: float) -> FloatArray:
    """Smooth paths (T, C) whose first frame follows the last, as `evened` does; `width` in frames.

    A cycle's system is circulant, so that the discrete Fourier transform solves it.
    """
    frames = len(paths)
    waves = 2 - 2 * np.cos(2 * np.pi * np.fft.rfftfreq(frames))  # squared first difference
    kept = 1 / (1 + width**6 * waves**3)
    even: FloatArray = np.fft.irfft(np.fft.rfft(paths, axis=0) * kept[:, None], n=frames, axis=0)
    return even
