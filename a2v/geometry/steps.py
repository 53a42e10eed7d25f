"""Smooth steps."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray


def smoothstep(values: FloatArray, low: float, high: float) -> FloatArray:
    """Return 0 below `low`, 1 above `high`, and between them a cubic whose slope is 0 at both
    ends."""
    t = np.clip((values - low) / (high - low), 0, 1)
    result: FloatArray = t * t * (3 - 2 * t)
    return result
