"""Patch matching on a surface: which place of the photo each unseen vertex continues."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.geometry.compiled import compiled
from a2v.reconstruction.backs.exemplar import Exemplar
from a2v.types import BoolArray, FloatArray, IntArray


def match_surface(
    exemplar: Exemplar,
    vertices: FloatArray,
    maps: FloatArray,
    neighbors: IntArray,
    labels: IntArray,
    *,
    known: BoolArray,
    rounds: int = 4,
    height_weight: float = 0.02,
    seed: int = 0,
) -> tuple[FloatArray, BoolArray]:
    """Places (V, 2) in the exemplar, pixels, that vertices continue, and for which vertices (V,) there is one.

    The detail around each place goes on where its neighbours' ends, as well as can be: PatchMatch (Barnes et al. 2009) with a surface in place
    of a target picture. A vertex tries what its neighbours have, moved by the way to it (`maps`), what lies around its own place, ever
    nearer, and its mirrored pixel; it keeps what differs least from what its neighbours expect around it. `known` vertices keep their
    own pixels, so the pattern begins at the seam in phase; a small cost for places at another height along the limb keeps rings level.

    Parameters
    ----------
    exemplar : Exemplar
    vertices : (V, 3)
    maps : (V, 2, 3)
        `unrolling`.
    neighbors : (V, N) int
    labels : (V,) int
        0 for vertices that continue nothing.
    known : (V,) bool
    rounds : int
        Sweeps over the surface, there and back.
    height_weight : float
        Cost of a centimetre of height, in units of the detail's variance.
    seed : int
    """
    home = exemplar.camera.project(vertices)
    usable = np.zeros(int(labels.max()) + 1, bool)
    for kind in range(1, len(usable)):
        usable[kind] = (exemplar.sources & (exemplar.labels == kind)).sum() > 60
    wanted = ~known & usable[labels]
    order = _from_known(vertices, known & (labels > 0), wanted)
    place = np.where(known[:, None], home, -1.0)
    pools, starts = _pools(exemplar, len(usable))
    detail = np.ascontiguousarray(exemplar.detail)
    spread = np.array([_variance(detail, exemplar, kind) for kind in range(len(usable))])
    metre = exemplar.camera.scale
    run = compiled(_sweep)
    generator = np.random.default_rng(seed)
    arguments = (
        detail, exemplar.labels.astype(np.int64), exemplar.sources, np.ascontiguousarray(vertices, np.float64),
        np.ascontiguousarray(maps, np.float64), neighbors.astype(np.int64), labels.astype(np.int64),
    )  # fmt: skip
    for sweep in range(2 * rounds):
        draws = generator.random((len(order), 8, 2))
        way = order if sweep % 2 == 0 else order[::-1]
        reach = max(4.0, 0.25 * metre * 0.5**sweep)
        run(*arguments, np.ascontiguousarray(way), place, home, pools, starts, spread, draws, metre, reach, height_weight)
    return place, wanted & (place[:, 0] >= 0)


def _variance(detail: FloatArray, exemplar: Exemplar, kind: int) -> float:
    own = exemplar.sources & (exemplar.labels == kind)
    return max(float((detail[own] ** 2).sum(axis=-1).mean()), 1e-6) if own.any() else 1.0


def _pools(exemplar: Exemplar, count: int) -> tuple[IntArray, IntArray]:
    """Places (n, 2), column and row, that each label may take detail from, one label after the other, and where each label's begin."""
    found = [np.argwhere(exemplar.sources & (exemplar.labels == kind))[:, ::-1] for kind in range(count)]
    starts = np.concatenate([[0], np.cumsum([len(part) for part in found])])
    return np.ascontiguousarray(np.concatenate(found), np.int64).reshape(-1, 2), starts.astype(np.int64)


