"""Match patches on a surface: find the place of the photo that each unseen vertex continues."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.geometry.compiled import compiled
from a2v.reconstruction.backs.exemplar import Exemplar
from a2v.system import thread_count
from a2v.types import BoolArray, FloatArray, IntArray

ROUNDS = 4
"""Number of sweeps over the surface, forward and backward."""
HEIGHT_WEIGHT = 0.02
"""Cost of a squared difference of height, per square centimeter, in units of the variance of the
detail; constant above 5 cm."""


@dataclass(frozen=True, eq=False)
class Unrolled:
    """A surface, unrolled around each of its vertices.

    Attributes
    ----------
    vertices : (V, 3)
    maps : (V, 2, 3)
        `unrolling`.
    neighbors : (V, N) int
    """

    vertices: FloatArray
    maps: FloatArray
    neighbors: IntArray


def match_surface(
    exemplar: Exemplar,
    cloth: Unrolled,
    labels: IntArray,
    *,
    home: FloatArray,
    known: BoolArray,
    seed: int = 0,
) -> tuple[FloatArray, BoolArray]:
    """Find the places (V, 2) of the exemplar, pixels, that vertices continue, and which vertices
    (V,) have one.

    The detail around each place continues that of its neighbors as well as possible: PatchMatch
    (Barnes et al. 2009) with a surface instead of a target picture. The candidates of a vertex are
    the places of its neighbors, shifted by the vector to it (`maps`), random places around its own
    at decreasing distances, and its own pixel, the one in front of it, or that of its mirrored
    spot. It keeps the candidate whose surroundings differ least from those of its neighbors'
    places. `known` vertices keep their own pixels, so that the pattern continues in phase at the
    seam. A small cost for places at another height along the limb keeps rings level.

    Parameters
    ----------
    exemplar : Exemplar
    cloth : Unrolled
    labels : (V,) int
        0 for vertices that continue nothing.
    home : (V, 2)
        Pixels of the exemplar that are the first candidates of the vertices.
    known : (V,) bool
    seed : int
    """
    vertices, neighbors = cloth.vertices, cloth.neighbors
    usable = np.zeros(int(labels.max()) + 1, bool)
    for kind in range(1, len(usable)):
        usable[kind] = (exemplar.sources & (exemplar.labels == kind)).sum() > 60
    wanted = ~known & usable[labels]
    order = _matching_order(vertices, known & (labels > 0), wanted)
    place = np.where(known[:, None], home, -1.0)
    detail, meter = np.ascontiguousarray(exemplar.detail), exemplar.camera.scale
    leash = HEIGHT_WEIGHT * np.array(
        [_variance(detail, exemplar, kind) for kind in range(len(usable))]
    )
    maps = np.asarray(cloth.maps, np.float64)
    steps = vertices[:, None] - vertices[neighbors]
    ways = (
        meter * np.einsum("vnij,vnj->vni", 0.5 * (maps[:, None] + maps[neighbors]), steps) * [1, -1]
    )
    pools = [
        np.argwhere(exemplar.sources & (exemplar.labels == kind))[:, ::-1] + 0.5
        for kind in range(len(usable))
    ]
    run, generator = compiled(_sweep), np.random.default_rng(seed)
    for sweep in range(2 * ROUNDS):
        way = order if sweep % 2 == 0 else order[::-1]
        tries = _candidates(
            way,
            place,
            home,
            labels,
            pools,
            reach=max(4.0, 0.125 * meter * 0.5**sweep),
            generator=generator,
        )
        run(
            detail,
            exemplar.labels.astype(np.int64),
            exemplar.sources,
            neighbors.astype(np.int64),
            ways,
            labels.astype(np.int64),
            np.ascontiguousarray(way),
            place,
            home,
            tries,
            leash,
            meter,
        )
    return place, wanted & (place[:, 0] >= 0)


def _variance(detail: FloatArray, exemplar: Exemplar, kind: int) -> float:
    own = exemplar.sources & (exemplar.labels == kind)
    return max(float((detail[own] ** 2).sum(axis=-1).mean()), 1e-6) if own.any() else 1.0


def _candidates(
    order: IntArray,
    place: FloatArray,
    home: FloatArray,
    labels: IntArray,
    pools: list[FloatArray],
    *,
    reach: float,
    generator: np.random.Generator,
) -> FloatArray:
    """Candidates (n, 10, 2) of the vertices of `order` (n,): their own place, the mirrored one,
    five at decreasing distances from their own, three anywhere."""
    own = place[order][:, None]
    around = (
        own
        + (2 * generator.random((len(order), 5, 2)) - 1) * (reach * 0.5 ** np.arange(5))[:, None]
    )
    around[place[order, 0] < 0] = -1.0
    anywhere, draws = np.full((len(order), 3, 2), -1.0), generator.random((len(order), 3))
    for kind, pool in enumerate(pools):
        mine = labels[order] == kind
        if len(pool):
            anywhere[mine] = pool[(draws[mine] * len(pool)).astype(np.int64)]
    return np.concatenate([own, home[order][:, None], around, anywhere], axis=1)


def _matching_order(vertices: FloatArray, known: BoolArray, wanted: BoolArray) -> IntArray:
    """Return the vertices to be matched, those next to known ones first."""
    from scipy.spatial import cKDTree

    number = np.flatnonzero(wanted)
    if not known.any() or not len(number):
        return number
    reach = cKDTree(vertices[known]).query(vertices[number], workers=thread_count())[0]
    return number[np.argsort(reach, kind="stable")]


def _sweep(
    detail: Any,
    kinds: Any,
    sources: Any,
    neighbors: Any,
    ways: Any,
    labels: Any,
    order: Any,
    place: Any,
    home: Any,
    tries: Any,
    leash: Any,
    meter: float,
) -> None:
    """One pass of `match_surface` over `order`, which changes `place`. Plain loops: compiled by
    numba.

    `ways` (V, N, 2) lead to each vertex from its neighbors, pixels; `tries` (n, K, 2) are the
    candidates of each vertex of `order` (negative: none); `leash` (labels,) is the cost of a square
    centimeter of height.
    """
    height, width = kinds.shape
    count, extra = neighbors.shape[1], tries.shape[1]
    expected, candidates = np.empty((count, 2)), np.empty((count + extra, 2))
    columns, rows = np.empty(count, np.int64), np.empty(count, np.int64)
    for step in range(len(order)):
        i = order[step]
        near = 0
        for slot in range(count):
            j = neighbors[i, slot]
            if j == i or labels[j] != labels[i] or place[j, 0] < 0:
                continue
            expected[near, 0], expected[near, 1] = (
                place[j, 0] + ways[i, slot, 0],
                place[j, 1] + ways[i, slot, 1],
            )
            candidates[near] = expected[near]
            near += 1
        candidates[near : near + extra] = tries[step]
        terms = 0  # surroundings of neighbors' places with which candidates are compared
        for slot in range(near):
            x, y = int(np.floor(expected[slot, 0])), int(np.floor(expected[slot, 1]))
            if x < 5 or y < 5 or x >= width - 5 or y >= height - 5 or kinds[y, x] != labels[i]:
                continue
            columns[terms], rows[terms] = x, y
            terms += 1
        best, best_u, best_v = np.inf, place[i, 0], place[i, 1]
        for attempt in range(near + extra):
            u, v = candidates[attempt]
            column, row = int(np.floor(u)), int(np.floor(v))
            if column < 5 or row < 5 or column >= width - 5 or row >= height - 5:
                continue
            if not sources[row, column] or kinds[row, column] != labels[i]:
                continue
            lift = 100.0 * (v - home[i, 1]) / meter
            cost = leash[labels[i]] * lift * lift / (1.0 + 0.04 * lift * lift)
            total = 0.0
            for slot in range(terms):
                if cost + total / (25.0 * terms) >= best:
                    break  # the sum only grows: this candidate has lost
                x, y = columns[slot], rows[slot]
                if x == column and y == row:
                    continue
                for dy in range(-4, 5, 2):
                    for dx in range(-4, 5, 2):
                        for channel in range(3):
                            gap = (
                                detail[row + dy, column + dx, channel]
                                - detail[y + dy, x + dx, channel]
                            )
                            total += gap * gap
            if terms:
                cost += total / (25.0 * terms)
            if cost < best:
                best, best_u, best_v = cost, u, v
        if best < np.inf:
            place[i, 0], place[i, 1] = best_u, best_v
