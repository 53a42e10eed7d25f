"""Directions: vectors of length 1 and frames made of them."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray


def unit(vectors: FloatArray, *, least: float = 1e-12) -> FloatArray:
    """Vectors (..., n) scaled to length 1, in their own dtype; those shorter than `least` are
    divided by it, so 0 stays 0."""
    result: FloatArray = vectors / np.maximum(
        np.linalg.norm(vectors, axis=-1, keepdims=True), least
    )
    return result


def frame_along(first: FloatArray, second: FloatArray) -> FloatArray:
    """Rotation matrices (..., 3, 3) whose first column is along `first` and whose second is as near
    as can be to `second`, both (..., 3)."""
    x = unit(first)
    z = unit(np.cross(x, second))
    return np.stack([x, np.cross(z, x), z], axis=-1)
