"""Unit vectors, and rotation frames from directions."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray


def unit(vectors: FloatArray, *, least: float = 1e-12) -> FloatArray:
    """Scale vectors (..., n) to length 1, in their own dtype.

    Vectors shorter than `least` are divided by `least`, so 0 stays 0.
    """
    result: FloatArray = vectors / np.maximum(
        np.linalg.norm(vectors, axis=-1, keepdims=True), least
    )
    return result


def frame_along(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return rotation matrices (..., 3, 3) whose first column is along `first` (..., 3).

    The second column is as near as possible to `second` (..., 3).
    """
    x = unit(first)
    z = unit(np.cross(x, second))
    return np.stack([x, np.cross(z, x), z], axis=-1)
