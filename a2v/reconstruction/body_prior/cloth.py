"""Cloth that spans from leg to leg: skirts, coats, and trousers with a low crotch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import on_parts
from a2v.geometry.volume import Grid
from a2v.reconstruction.body_prior.columns import columns_seen, front_seen
from a2v.types import BoolArray, FloatArray, IntArray

WIDEST = 0.6
"""Largest width of a gap between the legs that cloth spans, meters."""
SMALLEST = 0.05
"""Smallest height, and smallest largest width, of such a gap, meters. Smaller ones are folds of
trousers."""
APART = 0.12
"""Largest distance in depth between the middles of the legs, meters. Beyond it, the legs of
trousers overlap in the picture."""
HOLD = 0.18
"""Width of the body on each side of a gap that carries the cloth, meters."""
ABOVE = 0.2
"""Height above the gap over which the cloth comes to lie on the body, meters."""
HEM = 0.02
"""Distance from the mask's contour within which cloth is rounded, meters."""
_LOWER = ("torso", "left_thigh", "left_shin", "right_thigh", "right_shin")


@dataclass(frozen=True, eq=False)
class LegColumns:
    """Trunk and legs in the columns of a photo; maps are (nx, ny), where a row is an index of the
    second axis.

    Attributes
    ----------
    left, right : (nx, ny) bool
        Columns with a leg.
    front, back : (nx, ny)
        Depth of trunk and legs, meters; infinite outside.
    cell : float
        Width of a column, meters.
    """

    left: BoolArray
    right: BoolArray
    front: FloatArray
    back: FloatArray
    cell: float

    @classmethod
    def of(cls, skin: FloatArray, faces: IntArray, parts: IntArray, grid: Grid) -> LegColumns:
        """Build the maps of a body's skin (S, 3), faces (G, 3) and parts (S,) on a grid."""

        def of_parts(*names: str) -> IntArray:
            return np.asarray(faces[on_parts(parts, *names)[faces].all(axis=1)])

        left, right = (
            np.isfinite(front_seen(skin, of_parts(f"{side}_thigh", f"{side}_shin"), grid))
            for side in ("left", "right")
        )
        return cls(left, right, *columns_seen(skin, of_parts(*_LOWER), grid), grid.cell)

    def gaps(self, missing: BoolArray) -> BoolArray:
        """Return the part of `missing` (nx, ny) that is cloth between the legs.

        `missing` is the part of the mask without body.
        """
        found = np.zeros_like(missing)
        for row in np.flatnonzero(missing.any(axis=0)):
            for begin, end in _runs(missing[:, row]):
                if not 0 < begin < end < len(missing) or (end - begin) * self.cell > WIDEST:
                    continue
                first, last = self._held(begin - 1, -1, row), self._held(end, 1, row)
                if not len(first) or not len(last):
                    continue
                apart = abs(self._middle(first, row) - self._middle(last, row))
                found[begin:end, row] = (
                    self._side(first, row) * self._side(last, row) < 0 and apart < APART
                )
        return _large_enough(found, self.cell)

    def hull(self, begin: int, end: int, row: int) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return the columns of the body beside the columns `begin` to `end` (exclusive) of a row,
        and the convex hull's front and back there."""
        first, last = self._held(begin - 1, -1, row), self._held(end, 1, row)
        held = np.concatenate([first, last])
        columns = np.arange(held[0], held[-1] + 1)
        return (
            columns,
            _upper_hull(held, self.front[held, row], columns),
            -_upper_hull(held, -self.back[held, row], columns),
        )

    def _held(self, start: int, step: int, row: int) -> IntArray:
        """Return the columns of the body, ascending, that carry cloth: from `start` on in the
        direction `step`."""
        columns = np.arange(start, start + step * max(2, int(HOLD / self.cell)), step)
        columns = columns[(columns >= 0) & (columns < len(self.front))]
        there = np.isfinite(self.front[columns, row])
        return np.sort(columns[: len(columns) if there.all() else int(np.argmin(there))])

    def _side(self, columns: IntArray, row: int) -> int:
        """Return a positive number if more of the columns belong to the left leg, a negative one if
        more belong to the right leg."""
        return int(self.left[columns, row].sum()) - int(self.right[columns, row].sum())

    def _middle(self, columns: IntArray, row: int) -> float:
        return float((self.front[columns, row] + self.back[columns, row]).mean() / 2)


