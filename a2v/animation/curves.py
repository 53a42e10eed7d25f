"""Curves over frames: find runs, bridge gaps, make smooth envelopes."""

from __future__ import annotations

import itertools

import numpy as np

from a2v.geometry.steps import smoothstep
from a2v.types import BoolArray, FloatArray


def speed_of(points: FloatArray, fps: float) -> FloatArray:
    """Return the speed (T,), meters per second: the slower of the steps before and after a frame,
    so that a contact keeps its ends."""
    if len(points) < 2:
        return np.zeros(len(points))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1) * fps
    slower: FloatArray = np.minimum(np.r_[steps[0], steps], np.r_[steps, steps[-1]])
    return slower


def runs(flags: BoolArray) -> list[tuple[int, int]]:
    """Return the runs of True as (first, one past the last)."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False].astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def bridged(values: FloatArray) -> FloatArray:
    """Fill NaN rows (T, C): smoothly from one filled row to the next, constant beyond the ends,
    zero without any."""
    known = np.flatnonzero(np.isfinite(values[:, 0]))
    if len(known) == 0:
        return np.zeros_like(values)
    out = values.copy()
    out[: known[0]], out[known[-1] + 1 :] = values[known[0]], values[known[-1]]
    for a, b in itertools.pairwise(known):
        if b - a > 1:
            t = (np.arange(a + 1, b) - a)[:, None] / (b - a)
            out[a + 1 : b] = values[a] + (values[b] - values[a]) * smoothstep(t, 0, 1)
    return out


def near(flags: BoolArray, width: float) -> FloatArray:
    """Return 1 on flags, easing to 0 over `width` frames around them."""
    from scipy.ndimage import distance_transform_edt

    if not flags.any():
        return np.zeros(len(flags))
    return smoothstep(1 - distance_transform_edt(~flags) / max(width + 1, 1.0), 0, 1)


def eased(values: FloatArray, width: float) -> FloatArray:
    """Return a smooth curve (T,) that is nowhere below `values`: a maximum filter, then
    smoothing."""
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d

    if values.max(initial=0.0) <= 0:
        return np.zeros(len(values))
    half = max(1, round(width))
    wide = maximum_filter1d(values, 2 * half + 1, mode="nearest")
    smooth: FloatArray = gaussian_filter1d(wide, half / 2, mode="nearest", truncate=2.0)
    upper: FloatArray = np.maximum(smooth, values)
    return upper
