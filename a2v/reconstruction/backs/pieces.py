"""Connected pieces of neighboring vertices, means over neighbors, and their votes."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.types import BoolArray, FloatArray, IntArray

_BELIEF = 6.0
"""Difference of cost, CIELAB units, that makes a choice e times as likely when neighbors vote."""
_WEIGHT = 14.0
"""Cost of a choice that no neighbor makes, CIELAB units."""


def joined_pieces(chosen: BoolArray, neighbors: IntArray) -> IntArray:
    """Index (V,) of the piece of each vertex: `chosen` (V,) neighbors (`neighbors` (V, N)) form one
    piece, every other vertex its own."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    count, width = neighbors.shape
    ends = np.repeat(np.arange(count), width), neighbors.ravel()
    joined = chosen[ends[0]] & chosen[ends[1]]
    graph = sp.csr_matrix(
        (np.ones(joined.sum()), (ends[0][joined], ends[1][joined])), (count, count)
    )
    return np.asarray(connected_components(graph, directed=False)[1])


def neighbor_mean(neighbors: IntArray) -> Any:
    """Sparse matrix (V, V) that gives each vertex the mean of its neighbors (V, N)."""
    import scipy.sparse as sp

    count, width = neighbors.shape
    rows = np.repeat(np.arange(count), width)
    return sp.csr_matrix(
        (np.full(count * width, 1.0 / width), (rows, neighbors.ravel())), (count, count)
    )


def with_votes(
    cost: FloatArray, neighbors: IntArray, *, rounds: int, fixed: IntArray | None = None
) -> FloatArray:
    """Add the votes of neighbors (V, N) to the costs (V, K) of choices. A vertex whose `fixed` (V,)
    choice is not negative keeps it."""
    total, mixing = cost.copy(), neighbor_mean(neighbors)
    for _ in range(rounds):
        belief = np.exp(-(total - total.min(axis=1, keepdims=True)) / _BELIEF)
        belief /= belief.sum(axis=1, keepdims=True)
        if fixed is not None:
            held = fixed >= 0
            belief[held] = np.arange(cost.shape[1]) == fixed[held][:, None]
        total = cost + _WEIGHT * (1 - mixing @ belief)
    return total
