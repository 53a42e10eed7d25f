"""Tones of unseen places: near visible ones, of skin and hair, and behind other limbs."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import on_parts
from a2v.reconstruction.backs.seen import HAIR, LIMB_PARTS, SKIN
from a2v.reconstruction.coloring.canvas import Canvas
from a2v.types import BoolArray, FloatArray, IntArray

RIM = (0.015, 0.035)
"""Distances from visible places: up to the first the colors of the photo continue, and from the
second on a given prior holds, meters."""
_TONED = 15
"""Smallest number of vertices for the tone of skin or hair."""
_AROUND = 150
"""Number of visible vertices that give the color of an occluded one."""
_AROUND_STRAND = 60
"""Number of visible vertices of long hair from whose tone that of a vertex differs by a streak."""
_FEW = 500
"""Number of visible vertices of long hair that give the color of unseen ones, about."""
_BLEND = 0.25
"""Share of the distance of an unseen vertex from the nearest visible hair by which places that
count may be farther."""
_NEARBY = 0.01
"""The same at visible hair, meters."""
_FAR_STRAND = 0.15
"""Distance from visible hair from which on unseen hair has the median color of all, meters."""
_STREAK = 3.0
"""Largest standard deviation of the lightness of unseen strands, CIELAB units."""
_ROOTS = 0.06
"""Distance from the scalp over which streaks appear, meters."""
_HARDLY = 0.15
"""Share of a forearm's known vertices below which the photo tells of it by its pixels alone."""
TONE = np.array([0.6, 0.75, 0.75])
"""Weight of the median of the visible skin or hair in the lightness, a and b of the unseen."""


def given_or_close(
    prior: FloatArray, *, close: FloatArray, otherwise: FloatArray, reach: FloatArray
) -> FloatArray:
    """The `prior` (V, 3) of a backend, or `otherwise` (V, 3) for vertices without it.

    Towards well visible places, `reach` (V,) meters away, it fades into the colors `close` (V, 3)
    of the photo; see `RIM`.
    """
    given = np.isfinite(prior).all(axis=1)
    share = np.clip((RIM[1] - reach) / (RIM[1] - RIM[0]), 0, 1)[:, None]
    return np.where(given[:, None], share * close + (1 - share) * np.nan_to_num(prior), otherwise)


def even_tones(
    base: FloatArray,
    shown: BoolArray,
    hidden: BoolArray,
    labels: IntArray,
    bare: BoolArray,
    area: FloatArray,
) -> FloatArray:
    """Shift `hidden` (V,) hair, and hidden skin on `bare` (V,) parts, to the tone of what is
    `shown` (V,) of it.

    Networks often predict another tone. The visible tone is the median over the `area` (V,): lashes
    and nostrils have the color of hair, and many small triangles. For skin only the lighter half
    counts, because hair and chin cast shadows on the rest.
    """
    from skimage.color import lab2rgb, rgb2lab

    result, skin = base.copy(), None
    for own in ((labels == SKIN) & bare, labels == HAIR):
        if (own & shown).sum() < _TONED or not (own & hidden).any():
            continue
        seen, weight = rgb2lab(np.clip(base[own & shown], 0, 1)), area[own & shown]
        # at its border hair is mixed with skin
        order = seen[:, 0] if skin is None else np.linalg.norm(seen - skin, axis=1)
        half = order >= _median(order, weight)
        tone = skin = np.array([_median(seen[half, axis], weight[half]) for axis in range(3)])
        lab = rgb2lab(np.clip(base[own & hidden], 0, 1))
        result[own & hidden] = lab2rgb(lab + TONE * (tone - lab))
    return result


def _median(values: FloatArray, weight: FloatArray) -> float:
    """Weighted median of values (n,)."""
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])


