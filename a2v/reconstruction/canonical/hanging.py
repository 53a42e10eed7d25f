"""How the cloth of a skirt hangs on a person who stands at rest."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.body.parts import PARTS, on_parts
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.canonical.several import Sight
from a2v.reconstruction.reading.shown import STEP, pixels_beside
from a2v.types import FloatArray

_LOOSE = (0.01, 0.06)
"""Distances of cloth from the legs at its sides, meters, between which it becomes loose."""
_DEPTH = 0.75
"""Depth of a loose skirt as a share of its width."""
_SMOOTH = 2.0
"""Standard deviation of the filter over rows, in rows."""
_ARMS = tuple(
    f"{side}_{part}" for side in ("left", "right") for part in ("upper_arm", "lower_arm", "hand")
)


def in_skirt(sight: Sight) -> Sight:
    """The same photo, read with a skirt down to the knees if its lower edge cuts off the legs."""
    body = sight.body
    knees = [body.bone_names.index(f"lowerleg01{side}") for side in (".L", ".R")]
    places = sight.camera.project(body.bone_transforms[knees, :3, 3])
    if sight.reading.hangs or (places[:, 1] < sight.subject.mask.shape[0]).any():
        return sight
    hem = np.full(2, float(body.rest_transforms[knees, 1, 3].mean()))
    return dataclasses.replace(sight, given=dataclasses.replace(sight.reading, hangs=True, hem=hem))


def hanging(sight: Sight, rows: FloatArray, posed: FloatArray, base: FloatArray) -> FloatArray:
    """Displacements (R, C), meters, at rest of a skirt that has the displacements `rows` (R, C) in
    the photo.

    The outline in the photo shows how far the cloth hangs from the legs at its sides. If the sides
    differ, the further one is held or blown. Front and back, whose depth the photo does not show,
    are as far away. A row keeps its perimeter, because cloth does not stretch: where legs that
    stand apart widen it in the photo, it falls around both at rest. Further down hanging cloth
    never comes nearer to the legs.

    Parameters
    ----------
    posed, base : (R C, 3) float
        The hull of the legs in the photo and at rest, meters, row by row; its columns begin in
        front and grow to the person's left.
    """
    from scipy.ndimage import gaussian_filter1d

    shape = (*rows.shape, 3)
    at, mean = posed.reshape(shape), rows.mean(axis=1)
    near = _beside(sight, at).min(axis=0)
    near = np.where(np.isfinite(near), near, np.maximum(mean, 0.0))
    wide, deep = (np.ptp(at[..., axis], axis=1) + 2 * near for axis in (0, 2))
    deep = np.maximum(deep, _DEPTH * wide * smoothstep(near, *_LOOSE))
    perimeter = np.pi * np.sqrt((wide**2 + deep**2) / 2)  # of an ellipse
    flare = (perimeter - _perimeters(base.reshape(shape))) / (2 * np.pi)
    flare = np.maximum.accumulate(gaussian_filter1d(flare, _SMOOTH, mode="nearest"))
    share = np.minimum(mean, flare) / np.maximum(np.maximum(mean, flare), 1e-6)
    own = rows - mean[:, None]
    own = (own + own[:, -np.arange(own.shape[1])]) / 2
    return np.asarray(flare[:, None] + np.clip(share, 0.0, 1.0)[:, None] * own)


def _beside(sight: Sight, rows: FloatArray) -> FloatArray:
    """Distances (2, R), meters, of the outline of the cloth in the photo from both sides of rows
    (R, C, 3); infinite where an arm is beside it."""
    reading, camera = sight.reading, sight.camera
    shown = np.asarray(reading.shown)
    arms = reading.arms.any(axis=0) | (
        on_parts(np.arange(len(PARTS)), *_ARMS)[shown] & (shown >= 0)
    )
    high, wide = shown.shape
    mask = sight.subject.mask[: high * STEP : STEP, : wide * STEP : STEP] > 0.5
    cloth = mask & ~reading.taken & ~arms
    result = np.full((2, len(rows)), np.inf)
    for side, sign in enumerate((-1, 1)):
        ends = rows[np.arange(len(rows)), (sign * rows[..., 0]).argmax(axis=1)]
        pixels = np.floor(camera.project(ends) / STEP).astype(np.int64)
        for index, (column, row) in enumerate(pixels):
            if not (0 <= row < high and 0 <= column < wide):
                continue
            length = pixels_beside(cloth, row, column, sign)
            if length is not None and not arms[row, column + sign * length]:
                result[side, index] = length * STEP / camera.scale
    return result


def _perimeters(rows: FloatArray) -> FloatArray:
    """Perimeters (R,) of the horizontal hulls of rows (R, C, 3)."""
    from scipy.spatial import ConvexHull

    return np.array([ConvexHull(row[:, [0, 2]]).area for row in rows])
