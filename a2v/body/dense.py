"""Dense evidence: vertices of the body, and where in the photo and how deep each of them is seen (`a2v.types.BodyMap`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.places import canonical_places
from a2v.types import BodyMap, FloatArray, IntArray

_PLACE, _DEPTH = 0.06, 0.03
"""Expected errors at which a pixel counts half: of its place, in the unit of `CanonicalPlaces`; of its depth, relative to the person's height."""


@dataclass(frozen=True, eq=False)
class DenseEvidence:
    """Pixels of a body map, each with the vertex that it shows.

    Attributes
    ----------
    vertex_ids : (n,) int64
        Of the body model's mesh.
    pixels : (n, 2)
        Of the photo: u, v.
    depths : (n,)
        Pixels, larger is nearer; from where they are measured is not known.
    weights, depth_weights : (n,)
        How sure place and depth are, from 0 to 1.
    """

    vertex_ids: IntArray
    pixels: FloatArray
    depths: FloatArray
    weights: FloatArray
    depth_weights: FloatArray


def gather_dense(found: BodyMap, *, height: float, count: int, seed: int) -> DenseEvidence | None:
    """`count` pixels of a body map, evenly drawn; None where it sees nobody.

    Parameters
    ----------
    found : BodyMap
    height : float
        The person's standing height, pixels.
    count, seed : int
    """
    from scipy.spatial import cKDTree

    rows, columns = np.nonzero(found.inside)
    if not len(rows):
        return None
    chosen = np.random.default_rng(seed).permutation(len(rows))[:count]
    rows, columns = rows[chosen], columns[chosen]
    canonical = canonical_places()
    _, nearest = cKDTree(canonical.places).query(found.places[rows, columns])
    return DenseEvidence(
        vertex_ids=canonical.vertex_ids[nearest],
        pixels=found.pixels()[rows, columns].astype(np.float64),
        depths=found.depths[rows, columns, 0].astype(np.float64),
        weights=1 / (1 + (found.place_scales[rows, columns].astype(np.float64) / _PLACE) ** 2),
        depth_weights=1 / (1 + (found.depth_scales[rows, columns, 0].astype(np.float64) / (_DEPTH * height)) ** 2),
    )
