"""Shorten the rest at the beginning of a clip: recordings start before the person moves."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from a2v.types import FloatArray, IntArray

RESTING = 0.25
"""A frame is at rest if its mean joint speed is below this share of the clip's upper quartile."""

LATE = frozenset(["Jump", "Long jump", "High jump", "Step forward", "Climb stairs"])
"""Actions of `cmu-fine` before which people swing their arms or shift their weight for seconds."""
LATE_SECONDS = 2.5
"""Longest wait that is left out, seconds."""
ONSET = 0.08
"""Way of the root from which the body moves, meters."""
ONSET_LEAD_SECONDS = 0.4
"""Time that is kept before that."""

LEAD_SECONDS = 1 / 3
"""Time at rest that is kept before the first movement."""


def rests(joints: FloatArray, fps: float, usable: IntArray | int) -> IntArray:
    """Count the frames (N,) at the beginning of clips (N, T, J, 3) in which the person stands
    still.

    The clips move for `usable` frames (N,) or (). The last `LEAD_SECONDS` before the first movement
    do not count.
    """
    moving = np.minimum(np.broadcast_to(usable, len(joints)), joints.shape[1])
    if joints.shape[1] < 2:
        return np.zeros(len(joints), dtype=np.int64)
    speeds = np.linalg.norm(np.diff(joints.astype(np.float64), axis=1), axis=-1).mean(axis=-1)
    last = np.maximum(moving - 2, 0)[:, None]
    at = np.minimum(np.arange(speeds.shape[1]), last)  # later frames repeat the last moving one
    even = uniform_filter1d(
        np.take_along_axis(speeds, at, axis=1), max(1, round(fps / 4)), axis=1, mode="nearest"
    )
    brisk = np.nanquantile(
        np.where(np.arange(speeds.shape[1]) <= last, even, np.nan), 0.75, axis=1, keepdims=True
    )
    going = np.where(moving < 2, 0, (even > RESTING * brisk).argmax(axis=1))
    found: IntArray = np.maximum(going - round(LEAD_SECONDS * fps), 0)
    return found


def shifted(frames: FloatArray, by: IntArray) -> FloatArray:
    """Drop the first `by` (N,) frames of clips (N, T, ...); the last frame is held to keep the
    length."""
    at = np.minimum(np.arange(frames.shape[1]) + by[:, None], frames.shape[1] - 1)
    moved: FloatArray = frames[np.arange(len(frames))[:, None], at]
    return moved


def onset(root: FloatArray, fps: float) -> int:
    """Return the frame shortly before the root (T, 3) of a clip leaves its first place; 0 if it
    stays, or leaves later than `LATE_SECONDS`."""
    away = np.linalg.norm(root - root[:1], axis=-1) > ONSET
    last = round(LATE_SECONDS * fps)
    first = int(away.argmax()) if away.any() else 0
    return min(max(first - round(ONSET_LEAD_SECONDS * fps), 0), last)
