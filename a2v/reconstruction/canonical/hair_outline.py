"""Fit strands of long hair to the photo: its outline, and where it ends."""

from __future__ import annotations

import numpy as np

from a2v.geometry.images import sample_image
from a2v.geometry.rays import RayScene
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.reconstruction.canonical.strands import (
    COLUMNS,
    FRONT,
    STEP,
    STEPS,
    TEMPLES,
    TUCKED,
    HairlessPerson,
    angles,
)
from a2v.reconstruction.reading import HairSeen
from a2v.types import BoolArray, Camera, FloatArray

_COHESION = 1.5
"""Standard deviation of the smoothing over neighboring strands after each step, strands."""
_SMOOTH = 0.03
"""Length over which displacements to the outline are smoothed, meters."""
_TEMPLE = 65.0
"""Angle from straight ahead, degrees, of the strand at the outline of a head below which the
outline is that of the face."""
_FEW_ROWS = 4
"""Smallest number of rows in which the outline is seen."""
_MOST = 0.11
"""Largest displacement to the outline, meters."""
_NEAR = 0.012
"""Radius around a place within which pixels decide whether there is hair, meters."""
_SHOWS = 0.12
"""Share of pixels of hair below which a visible place is not hair."""
_ON_FACE = 0.5
"""The same for strands before the temples, which must not lie on the face."""
_GAP = 4
"""Number of successive visible places without hair that end a strand."""
_LONG = 0.17
"""Length of hair at the back below the base of the neck if it reaches the shoulders, meters: the
photo does not show it."""
_ROUNDED = 0.12
"""Height by which strands at the sides are shorter, meters at a right angle from the back."""
_BEHIND = 105.0
"""Angle from straight ahead, degrees, from which on strands hang behind the shoulders."""
_BEHIND_REACH = 25.0
"""Standard deviation, strands, of the smoothing by which strands behind the head, whose outline the
photo does not show, stand off as far as those at the sides."""
_EVEN = 2.5
"""Standard deviation of the smoothing of the ends over neighboring strands, strands."""


def to_outline(posed: FloatArray, beside: FloatArray, seen: HairSeen, camera: Camera) -> FloatArray:
    """Displacements (STEPS, COLUMNS), meters, of the posed layer (n, 3) outwards to the outline of
    the hair in the photo; `beside` (n, 3) is the layer 1 cm farther out.

    In each row, the outermost strand on each side of the picture moves to the outermost pixel of
    hair, and the strands beside it follow. Unseen strands move like the mirrored ones.
    """
    from scipy.ndimage import gaussian_filter1d

    flat = camera.project(posed).reshape(STEPS, COLUMNS, 2)
    aside = (camera.project(beside)[:, 0] - flat[..., 0].ravel()) / camera.scale / 0.01
    around = np.minimum(angles(), 360 - angles())
    total, weight = np.zeros((2, STEPS, COLUMNS))
    steps = np.arange(STEPS)
    for side in (-1.0, 1.0):
        away = side * (flat[..., 0] - flat[..., 0].mean(axis=1, keepdims=True))
        last = away.argmax(axis=1)
        found = _outermost(seen, flat, side, camera)
        missing = side * (found - flat[steps, last, 0]) / camera.scale
        good = np.isfinite(missing) & (np.abs(missing) < _MOST) & (steps * STEP > TUCKED / 2)
        good &= around[last] > _TEMPLE
        if good.sum() < _FEW_ROWS:
            continue
        even = np.interp(steps, steps[good], missing[good])
        even = gaussian_filter1d(even, _SMOOTH / STEP, mode="nearest")
        turned = np.clip(side * aside.reshape(STEPS, COLUMNS), 0.0, 1.0)
        share = turned**2 * np.clip(away / away.max(axis=1, keepdims=True), 0.0, 1.0)
        share = share * smoothstep(around, TEMPLES - 15, TEMPLES)  # no strand stands off a cheek
        total += share * even[:, None] / np.maximum(turned, 0.5)
        weight += share
    both = total + 0.5 * total[:, ::-1], weight + 0.5 * weight[:, ::-1]
    moved = both[0] / np.maximum(both[1], 0.3)
    wide = [gaussian_filter1d(one, _BEHIND_REACH, axis=1, mode="nearest") for one in both]
    guessed = wide[0] / np.maximum(wide[1], 1e-6)
    unseen = smoothstep(around, 90.0, _BEHIND) * np.clip(1 - both[1] / 0.3, 0, 1)
    moved = moved + unseen * (guessed - moved)
    moved = gaussian_filter1d(moved, 0.5 * _SMOOTH / STEP, axis=0, mode="nearest")
    moved = gaussian_filter1d(moved, _COHESION, axis=1, mode="nearest")
    return np.asarray(moved * smoothstep(steps * STEP, 0.0, TUCKED)[:, None])


