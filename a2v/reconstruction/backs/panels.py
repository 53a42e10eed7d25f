"""Panels of a garment: areas of another color than the rest, with sharp borders.

A jacket may have white flanks, a shirt a yellow side. Where the photo ends within such a panel, its
color must not fade into the color of the garment over the unseen side: a panel continues a little,
and ends at a border.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import on_parts
from a2v.reconstruction.backs.pieces import joined_pieces, neighbor_mean, with_votes
from a2v.reconstruction.backs.seen import LIMB_PARTS, LOWER, UPPER, BackEvidence
from a2v.reconstruction.palettes import color_clusters, lab_of, palette_distance
from a2v.types import BoolArray, FloatArray, IntArray

SHADE = np.array([0.8, 1.0, 1.0])
"""Weights of lightness, a and b: shadows are the same color."""
_KMEANS_ROUNDS = 10
"""Rounds of k-means."""
_COLORS = 6
"""Largest number of colors of a garment before similar ones are joined."""
PANELS_APART = 30.0
"""Distance of two colors of a garment from which on they are panels, CIELAB units."""
_LEAST = 150
"""Smallest number of visible vertices of a garment, of which the colors are found."""
_SHARE = 0.03
"""Smallest share of the visible vertices of a garment that is a panel."""
_PURE = 0.75
"""Smallest share of a panel's vertices whose neighborhood mostly has the same color. Stripes,
checks and camouflage have less: their colors are detail, and no panels."""
_SMOOTHING = 6
"""Rounds of votes among visible vertices."""
_ROUNDS = 30
"""Rounds of votes over the unseen side."""
_EXPECTED = 0.4
"""Weight of the distance from the expected color."""
_MOST_EXPECTED = 40.0
"""Largest distance from the expected color that counts, CIELAB units."""
_FREE = 0.03
"""Distance from its nearest visible vertex up to which a panel on one side goes on, meters."""
_REACH = (300.0, 24.0)
"""Cost of such a panel per meter beyond, and the largest one, CIELAB units."""
_BAND = (0.4, 0.8)
"""Share of the visible vertices at a level up to which a panel is on one side, and from which on it
is a band around the body."""
_LEVEL = 24
"""Number of visible vertices at the same level of which the share of a panel is found."""
_SLEEVE = 30
"""Smallest number of visible vertices of a sleeve."""
_JACKET = (0.2, 0.9)
"""Range of the share of an open jacket in the visible trunk."""
_EVENING = 5
"""Rounds of means of neighbors of which an open jacket is found."""
_SAME = 8.0
"""Largest distance of the colors of two sleeves of a jacket, without lightness, CIELAB units."""
_DIFFERENT = 8.0
"""Smallest distance of a jacket from the shirt below it, without lightness, CIELAB units."""
_MOST_DIFFERENT = 0.8
"""Quantile of this distance on the trunk above which a place shows the shirt."""
_TELLING = 60
"""Number of visible vertices that tell the color of a hidden one."""


def find_panels(seen: BackEvidence, labels: IntArray) -> tuple[IntArray, FloatArray]:
    """Split the garments into panels.

    Parameters
    ----------
    seen : BackEvidence
    labels : (V,) int
        Index into `KINDS`.

    Returns
    -------
    panels : (V,) int
        0 outside of garments that have panels; other numbers differ between garments.
    colors : (V, 3) float64
        Color that the photo shows nearby of the same panel, sRGB; NaN outside of panels.
    """
    panels, colors = np.zeros(len(labels), int), np.full((len(labels), 3), np.nan)
    count = 0
    for kind in (UPPER, LOWER):
        own = labels == kind
        if seen.strands is not None:
            own &= ~seen.strands
        found = _of_garment(_Garment.of(seen, own))
        if found is None:
            continue
        panel, nearby = found
        panels[own], colors[own] = panel + count + 1, nearby
        count += int(panel.max()) + 1
    return panels, colors


@dataclass(frozen=True, eq=False)
class _Garment:
    """The n vertices of one garment.

    Attributes
    ----------
    places : (n, 3) float64
        At rest if that is known, meters.
    parts : (n,) int
    colors : (n, 3) float64
        sRGB; expected ones where they are not `known`.
    known, held : (n,) bool
        Vertices that the photo shows, and those that it shows at least on the mirrored side.
    twin : (n,) int
        Number of the mirrored vertex where only that one is visible; elsewhere the vertex itself.
    near : (n, N) int
        Neighbors in the garment; the vertex itself in place of others.
    """

    places: FloatArray
    parts: IntArray
    colors: FloatArray
    known: BoolArray
    held: BoolArray
    twin: IntArray
    near: IntArray

    @classmethod
    def of(cls, seen: BackEvidence, own: BoolArray) -> _Garment:
        """The garment of the vertices `own` (V,)."""
        vertices = np.flatnonzero(own)
        itself = np.arange(len(vertices))
        number = np.full(len(own), -1)
        number[vertices] = itself
        near, known, twin = number[seen.neighbors[vertices]], seen.known[vertices], seen.twin
        there = np.where(twin[vertices] >= 0, number[twin[vertices]], -1)
        lent = ~known & (there >= 0) & known[there]
        return cls(
            places=np.asarray((seen.vertices if seen.rest is None else seen.rest)[vertices], float),
            parts=seen.parts[vertices],
            colors=np.asarray(seen.colors[vertices], float),
            known=known,
            held=known | lent,
            twin=np.where(lent, there, itself),
            near=np.where(near >= 0, near, itself[:, None]),
        )


def _of_garment(garment: _Garment) -> tuple[IntArray, FloatArray] | None:
    """The panel (n,) of each vertex, and the color (n, 3) that the photo shows of that panel
    nearby; None for a garment of one color, or with a pattern."""
    known = garment.known
    if known.sum() < _LEAST or known.all():
        return None
    found = _visible_panels(garment) or _open_jacket(garment)
    if found is None:
        return None
    away, panel = found
    panel = _continued(garment, _costs(garment, away, panel), panel)
    colors = garment.colors.copy()
    for one in np.unique(panel):
        shown, hidden = known & (panel == one), ~known & (panel == one)
        if hidden.any():
            colors[hidden] = _mean_nearby(garment, shown, hidden)
    return panel, colors


def _costs(garment: _Garment, away: FloatArray, panel: IntArray) -> FloatArray:
    """Cost (n, K) of each panel at each vertex, from the distances `away` (n, K) of the colors and
    the visible places of each panel."""
    from scipy.spatial import cKDTree

    cost = _EXPECTED * np.minimum(away, _MOST_EXPECTED)
    level = _level_shares(garment, panel, away.shape[1])
    for one in range(away.shape[1]):
        shown = garment.places[garment.known & (panel == one)]
        far = cKDTree(shown).query(garment.places, workers=1)[0]
        # a band around the body goes on at its height, a panel on one side ends
        one_side = np.clip((_BAND[1] - level[:, one]) / (_BAND[1] - _BAND[0]), 0, 1)
        cost[:, one] += one_side * np.clip(_REACH[0] * (far - _FREE), 0, _REACH[1])
    outer = _of_sleeves(garment, panel)
    if outer is not None:
        torso = on_parts(garment.parts, "torso")
        back = torso & (garment.places[:, 2] < garment.places[torso, 2].mean())
        cost[back] += _REACH[1]
        cost[back, outer] -= _REACH[1]
    return cost


def _of_sleeves(garment: _Garment, panel: IntArray) -> int | None:
    """The panel of an open jacket: that of both sleeves and of a part of the trunk's front. None
    without one."""
    sleeves = [
        panel[garment.known & on_parts(garment.parts, f"{side}_upper_arm")]
        for side in ("left", "right")
    ]
    if min(map(len, sleeves)) < _SLEEVE:
        return None
    first, second = (int(np.bincount(sleeve).argmax()) for sleeve in sleeves)
    trunk = panel[garment.known & on_parts(garment.parts, "torso")]
    share = (trunk == first).mean() if len(trunk) else 0.0
    return first if first == second and _JACKET[0] < share < _JACKET[1] else None


def _open_jacket(garment: _Garment) -> tuple[FloatArray, IntArray] | None:
    """An open jacket of a color like that of the shirt below it: panel 0, the jacket, has the color
    of both sleeves, panel 1, in one piece, what differs most from it on the trunk. None without
    one; like `_visible_panels`.

    Colors are means of neighbors, so that the texture of denim or a knit does not matter. The two
    differ by more than lightness: the sleeves of a plain shirt may be in shade.
    """
    mixing, known = neighbor_mean(garment.near), garment.known
    lab, weight = lab_of(garment.colors) * known[:, None], known.astype(float)
    for _ in range(_EVENING):
        lab, weight = mixing @ lab, mixing @ weight
    lab = lab / np.maximum(weight, 1e-9)[:, None]
    sleeves = [known & on_parts(garment.parts, f"{side}_upper_arm") for side in ("left", "right")]
    trunk = known & on_parts(garment.parts, "torso")
    if min(own.sum() for own in [*sleeves, trunk]) < _SLEEVE:
        return None
    outer, other = (np.median(lab[own], axis=0) for own in sleeves)
    jacket = (outer + other) / 2
    ways = _apart(lab, jacket)
    inner = np.median(lab[trunk & (ways >= np.quantile(ways[trunk], _MOST_DIFFERENT))], axis=0)
    if _apart(outer, other) > _SAME or _apart(jacket, inner) < _DIFFERENT:
        return None
    away = np.stack([palette_distance(lab, one[None], SHADE) for one in (jacket, inner)], axis=1)
    panel = away.argmin(axis=1)
    shirt = trunk & (panel == 1)
    pieces = np.bincount(joined_pieces(shirt, garment.near)[shirt])
    if not pieces.any() or pieces.max() < _PURE * pieces.sum() or _of_sleeves(garment, panel) != 0:
        return None
    return away, panel


def _apart(lab: FloatArray, other: FloatArray) -> FloatArray:
    """Distance (...) of colors (..., 3) from another (3,), CIELAB, without that of lightness: the
    chroma of a cloth in shade falls with its lightness."""
    light = np.maximum(lab[..., :1], 1.0)
    most = np.maximum(light, other[0])
    return np.asarray(
        np.linalg.norm(lab[..., 1:] * most / light - other[1:] * most / max(other[0], 1.0), axis=-1)
    )


def _continued(garment: _Garment, cost: FloatArray, panel: IntArray) -> IntArray:
    """Extend the visible `panel` (n,) to the unseen side, where the `cost` (n, K) and the votes of
    neighbors are least."""
    told = panel[garment.twin]
    total = with_votes(cost, garment.near, rounds=_ROUNDS, fixed=np.where(garment.held, told, -1))
    result = np.where(garment.held, told, total.argmin(axis=1))
    for _ in range(cost.shape[1] - 1):
        # an area that touches nothing visible of its panel is a wrong expectation
        piece = _pieces(result, garment.near)
        loose = np.bincount(piece, garment.held)[piece] == 0
        if not loose.any():
            break
        total[loose, result[loose]] = np.inf
        result[loose] = total[loose].argmin(axis=1)
    return np.asarray(result)


def _mean_nearby(garment: _Garment, shown: BoolArray, hidden: BoolArray) -> FloatArray:
    """Mean color of the `shown` (n,) vertices nearest to each of the `hidden` (n,) ones."""
    from scipy.spatial import cKDTree

    count = min(_TELLING, int(shown.sum()))
    _, nearest = cKDTree(garment.places[shown]).query(
        garment.places[hidden], k=[*range(1, count + 1)], workers=1
    )
    return np.asarray(garment.colors[shown][nearest].mean(axis=1))


def _level_shares(garment: _Garment, panel: IntArray, count: int) -> FloatArray:
    """Share (n, K) of each panel among the visible vertices of the same limb at the same level:
    height on the trunk, the way along its longest axis on a limb."""
    from scipy.spatial import cKDTree

    places, shares = garment.places, np.zeros((len(garment.places), count))
    for names in LIMB_PARTS:
        own = np.flatnonzero(on_parts(garment.parts, *names))
        shown = own[garment.known[own]]
        if len(shown) < _LEVEL:
            continue
        if "torso" in names:
            along = places[:, 1]
        else:
            around = places[own] - places[own].mean(axis=0)
            along = (places - places[own].mean(axis=0)) @ np.linalg.svd(
                around, full_matrices=False
            )[2][0]
        _, near = cKDTree(along[shown, None]).query(along[own, None], k=_LEVEL, workers=1)
        shares[own] = np.eye(count)[panel[shown][near]].mean(axis=1)
    return shares


def _pieces(member: IntArray, near: IntArray) -> IntArray:
    """Index (n,) of the connected piece of the same panel to which each vertex belongs."""
    piece = np.zeros(len(member), int)
    for panel in np.unique(member):
        own = member == panel
        piece[own] = piece.max() + 1 + joined_pieces(own, near)[own]
    return piece


def _visible_panels(garment: _Garment) -> tuple[FloatArray, IntArray] | None:
    """The distance (n, K) of each vertex from the colors of the panels, CIELAB units, and the panel
    (n,) of those that are known; None if there are not two.

    Colors without an area of their own join the nearest one.
    """
    lab, known, mixing = lab_of(garment.colors), garment.known, neighbor_mean(garment.near)
    centers, size = _colors(lab[known])
    while len(centers) > 1:
        away = np.stack([palette_distance(lab, one[None], SHADE) for one in centers], axis=1)
        raw = away.argmin(axis=1)
        belief = np.eye(len(centers))[raw] * known[:, None]
        for _ in range(_SMOOTHING):
            belief = mixing @ belief
        member = np.where(belief.max(axis=1) > 0, belief.argmax(axis=1), raw)
        mine = np.bincount(member[known], minlength=len(centers))
        pure = np.bincount(member[known & (raw == member)], minlength=len(centers)) / np.maximum(
            mine, 1
        )
        share = mine / max(int(known.sum()), 1)
        poor = np.flatnonzero((pure < _PURE) | (share < _SHARE))
        if not len(poor):
            return away, member
        worst = int(share.argmin()) if share.min() < _SHARE else int(pure.argmin())
        gap = np.linalg.norm((centers - centers[worst]) * SHADE, axis=1)
        gap[worst] = np.inf
        centers, size = _joined(centers, size, int(gap.argmin()), worst)
    return None


def _colors(lab: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Colors (K, 3) of a garment, CIELAB, at least `PANELS_APART` from each other, and the number
    (K,) of vertices of each."""
    centers, size = color_clusters(lab, _COLORS, shade=SHADE, rounds=_KMEANS_ROUNDS)
    centers, size = centers[size > 0], size[size > 0]
    while len(centers) > 1:
        gap = np.linalg.norm((centers[:, None] - centers) * SHADE, axis=2)
        np.fill_diagonal(gap, np.inf)
        first, second = np.unravel_index(int(gap.argmin()), gap.shape)
        if gap[first, second] >= PANELS_APART:
            break
        centers, size = _joined(centers, size, int(first), int(second))
    return centers, size


def _joined(
    centers: FloatArray, size: FloatArray, first: int, second: int
) -> tuple[FloatArray, FloatArray]:
    """Join the `second` color to the `first`."""
    centers, size = centers.copy(), size.copy()
    total = size[first] + size[second]
    centers[first] = (size[first] * centers[first] + size[second] * centers[second]) / total
    size[first] = total
    return np.delete(centers, second, axis=0), np.delete(size, second)
