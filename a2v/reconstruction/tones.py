"""Tones of what the photo does not show: near its rim, of unseen skin and hair, and of what
another limb hides."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import on_parts
from a2v.reconstruction.backs.seen import HAIR, LIMB_PARTS, SKIN
from a2v.reconstruction.canvas import Canvas
from a2v.types import BoolArray, FloatArray, IntArray

RIM = (0.015, 0.035)
"""Up to the first distance, meters, from what the photo shows well its colors go on, from the
second on those of a given prior hold."""
_TONED = 15
"""At least so many vertices tell the tone of skin or hair."""
_AROUND = 150
"""So many vertices that are seen say what a hidden one looks like."""
TONE = np.array([0.6, 0.75, 0.75])
"""So much of lightness, a and b of skin and hair that the photo does not show is the median of what
it shows."""


def given_or_close(
    prior: FloatArray, *, close: FloatArray, otherwise: FloatArray, reach: FloatArray
) -> FloatArray:
    """A backend's `prior` (V, 3) where it is known, and `otherwise` (V, 3) elsewhere.

    Towards what the photo shows well, `reach` (V,) meters away, it fades into the photo's colors
    `close` (V, 3); see `RIM`.
    """
    given = np.isfinite(prior).all(axis=1)
    share = np.clip((RIM[1] - reach) / (RIM[1] - RIM[0]), 0, 1)[:, None]
    return np.where(given[:, None], share * close + (1 - share) * np.nan_to_num(prior), otherwise)


def even_tones(
    base: FloatArray, known: BoolArray, told: BoolArray, *, labels: IntArray, bare: BoolArray
) -> FloatArray:
    """Colors (V, 3) whose unseen skin on `bare` (V,) parts, and unseen hair, are of the tone that
    the photo shows: what a network expects there is often of another.

    The tone is that of `known` (V,) vertices; those that are `told` (V,) keep their colors. Of
    skin it is the lighter half's: the other lies in the shadow of hair and chin.
    """
    from skimage.color import lab2rgb, rgb2lab

    result, skin = base.copy(), None
    for own in ((labels == SKIN) & bare, labels == HAIR):
        if (own & known).sum() < _TONED or not (own & ~told).any():
            continue
        seen = rgb2lab(np.clip(base[own & known], 0, 1))
        if skin is not None:  # at its border hair is mixed with skin
            away = np.linalg.norm(seen - skin, axis=1)
            seen = seen[away >= np.median(away)]
        else:
            seen = seen[seen[:, 0] >= np.median(seen[:, 0])]
        tone = skin = np.median(seen, axis=0)
        lab = rgb2lab(np.clip(base[own & ~told], 0, 1))
        result[own & ~told] = lab2rgb(lab + TONE * (tone - lab))
    return result


def without_strangers(
    expected: FloatArray, colors: FloatArray, canvas: Canvas, pixels: FloatArray, known: BoolArray
) -> FloatArray:
    """Expected colors (V, 3) where the photo's pixel is another part's: the median of what it
    shows next to it on the same limb at rest; the nearest alone lies in the shadow of what hides
    it."""
    from scipy.spatial import cKDTree

    lost = ~known & (canvas.agrees(pixels, canvas.parts) < 0.5)
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