def _from_known(vertices: FloatArray, known: BoolArray, wanted: BoolArray) -> IntArray:
    """The wanted vertices, those next to known ones first."""
    from scipy.spatial import cKDTree

    number = np.flatnonzero(wanted)
    if not known.any() or not len(number):
        return number
    reach = cKDTree(vertices[known]).query(vertices[number], workers=1)[0]
    return number[np.argsort(reach, kind="stable")]


def _sweep(
    detail: Any, kinds: Any, sources: Any, vertices: Any, maps: Any, neighbors: Any, labels: Any, order: Any, place: Any, home: Any,
    pools: Any, starts: Any, spread: Any, draws: Any, metre: float, reach: float, height_weight: float,
) -> None:  # fmt: skip
    """One pass of `match_surface` over `order`, which changes `place`. Plain loops: compiled by numba."""
    height, width = kinds.shape
    count = neighbors.shape[1]
    expected_u, expected_v = np.empty(count), np.empty(count)
    tries_u, tries_v = np.empty(count + 12), np.empty(count + 12)
    for step in range(len(order)):
        i = order[step]
        kind = labels[i]
        near = 0
        for slot in range(count):
            j = neighbors[i, slot]
            if j == i or labels[j] != kind or place[j, 0] < 0:
                continue
            x = y = 0.0
            for axis in range(3):
                away = vertices[i, axis] - vertices[j, axis]
                x += 0.5 * (maps[i, 0, axis] + maps[j, 0, axis]) * away
                y += 0.5 * (maps[i, 1, axis] + maps[j, 1, axis]) * away
            expected_u[near], expected_v[near] = place[j, 0] + metre * x, place[j, 1] - metre * y
            near += 1
        tries = 0
        if place[i, 0] >= 0:
            tries_u[0], tries_v[0] = place[i, 0], place[i, 1]
            tries = 1
        for slot in range(near):
            tries_u[tries], tries_v[tries] = expected_u[slot], expected_v[slot]
            tries += 1
        tries_u[tries], tries_v[tries] = home[i, 0], home[i, 1]
        tries += 1
        size = reach
        for draw in range(5):
            if place[i, 0] >= 0:
                tries_u[tries] = place[i, 0] + (2 * draws[step, draw, 0] - 1) * size
                tries_v[tries] = place[i, 1] + (2 * draws[step, draw, 1] - 1) * size
                tries += 1
            size *= 0.5
        pool = starts[kind + 1] - starts[kind]
        for draw in range(5, 8):
            pick = starts[kind] + int(draws[step, draw, 0] * pool)
            tries_u[tries], tries_v[tries] = pools[pick, 0] + 0.5, pools[pick, 1] + 0.5
            tries += 1
        best, best_u, best_v = np.inf, place[i, 0], place[i, 1]
        for attempt in range(tries):
            u, v = tries_u[attempt], tries_v[attempt]
            column, row = int(np.floor(u)), int(np.floor(v))
            if column < 5 or row < 5 or column >= width - 5 or row >= height - 5:
                continue
            if not sources[row, column] or kinds[row, column] != kind:
                continue
            cost = height_weight * spread[kind] * ((v - home[i, 1]) / metre * 100.0) ** 2 / (1.0 + ((v - home[i, 1]) / metre * 20.0) ** 2)
            terms = 0
            total = 0.0
            for slot in range(near):
                other_u, other_v = int(np.floor(expected_u[slot])), int(np.floor(expected_v[slot]))
                if other_u < 5 or other_v < 5 or other_u >= width - 5 or other_v >= height - 5:
                    continue
                if kinds[other_v, other_u] != kind:
                    continue
                terms += 1
                if other_u == column and other_v == row:
                    continue
                for dy in range(-4, 5, 2):
                    for dx in range(-4, 5, 2):
                        for channel in range(3):
                            gap = detail[row + dy, column + dx, channel] - detail[other_v + dy, other_u + dx, channel]
                            total += gap * gap
            if terms:
                cost += total / (25.0 * terms)
            if cost < best:
                best, best_u, best_v = cost, u, v
        if best < np.inf:
            place[i, 0], place[i, 1] = best_u, best_v
