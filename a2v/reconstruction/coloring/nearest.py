"""Nearest vertices of a surface."""

from __future__ import annotations

import numpy as np

from a2v.system import thread_count
from a2v.types import BoolArray, FloatArray, IntArray


def nearest_known(vertices: FloatArray, known: BoolArray) -> tuple[FloatArray, IntArray]:
    """Distance (V,), meters, to the nearest `known` (V,) vertex, and its index (V,)."""
    from scipy.spatial import cKDTree

    reach, nearest = cKDTree(vertices[known]).query(vertices, workers=thread_count())
    return np.asarray(reach), np.flatnonzero(known)[nearest]


def nearest_vertices(vertices: FloatArray, count: int) -> IntArray:
    """The `count` nearest other vertices (V, count) of each vertex, also if points coincide."""
    from scipy.spatial import cKDTree

    neighbors = np.asarray(
        cKDTree(vertices).query(vertices, k=count + 1, workers=thread_count())[1]
    )
    own = neighbors == np.arange(len(neighbors))[:, None]
    own[~own.any(axis=1), -1] = True
    return np.asarray(neighbors[~own].reshape(len(neighbors), count))
