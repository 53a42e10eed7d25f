"""Tones of what the photo does not show: hair and skin of one tone, and no colour of another part."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import on_parts
from a2v.reconstruction.backs.labels import HAIR, LIMB_PARTS, SKIN
from a2v.reconstruction.canvas import Canvas
from a2v.types import BoolArray, FloatArray, IntArray

STRAND = 0.05
"""Largest detail of hair that is continued, sRGB."""
TONED = 15
"""At least so many vertices tell the tone of skin or hair."""
_AROUND = 150
"""So many vertices that are seen say what a hidden one looks like."""
TONE = np.array([0.6, 0.75, 0.75])
"""So much of lightness, a and b of skin and hair that the photo does not show is the median of what it shows."""


def even_tones(base: FloatArray, known: BoolArray, labels: IntArray, bare: BoolArray) -> FloatArray:
    """Colours (V, 3) whose unseen skin on `bare` (V,) parts, and unseen hair, are of the tone that the photo shows: what a network expects there is often of another."""
    from skimage.color import lab2rgb, rgb2lab

    result, skin = base.copy(), None
    for own in ((labels == SKIN) & bare, labels == HAIR):
        if (own & known).sum() < TONED or not (own & ~known).any():
            continue
        seen = rgb2lab(np.clip(base[own & known], 0, 1))
        if skin is not None:  # at its border hair is mixed with skin
            away = np.linalg.norm(seen - skin, axis=1)
            seen = seen[away >= np.median(away)]
        tone = skin = np.median(seen, axis=0)
        lab = rgb2lab(np.clip(base[own & ~known], 0, 1))
        result[own & ~known] = lab2rgb(lab + TONE * (tone - lab))
    return result


def without_hues(detail: FloatArray, labels: IntArray) -> FloatArray:
    """The detail (n, 3) without hues on hair: strands differ in light alone, and what shines through them is not continued."""
    hair = labels == HAIR
    detail[hair] = np.clip(detail[hair].mean(axis=1, keepdims=True), -STRAND, STRAND)
    return detail


def without_strangers(expected: FloatArray, colors: FloatArray, canvas: Canvas, pixels: FloatArray, known: BoolArray) -> FloatArray:
    """Expected colours (V, 3) where the photo's pixel is another part's: the median of what it shows next to it on the same limb at rest; the nearest alone lies in the shadow of what hides it."""
    from scipy.spatial import cKDTree

    lost = ~known & (canvas.agrees(pixels, canvas.parts) < 0.5)
    result = expected.copy()
    for names in LIMB_PARTS:
        own = on_parts(canvas.parts, *names)
        shown = np.flatnonzero(own & known)
        if (own & lost).any() and len(shown) >= 20:
            beside = cKDTree(canvas.rest[shown]).query(canvas.rest[own & lost], k=min(_AROUND, len(shown)), workers=1)[1]
            result[own & lost] = np.median(colors[shown[beside]], axis=1)
    return result
