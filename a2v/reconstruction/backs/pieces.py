"""Connected pieces of neighboring vertices, and means over neighbors."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.types import BoolArray, IntArray


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