def combed(
    base: FloatArray, known: BoolArray, canvas: Canvas, labels: IntArray, mouth: BoolArray
) -> FloatArray:
    """Give unseen hair of a person with long hair the colors (V, 3) of the visible hair near it,
    and streaks along the strands. Short hair is returned unchanged.

    Parameters
    ----------
    known : (V,) bool
        Visible vertices.
    labels : (V,) int
        Index into `a2v.reconstruction.backs.seen.KINDS`.
    mouth : (V,) bool
        The dark inside of the mouth, which may be labeled as hair.
    """
    if canvas.strands is None:
        return base
    from scipy.spatial import cKDTree
    from skimage.color import lab2rgb, rgb2lab

    strands, rest = canvas.strands, canvas.rest
    hair = ((labels == HAIR) & on_parts(canvas.parts, "head")) | (strands >= 0)
    hair &= ~mouth
    shown, hidden = hair & known, hair & ~known
    if shown.sum() < _AROUND_STRAND or not hidden.any():
        return base
    lab = rgb2lab(np.clip(base[shown], 0, 1))
    tree = cKDTree(rest[shown])
    nearest = tree.query(rest[shown], k=_AROUND_STRAND, workers=1)[1]
    unlike = float((lab[:, 0] - np.median(lab[nearest, 0], axis=1)).std())
    streak = np.append(np.random.default_rng(0).normal(size=strands.max() + 1), 0.0)
    away, found = _around(rest[shown], lab, rest[hidden])
    share = np.clip(away / _FAR_STRAND, 0, 1)[:, None]
    found += share * (np.median(lab, axis=0) - found)
    scalp = rest[hair & (strands < 0)]
    below = cKDTree(scalp).query(rest[hidden], workers=1)[0] if len(scalp) else np.inf
    streaked = np.clip(below / _ROOTS, 0, 1)  # the roots continue the crown
    found[:, 0] += min(unlike, _STREAK) * streaked * streak[strands[hidden]]
    result = base.copy()
    result[hidden] = np.clip(lab2rgb(found), 0, 1)
    return result


def _around(
    places: FloatArray, lab: FloatArray, others: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Distance (n,) of the `others` (n, 3) from the nearest of the `places` (m, 3), and the mean
    (n, 3) of the colors `lab` (m, 3) there, in which a place counts that is hardly farther: halfway
    between two sides both count."""
    from scipy.spatial.distance import cdist

    few = slice(None, None, max(1, len(places) // _FEW))
    each = cdist(others, places[few])
    away = each.min(axis=1)
    weight = np.exp(-0.5 * ((each - away[:, None]) / (_BLEND * away + _NEARBY)[:, None]) ** 2)
    return away, (weight @ lab[few]) / weight.sum(axis=1, keepdims=True)


def without_strangers(
    expected: FloatArray, colors: FloatArray, canvas: Canvas, pixels: FloatArray, known: BoolArray
) -> FloatArray:
    """Replace expected colors (V, 3) of vertices whose pixel shows another part.

    They get the median color of the nearest visible vertices on the same limb at rest. A single
    nearest vertex would often lie in the shadow of the occluding part.
    """
    from scipy.spatial import cKDTree

    lost = ~known & (canvas.agrees(pixels, canvas.owners) < 0.5)
    result = expected.copy()
    for names in LIMB_PARTS:
        own = on_parts(canvas.parts, *names)
        shown = np.flatnonzero(own & known)
        if (own & lost).any() and len(shown) >= 20:
            beside = cKDTree(canvas.rest[shown]).query(
                canvas.rest[own & lost], k=min(_AROUND, len(shown)), workers=1
            )[1]
            result[own & lost] = np.median(colors[shown[beside]], axis=1)
    return result


def bare_arms(canvas: Canvas, known: BoolArray) -> BoolArray:
    """Return which vertices (V,) that are not `known` (V,) lie on forearms without sleeves of which
    hardly anything is known: crossed arms that the fit has put into the trunk."""
    hidden = np.zeros(len(known), bool)
    for name in canvas.bare:
        own = on_parts(canvas.parts, name)
        if own.any() and known[own].mean() < _HARDLY:
            hidden |= own & ~known
    return hidden
