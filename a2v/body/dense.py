"""Dense evidence from a `a2v.types.BodyMap`: pixel and depth of many vertices of the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.places import canonical_places
from a2v.geometry.neighbors import shares_around
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import BodyMap, FloatArray, IntArray

_PLACE = 0.06
"""Expected error of a pixel's place at which its weight is one half, in the unit of
`CanonicalPlaces`."""
_DEPTH = 0.03
"""Expected error of a pixel's depth at which its weight is one half, relative to the person's
height."""
_HEAD = np.arange(LANDMARK_INDEX["mouth_right"] + 1)
"""Landmarks of the head."""
_ELSEWHERE = 0.03
"""Distance between the two estimates of a nearby landmark at which a pixel's weight is one half,
relative to the height."""


@dataclass(frozen=True, eq=False)
class DenseEvidence:
    """Pixels of a body map, each with the place on the body that it shows.

    Attributes
    ----------
    vertex_ids : (m,) int64
        Of the body model's mesh.
    chosen : (n, k) int64
        Entries of `vertex_ids` around the place of each pixel.
    shares : (n, k)
        Their shares of the place; each row sums to one.
    pixels : (n, 2)
        Of the photo: u, v.
    depths : (n,)
        Pixels, larger is nearer; the origin is unknown.
    weights, depth_weights : (n,)
        Confidence of position and depth, from 0 to 1.
    """

    vertex_ids: IntArray
    chosen: IntArray
    shares: FloatArray
    pixels: FloatArray
    depths: FloatArray
    weights: FloatArray
    depth_weights: FloatArray


def gather_dense(
    found: BodyMap,
    keypoints: FloatArray,
    *,
    height: float,
    count: int,
    seed: int,
    standing: bool = False,
    unseen: IntArray | None = None,
) -> DenseEvidence | None:
    """Sample `count` pixels of a body map uniformly; None if it shows nobody.

    Parameters
    ----------
    found : BodyMap
    keypoints : (33, 3)
        Of the `a2v.types.Subject`. Pixels around landmarks that the map places elsewhere have less
        weight.
    height : float
        The person's standing height, pixels.
    count, seed : int
    standing : bool
        The person stands upright on straight legs. Then the map's depths and its pixels of the
        head have no weight: the fit finds better depths, and a better head, without them.
    unseen : (n,) int, optional
        Landmarks whose depths the user has given: the depths of the pixels around them have no
        weight.
    """
    from scipy.spatial import cKDTree

    rows, columns = np.nonzero(found.inside)
    if not len(rows):
        return None
    # A priority of every pixel of the map: one pixel more or less inside changes only itself.
    priority = np.random.default_rng(seed).random(found.inside.shape)
    chosen = np.argsort(priority[rows, columns])[:count]
    rows, columns = rows[chosen], columns[chosen]
    pixels, depths = (
        found.pixels()[rows, columns].astype(np.float64),
        found.depths[rows, columns, 0].astype(np.float64),
    )
    gap = np.linalg.norm(keypoints[:, :2] - found.landmarks[:, :2], axis=1) / (_ELSEWHERE * height)
    _, beside = cKDTree(found.landmarks).query(np.concatenate([pixels, depths[:, None]], axis=1))
    agreed = np.where(keypoints[:, 2] > 0.1, 1 / (1 + gap**2), 1.0)[beside]
    deep = np.full(len(rows), float(not standing))
    if standing:
        agreed = np.where(np.isin(beside, _HEAD), 0.0, agreed)
    if unseen is not None:
        deep[np.isin(beside, unseen)] = 0.0
    canonical = canonical_places()
    nearest, shares = shares_around(canonical.places, found.places[rows, columns])
    used, chosen = np.unique(nearest, return_inverse=True)
    return DenseEvidence(
        vertex_ids=canonical.vertex_ids[used],
        chosen=chosen.reshape(nearest.shape),
        shares=shares,
        pixels=pixels,
        depths=depths,
        weights=agreed / (1 + (found.place_scales[rows, columns].astype(np.float64) / _PLACE) ** 2),
        depth_weights=deep
        * agreed
        / (1 + (found.depth_scales[rows, columns, 0].astype(np.float64) / (_DEPTH * height)) ** 2),
    )
