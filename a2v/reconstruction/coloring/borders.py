"""Draw borders between materials (skin, cloth, hair, shoes) as smooth curves at the resolution of
the texture.

Vertices are too far apart for that.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from a2v.geometry.mesh import Rings, within
from a2v.types import BoolArray, FloatArray, IntArray

_ROUNDS = 5
"""Number of rings over which the shares of materials are averaged, which smooths their borders."""
_GUESSED = 14
"""Number of further rings on the unseen side, where borders are guessed and so get no corners."""
_SOFT = 0.08
"""Difference of shares over which one material turns into the next: about 2 mm."""


@dataclass(frozen=True, eq=False)
class Borders:
    """Shares and colors of each material on the vertices.

    Attributes
    ----------
    shares : (V, K) float32
        Smooth; the largest share of a place gives its material.
    of_stuff : (K, V, 3) float32
        Colors of each material, extended beyond its border.
    """

    shares: FloatArray
    of_stuff: FloatArray

    @classmethod
    def between(
        cls, labels: IntArray, faces: IntArray, colors: FloatArray, known: BoolArray
    ) -> Borders:
        """Borders on the mesh `faces` (F, 3) of vertices with `labels` (V,) and `colors` (V, 3);
        the photo shows those that are `known` (V,)."""
        kinds = np.unique(labels)
        hard = (labels[:, None] == kinds).astype(np.float64)
        rings = Rings(faces, len(labels))
        near = rings.evened(hard, _ROUNDS)
        shares = np.where(known[:, None], near, rings.evened(near, _GUESSED))
        carried = []
        for kind in range(len(kinds)):
            own = hard[:, kind, None]
            value, weight = own * colors, own
            for _ in range(_ROUNDS + 3):
                grown = rings.evened(np.concatenate([value, weight], axis=1))
                value = np.where(own > 0, own * colors, grown[:, :3])
                weight = np.where(own > 0, own, grown[:, 3:])
            carried.append(np.where(weight > 1e-6, value / np.maximum(weight, 1e-6), colors))
        return cls(shares.astype(np.float32), np.stack(carried).astype(np.float32))

    def colors(self, corner: IntArray, weight: FloatArray) -> FloatArray:
        """Colors (n, 3) at places with `corner` (n, 3) vertices and barycentric `weight` (n, 3,
        1)."""
        share = within(self.shares, corner, weight)
        # several times as fast as the maximum over an axis of a few
        first = functools.reduce(np.maximum, share.T)[:, None]
        part = np.clip(1 - (first - share) / _SOFT, 0, 1)
        part /= part.sum(axis=1, keepdims=True)
        result = np.zeros((len(corner), 3))
        for kind in range(share.shape[1]):
            own = np.flatnonzero(part[:, kind] > 0)
            result[own] += part[own, kind, None] * within(
                self.of_stuff[kind], corner[own], weight[own]
            )
        return result
