"""Random directions over surfaces."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray


def cosine_directions(normals: FloatArray, generator: np.random.Generator) -> FloatArray:
    """Draw one direction (N, 3) float32 per normal from the cosine lobe around it."""
    sphere = generator.standard_normal(normals.shape, dtype=np.float32)
    sphere /= np.maximum(np.linalg.norm(sphere, axis=1, keepdims=True), 1e-6)
    direction = (
        normals + 0.999 * sphere
    )  # Lambert: uniform on the unit sphere that touches the surface
    return np.asarray(
        direction / np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-6), np.float32
    )
