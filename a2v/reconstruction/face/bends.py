"""Map the face of the body to that of the photo: bent, or only moved and scaled."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.types import FloatArray


class Bend:
    """Bends space so that the face of the body matches that of the photo.

    In the plane it uses thin-plate splines; in depth it follows the surrounding surface.
    """

    def __init__(self, sources: FloatArray, targets: FloatArray, smoothing: float):
        from scipy.interpolate import RBFInterpolator

        self._plane = RBFInterpolator(
            sources, targets - sources, kernel="thin_plate_spline", smoothing=smoothing
        )
        self._depth: Any = None

    def follow(self, places: FloatArray, depths: FloatArray, smoothing: FloatArray) -> None:
        """Shift depths by `depths` (n,) at the bent `places` (n, 2)."""
        from scipy.interpolate import RBFInterpolator

        self._depth = RBFInterpolator(
            places, depths[:, None], kernel="thin_plate_spline", smoothing=smoothing
        )

    def __call__(self, points: FloatArray) -> FloatArray:
        """Bent points (n, 3)."""
        bent = points.copy()
        bent[:, :2] += self._plane(points[:, :2])
        if self._depth is not None:
            bent[:, 2] += self._depth(bent[:, :2])[:, 0]
        return bent


class Placing:
    """Move and scale the face of the body as a whole to that of the photo, without bending it."""

    _SCALES = (0.8, 1.25)

    def __init__(self, sources: FloatArray, targets: FloatArray, points: FloatArray):
        self._from, self._to = sources.mean(axis=0), targets.mean(axis=0)
        away, wanted = sources - self._from, targets - self._to
        self._scale = float(
            np.clip((away * wanted).sum() / max(float((away**2).sum()), 1e-12), *self._SCALES)
        )
        self._level, self._shift = float(points[:, 2].mean()), 0.0

    def follow(self, places: FloatArray, depths: FloatArray, smoothing: FloatArray) -> None:
        """Shift all depths by the median of `depths` (n,)."""
        self._shift = float(np.median(depths)) if len(depths) else 0.0

    def __call__(self, points: FloatArray) -> FloatArray:
        """Placed points (n, 3)."""
        placed = np.empty_like(points)
        placed[:, :2] = self._to + self._scale * (points[:, :2] - self._from)
        placed[:, 2] = self._level + self._scale * (points[:, 2] - self._level) + self._shift
        return placed
