"""Canonical places: coordinates of every point of a body's outer skin that are the same for all
people and poses.

The place of a vertex is its position on the default body at rest, with each axis scaled to [-1, 1]
(as the NOCS of Wang et al. 2019, eq. 1, but per axis): x to the person's left, y up, z to the
front. A network that predicts the place at a pixel thus predicts which vertices the pixel may show.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from a2v.body.registry import default_rest, load_body_model
from a2v.body.skin import skin_vertices
from a2v.types import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class CanonicalPlaces:
    """Places of the default model's outer skin.

    Attributes
    ----------
    places : (S, 3) float32
        From -1 to 1 on each axis. Mirroring the body changes the sign of x.
    vertex_ids : (S,) int64
        Vertices of the model that the outer skin keeps (`a2v.body.skin.outer_skin`), in its order.
    """

    places: FloatArray
    vertex_ids: IntArray


@lru_cache(maxsize=1)
def canonical_places() -> CanonicalPlaces:
    """Return the places of the default body model. They are cached and must not be changed."""
    model = load_body_model()
    rest = default_rest()
    kept = skin_vertices(len(rest), model.faces)
    least, most = rest[kept].min(axis=0), rest[kept].max(axis=0)
    places = (2 * (rest[kept] - least) / (most - least) - 1).astype(np.float32)
    for array in (places, kept):
        array.setflags(write=False)
    return CanonicalPlaces(places, kept)
