"""The other side of the body: what the photo shows of one half stands for the half that it does not
show."""

from __future__ import annotations

import numpy as np

from a2v.body.spots import Spots
from a2v.reconstruction.backs.pieces import joined_pieces
from a2v.types import BoolArray, IntArray

NEAR = 0.03
"""A spot stands for its mirrored one within so many meters of it, along the body at rest."""
PATCH = 0.004
"""Smaller shares of the surface have no twins: a stripe's end alone would be a blot."""


def find_twins(
    spots: Spots, *, known: BoolArray, clear: BoolArray, neighbors: IntArray
) -> IntArray:
    """For each vertex (V,) that is not `known` (V,) the `clear` (V,) one at the mirrored spot of
    the body; -1 where there is none.

    `neighbors` (V, N) are nearest vertices.
    """
    twin = np.where(known, -1, spots.twins(clear, within=NEAR))
    found = twin >= 0
    piece = joined_pieces(found, neighbors)
    small = np.bincount(piece, found) < PATCH * len(twin)
    return np.where(small[piece], -1, twin)
