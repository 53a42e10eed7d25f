"""Borders between regions of a picture, continued straight through a hole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.types import BoolArray, FloatArray, IntArray

_NEAR = 0.16
"""Borders up to this distance from the hole are continued, a fraction of the longer side."""
_END = 0.03
"""Largest distance of the visible end of a border from the hole, a fraction of the longer side."""
_SHORTEST = 0.035
"""Shortest border that is continued, a fraction of the longer side."""
_LINES = 14
"""Largest number of borders that are continued."""
_ENDS = 40
"""Largest number of places at which regions may end."""
_LEAST_CONTACT = 0.012
"""Least length at which a part of a region has to meet the hole, a fraction of the longer side."""
_ALONG = 0.08
"""Cost of a pixel of border between two cells along the continued border of the same two
regions."""
_ACROSS = 0.6
"""Cost of a pixel of any other border between cells; at the rim of the hole it is 1."""
_SWEEPS = 20
"""Largest number of sweeps over all cells from one start."""
_SHAKES = 60
"""Number of trials in which some cells get another region."""
_REGIONS = 12
"""Largest number of regions whose ends are searched."""


@dataclass(frozen=True)
class _Line:
    """A border between two regions that is continued."""

    point: FloatArray
    along: FloatArray
    length: float
    pair: tuple[int, int]


def _lines(labels: IntArray, hole: BoolArray) -> list[_Line]:
    """Return the straight borders that end at the hole, longest first."""
    import cv2

    longest = max(hole.shape)
    away = cv2.distanceTransform((~hole).astype(np.uint8), cv2.DIST_L2, 5)
    found: list[_Line] = []
    for (a, b), rows in _borders(labels, away < _NEAR * longest).items():
        picture = np.zeros(hole.shape, np.uint8)
        picture[rows[:, 1], rows[:, 0]] = 255
        least = max(10.0, _SHORTEST * longest)
        segments = cv2.HoughLinesP(picture, 1, np.pi / 360, 10, None, least, 0.01 * longest)
        for x0, y0, x1, y1 in [] if segments is None else segments.reshape(-1, 4):
            line = _fitted(rows, np.array([x0, y0], float), np.array([x1, y1], float), (a, b))
            ends = np.array([[x0, y0], [x1, y1]])
            if line is not None and away[ends[:, 1], ends[:, 0]].min() < _END * longest:
                found.append(line)
    kept: list[_Line] = []
    for line in sorted(found, key=lambda one: -one.length):
        if not any(_coincide(line, other, 0.012 * longest) for other in kept):
            kept.append(line)
    return [*kept[:_LINES], *_ends(labels, hole)]


def _ends(labels: IntArray, hole: BoolArray) -> list[_Line]:
    """Return vertical and horizontal lines at which a region ends if its border is not visible.

    They pass through the outermost points at which a region meets the hole. The largest region has
    none.
    """
    import cv2

    ring = cv2.dilate(hole.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & ~hole
    names, counts = np.unique(labels[ring], return_counts=True)
    found = []
    for name in names[np.argsort(-counts)][1:_REGIONS]:
        _, parts = cv2.connectedComponents((labels == name).astype(np.uint8))
        for part in np.unique(parts[ring & (parts > 0)]):
            rows, columns = np.nonzero(ring & (parts == part))
            if len(rows) < _LEAST_CONTACT * max(hole.shape):
                continue
            for x in (columns.min(), columns.max() + 1):
                found.append(_Line(np.array([float(x), 0.0]), np.array([0.0, 1.0]), 0.0, (-1, -1)))
            for y in (rows.min(), rows.max() + 1):
                found.append(_Line(np.array([0.0, float(y)]), np.array([1.0, 0.0]), 0.0, (-1, -1)))
    return found[:_ENDS]


def _borders(labels: IntArray, near: BoolArray) -> dict[tuple[int, int], IntArray]:
    """Return the pixels (N, 2), x and y, at the border of each pair of regions."""
    found: dict[tuple[int, int], list[IntArray]] = {}
    for dy, dx in ((0, 1), (1, 0)):
        one, two = labels[: labels.shape[0] - dy, : labels.shape[1] - dx], labels[dy:, dx:]
        rows, columns = np.nonzero(
            (one != two) & (one >= 0) & (two >= 0) & near[: one.shape[0], : one.shape[1]]
        )
        low = np.minimum(one[rows, columns], two[rows, columns])
        high = np.maximum(one[rows, columns], two[rows, columns])
        for a, b in np.unique(np.stack([low, high], axis=1), axis=0):
            own = (low == a) & (high == b)
            found.setdefault((int(a), int(b)), []).append(
                np.stack([columns[own], rows[own]], axis=1)
            )
    return {pair: np.concatenate(parts) for pair, parts in found.items()}


def _fitted(
    rows: IntArray, begin: FloatArray, end: FloatArray, pair: tuple[int, int]
) -> _Line | None:
    """Fit a line to the pixels of a border between two of its points."""
    along = end - begin
    length = float(np.linalg.norm(along))
    along = along / length
    for _ in range(2):
        offset = rows - begin
        place, aside = offset @ along, offset @ np.array([-along[1], along[0]])
        own = (np.abs(aside) < 2.0) & (place > -2) & (place < length + 2)
        if own.sum() < 0.6 * length:
            return None
        points = rows[own].astype(float)
        middle = points.mean(axis=0)
        _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
        along = axes[0] * np.sign(axes[0] @ along)
        begin = middle + along * ((begin - middle) @ along)
    return _Line(begin + 0.5, along, length, pair)


def _coincide(line: _Line, other: _Line, gap: float) -> bool:
    """Return whether two lines nearly coincide."""
    if abs(line.along @ other.along) < np.cos(np.radians(4)):
        return False
    normal = np.array([-other.along[1], other.along[0]])
    ends = np.array([line.point, line.point + line.length * line.along])
    return bool(np.abs((ends - other.point) @ normal).max() < gap)


def _cells(lines: list[_Line], hole: BoolArray) -> tuple[IntArray, IntArray]:
    """Cut the hole into connected cells (H, W) along the lines; -1 outside.

    Also return the sides of the lines on which each pixel lies (H, W), one bit per line.
    """
    import cv2

    rows, columns = np.nonzero(hole)
    points = np.stack([columns + 0.5, rows + 0.5], axis=1)
    sides = np.zeros(hole.shape, np.int64)
    for number, line in enumerate(lines):
        beyond = (points - line.point) @ np.array([-line.along[1], line.along[0]]) > 0
        sides[rows, columns] |= beyond.astype(np.int64) << number
    count, cells = 0, np.full(hole.shape, -1, np.int32)
    for code in np.unique(sides[hole]):
        own = (hole & (sides == code)).astype(np.uint8)
        number, parts = cv2.connectedComponents(own, connectivity=4)
        cells[parts > 0] = parts[parts > 0] - 1 + count
        count += number - 1
    return cells, sides


def assign_regions(labels: IntArray, hole: BoolArray) -> IntArray:
    """Assign a region to each cell of the hole, so that borders are short.

    Borders along continued lines cost less.
    """
    known = np.unique(labels[labels >= 0])
    if not hole.any() or not len(known):
        return np.where(hole, 0, labels).astype(np.int32)
    lines = _lines(labels, hole)
    cells, sides = _cells(lines, hole)
    rim = np.zeros((int(cells.max()) + 1, len(known)))
    edges: dict[tuple[int, int, int], float] = {}
    for dy, dx in ((0, 1), (1, 0)):
        one = np.s_[: labels.shape[0] - dy, : labels.shape[1] - dx]
        two = np.s_[dy:, dx:]
        for inner, outer in ((one, two), (two, one)):
            at = (cells[inner] >= 0) & (labels[outer] >= 0)
            np.add.at(rim, (cells[inner][at], np.searchsorted(known, labels[outer][at])), 1.0)
        at = (cells[one] >= 0) & (cells[two] >= 0) & (cells[one] != cells[two])
        apart = sides[one][at] ^ sides[two][at]
        rows = np.stack([cells[one][at], cells[two][at], apart], axis=1)
        for (a, b, bits), length in zip(*np.unique(rows, axis=0, return_counts=True), strict=True):
            key = int(a), int(b), int(bits)
            edges[key] = edges.get(key, 0.0) + float(length)
    prices = np.full((len(edges), len(known), len(known)), _ACROSS)
    prices[:, np.arange(len(known)), np.arange(len(known))] = 0
    for number, ((_, _, bits), length) in enumerate(edges.items()):
        for index, line in enumerate(lines):
            if bits >> index & 1 and line.pair[0] >= 0:
                a, b = np.searchsorted(known, line.pair)
                prices[number, a, b] = prices[number, b, a] = _ALONG
        prices[number] *= length
    ends = np.array([key[:2] for key in edges], np.int64).reshape(-1, 2)
    chosen = _cheapest_labels(rim.sum(axis=1, keepdims=True) - rim, ends, prices)
    result = labels.copy()
    result[hole] = known[chosen[cells[hole]]]
    return result


def _cheapest_labels(unary: FloatArray, ends: IntArray, prices: FloatArray) -> IntArray:
    """Choose a label for each cell (C,) with a small total cost.

    The costs are `unary` (C, L) per cell, and `prices` (E, L, L) per edge between two cells, whose
    numbers are `ends` (E, 2).

    It uses iterated conditional modes from several starts. Then some neighboring cells get the same
    label; the change is kept if it lowers the cost.
    """
    generator = np.random.default_rng(0)
    count, labels = unary.shape
    useful = np.flatnonzero((unary < unary.max(axis=1, keepdims=True)).any(axis=0))
    useful = useful if len(useful) else np.arange(labels)
    first = [np.flatnonzero(ends[:, 0] == cell) for cell in range(count)]
    second = [np.flatnonzero(ends[:, 1] == cell) for cell in range(count)]

    def settled(chosen: IntArray) -> IntArray:
        for _ in range(_SWEEPS):
            before = chosen.copy()
            for cell in generator.permutation(count):
                price = unary[cell].copy()
                price += prices[first[cell], :, chosen[ends[first[cell], 1]]].sum(axis=0)
                price += prices[second[cell], chosen[ends[second[cell], 0]], :].sum(axis=0)
                chosen[cell] = useful[np.argmin(price[useful])]
            if (chosen == before).all():
                break
        return chosen

    def cost(chosen: IntArray) -> float:
        between = prices[np.arange(len(ends)), chosen[ends[:, 0]], chosen[ends[:, 1]]]
        return float(unary[np.arange(count), chosen].sum() + between.sum())

    starts = [unary.argmin(axis=1), *(np.full(count, name) for name in useful)]
    best = min((settled(start.copy()) for start in starts), key=cost)
    least = cost(best)
    for _ in range(_SHAKES):
        cell = int(generator.integers(count))
        around = np.union1d(ends[(ends == cell).any(axis=1)], cell)
        shaken = best.copy()
        shaken[around[generator.random(len(around)) < 0.7]] = generator.choice(useful)
        shaken = settled(shaken)
        if (now := cost(shaken)) < least:
            best, least = shaken, now
    return best