def span_legs(
    legs: LegColumns, gaps: BoolArray, outline: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Span cloth over gaps between the legs: in each row, the convex hull of both legs.

    Parameters
    ----------
    legs : LegColumns
    gaps : (nx, ny) bool
        Result of `LegColumns.gaps`.
    outline : (nx, ny)
        Signed distance to the mask's contour, meters, negative inside.

    Returns
    -------
    share : (nx, ny)
        Weight of the cloth in a column's depth, from 0 to 1: 1 in gaps and on the body beside them,
        decreasing above.
    front, back : (nx, ny)
        Depth of the cloth, meters; 0 in columns without cloth.
    """
    front, back, share = np.zeros((3, *gaps.shape))
    for row in np.flatnonzero(gaps.any(axis=0)):
        for begin, end in _runs(gaps[:, row]):
            columns, before, behind = legs.hull(begin, end, row)
            front[columns, row], back[columns, row], share[columns, row] = before, behind, 1.0
            if not gaps[max(begin - 2, 0) : end + 2, row + 1 : row + 3].any():
                _lay_on(legs, (begin + end) // 2, row + 1, front, back, share)
    chosen = share > 0
    if not chosen.any():
        return share, front, back
    front, back = _smooth(front, chosen), _smooth(back, chosen)
    rim = np.clip(-outline / HEM, 0, 1)
    shrink = np.where(gaps, np.sqrt(rim * (2 - rim)), 1.0)
    middle, half = (front + back) / 2, np.maximum((front - back) / 2, 0)
    own_front, own_back = (
        np.where(np.isfinite(own), own, other)
        for own, other in ((legs.front, front), (legs.back, back))
    )
    front = own_front + share * (middle + shrink * half - own_front)
    back = own_back + share * (middle - shrink * half - own_back)
    return share, np.where(chosen, front, 0), np.where(chosen, back, 0)


def _lay_on(
    legs: LegColumns,
    column: int,
    start: int,
    front: FloatArray,
    back: FloatArray,
    share: FloatArray,
) -> None:
    """Continue the cloth above the top of a gap, from the row `start` on.

    It is the hull of trunk and thighs around a column, with decreasing weight.
    """
    count = int(ABOVE / legs.cell)
    for done in range(count):
        row = start + done
        if row >= front.shape[1] or not np.isfinite(legs.front[column, row]):
            return
        columns, before, behind = legs.hull(column, column, row)
        faded = (1 - done / count) ** 2 * (1 + 2 * done / count)
        new = share[columns, row] < faded
        columns, before, behind = columns[new], before[new], behind[new]
        front[columns, row], back[columns, row], share[columns, row] = before, behind, faded


def _runs(there: BoolArray) -> list[tuple[int, int]]:
    """Return start and end (exclusive) of each run of True in (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(np.int8), [0]])))
    return [(int(begin), int(end)) for begin, end in zip(edges[::2], edges[1::2], strict=True)]


def _upper_hull(x: IntArray, z: FloatArray, at: IntArray) -> FloatArray:
    """Return the upper convex hull of points (x, z), x ascending, at the positions `at`."""
    kept: list[int] = []
    for i in range(len(x)):
        while len(kept) > 1:
            a, b = kept[-2], kept[-1]
            if (z[b] - z[a]) * (x[i] - x[a]) > (z[i] - z[a]) * (x[b] - x[a]):
                break
            kept.pop()
        kept.append(i)
    return np.asarray(np.interp(at, x[kept], z[kept]))


def _large_enough(gaps: BoolArray, cell: float) -> BoolArray:
    """Return the connected pieces of `gaps` that are at least `SMALLEST` high and somewhere at
    least as wide."""
    from scipy.ndimage import find_objects, label

    pieces, count = label(gaps, np.ones((3, 3)))
    large = np.zeros(count + 1, bool)
    for number, box in enumerate(find_objects(pieces), 1):
        own = pieces[box] == number
        large[number] = min(own.sum(axis=0).max(), own.any(axis=0).sum()) * cell >= SMALLEST
    kept: BoolArray = large[pieces]
    return kept


def _smooth(values: FloatArray, there: BoolArray, sigma: float = 2.0) -> FloatArray:
    """Average values (nx, ny) with their neighbors among `there`."""
    from scipy.ndimage import gaussian_filter

    weight = gaussian_filter(there.astype(np.float64), sigma)
    return np.where(
        there, gaussian_filter(np.where(there, values, 0.0), sigma) / np.maximum(weight, 1e-6), 0.0
    )
