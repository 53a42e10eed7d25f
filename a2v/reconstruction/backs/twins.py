"""Use the visible half of the body for the occluded one."""

from __future__ import annotations

import numpy as np

from a2v.body.spots import Spots
from a2v.reconstruction.backs.pieces import joined_pieces
from a2v.types import BoolArray, IntArray

NEAR = 0.03
"""Largest distance of a vertex from the mirrored spot, meters on the body at rest."""
PATCH = 0.004
"""Smallest fraction of the surface that gets twins: a smaller one, such as the end of a single
stripe, would look like a blot."""


def find_twins(
    spots: Spots, *, known: BoolArray, clear: BoolArray, neighbors: IntArray
) -> IntArray:
    """Return for each vertex (V,) that is not `known` (V,) the vertex at the mirrored spot of the
    body, one of the `clear` (V,) ones; -1 for none.

    `neighbors` (V, N) are nearest vertices.
    """
    twin = np.where(known, -1, spots.twins(clear, within=NEAR))
    found = twin >= 0
    piece = joined_pieces(found, neighbors)
    small = np.bincount(piece, found) < PATCH * len(twin)
    return np.where(small[piece], -1, twin)