def _outermost(seen: HairSeen, flat: FloatArray, side: float, camera: Camera) -> FloatArray:
    """Column (STEPS,) of the photo, pixels, at which hair beside the strands at `flat` (STEPS,
    COLUMNS, 2) ends toward the left (`side` -1) or the right (1); NaN without hair."""
    result = np.full(len(flat), np.nan)
    high, wide = seen.pixels.shape
    for step, strands in enumerate(flat):
        last = strands[(side * strands[:, 0]).argmax()]
        row = int(np.clip(last[1], 0, high - 1))
        middle = strands[:, 0].mean()
        ends = sorted((middle + side * 0.03 * camera.scale, last[0] + side * _MOST * camera.scale))
        first, end = (int(np.clip(value, 0, wide)) for value in ends)
        found = np.flatnonzero(seen.pixels[row, first:end])
        if len(found):
            result[step] = first + (found[-1] + 1 if side > 0 else found[0])
    return result


def shown_places(posed: FloatArray, person: HairlessPerson, camera: Camera) -> BoolArray:
    """Return which places (n, 3) of the layer nothing of the body hides in the photo."""
    scene = RayScene(np.asarray(person.posed, np.float32), np.asarray(person.faces, np.int32))
    ahead = unit(
        camera.raised(camera.flatten(posed) + np.array([0.0, 0.0, 0.01])) - posed, least=1e-9
    )
    return ~scene.occluded(
        np.asarray(posed + 0.004 * ahead, np.float32), np.asarray(ahead, np.float32)
    )


def hair_around(places: FloatArray, seen: HairSeen, camera: Camera) -> FloatArray:
    """Share (n,) of pixels of hair around places (n, 3)."""
    import cv2

    size = 2 * max(1, round(_NEAR * camera.scale)) + 1
    share = cv2.blur(seen.pixels.astype(np.float32), (size, size))
    return np.asarray(sample_image(share, camera.project(places)), np.float64)


def strand_ends(
    grid: FloatArray, shown: BoolArray, hair: FloatArray, base: float, *, free: bool
) -> FloatArray:
    """Steps (COLUMNS,) at which strands (STEPS, COLUMNS, 3) end.

    Parameters
    ----------
    shown, hair : (n,)
        Whether places of the strands are visible, and the share of hair in the photo there.
    base : float
        Height of the base of the neck, meters.
    free : bool
        See `HairSeen`. If not, strands at the back continue behind the shoulders.
    """
    from scipy.ndimage import gaussian_filter1d, median_filter

    around = np.minimum(angles(), 360 - angles())
    behind, before = ~free & (around > _BEHIND), around < TEMPLES
    shown, hair = shown.reshape(STEPS, COLUMNS), hair.reshape(STEPS, COLUMNS)
    bare = hair < np.where(before, _ON_FACE, _SHOWS)
    low = grid[..., 1] < base + 0.09  # from the jaw down
    ends, told = np.full(COLUMNS, np.nan), np.zeros(COLUMNS, bool)
    for column in np.flatnonzero(~behind):
        run = 0
        for step in np.flatnonzero(low[:, column] | before[column]):
            run = run + 1 if shown[step, column] and bare[step, column] else 0
            if run == _GAP:
                ends[column], told[column] = max(step - _GAP, 0), True
                break
    twin = ends[::-1]
    visible = (shown & low).any(axis=0)
    ends = np.where(told | visible | behind, ends, twin)
    heights = np.array(
        [grid[int(end), column, 1] for column, end in enumerate(ends) if np.isfinite(end)]
    )
    high = float(np.median(heights)) if len(heights) else -np.inf
    aside = np.abs(np.linspace(-1, 1, COLUMNS)) * np.radians(180 - FRONT)
    lowest = high if free and np.isfinite(high) else base - _LONG + _ROUNDED * (1 - np.cos(aside))
    usual = (grid[..., 1] > lowest).sum(axis=0).astype(np.float64)
    ends = np.where(np.isfinite(ends), ends, usual)
    moving = np.linalg.norm(np.diff(grid, axis=0), axis=2) > 0.2 * STEP
    ends = median_filter(np.minimum(ends, moving.sum(axis=0)), 11, mode="nearest")
    ends = gaussian_filter1d(ends, _EVEN, mode="nearest")
    return np.asarray(np.clip(ends, np.where(before, 1, 8), STEPS - 1))


def resampled(grid: FloatArray, ends: FloatArray, count: int) -> FloatArray:
    """Strands (count, COLUMNS, 3) of which each ends at its step of `ends` (COLUMNS,)."""
    place = np.linspace(0, 1, count)[:, None] * ends
    step = np.minimum(place.astype(np.int64), STEPS - 2)
    share = (place - step)[..., None]
    column = np.arange(COLUMNS)
    return np.asarray((1 - share) * grid[step, column] + share * grid[step + 1, column])
