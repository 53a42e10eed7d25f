"""Dress legs that the photo's lower edge cuts off."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.body.parts import on_parts
from a2v.reconstruction.backs.seen import FOOT_PARTS, HANDS, LEG_PARTS, LOWER, SHOES, SKIN
from a2v.reconstruction.coloring.painting import Painting

_LOWER_COLOR = "343a4c"
"""Color of trousers that nobody has chosen, sRGB: dark blue."""
_SHOE_COLOR = "3a3634"
"""Color of shoes that the photo does not show, sRGB."""
_BARE = 0.5
"""Share of skin in the visible part of the legs from which on they are bare."""
_BELOW = 0.9
"""Share of the shins below the picture from which on it cuts off the legs."""
_LEAST = 300
"""Smallest number of visible vertices of the legs with a garment that goes on below the picture."""
_ABOVE_KNEES = 0.04
"""Height of the hem of shorts above the knees, meters."""


def dress_cut_legs(painting: Painting) -> Painting:
    """Put trousers, or what was chosen, and shoes on legs that lie below the picture. A garment
    that the photo shows goes on."""
    evidence, materials, canvas = painting.evidence, painting.materials, painting.canvas
    if evidence is None or materials is None or canvas is None:
        return painting
    below = painting.pixels[:, 1] >= painting.photo.subject.mask.shape[0]
    parts, height, labels = canvas.parts, canvas.rest[:, 1], materials.labels.copy()
    legs, shins = on_parts(parts, *LEG_PARTS), on_parts(parts, "left_shin", "right_shin")
    if below[shins].mean() < _BELOW:
        return painting
    below &= ~evidence.known  # another photo may show them
    labels[below & on_parts(parts, *FOOT_PARTS)] = SHOES
    labels[below & on_parts(parts, *HANDS)] = SKIN
    kind = painting.surface.provenance.get("legs", "trousers")
    shown = evidence.known & legs
    loose = np.zeros(len(legs), bool) if canvas.loose is None else canvas.loose
    own = below & (legs | (on_parts(parts, "torso") & (height < height[legs].max()))) & ~loose
    if not loose.any() and not (shown.any() and (labels[shown] == SKIN).mean() > _BARE):
        hem = height[shins].max() + _ABOVE_KNEES if kind == "shorts" else -np.inf
        labels[own] = np.where(height[own] > hem, LOWER, SKIN)
    else:
        labels[own & legs] = SKIN
        if kind == "skirt":
            labels[below & loose] = LOWER
    colors = evidence.colors.copy()
    chosen = painting.surface.provenance.get("legs_color") or _LOWER_COLOR
    for material, code in ((LOWER, chosen), (SHOES, _SHOE_COLOR)):
        hidden = (labels == material) & ~evidence.known
        if (shown & (labels == material)).sum() < _LEAST:
            colors[hidden] = np.array(list(bytes.fromhex(code))) / 255
    bare = below & (labels == SKIN)
    if evidence.skin is not None:
        colors[bare & ~evidence.known] = evidence.skin
    return dataclasses.replace(
        painting,
        evidence=dataclasses.replace(evidence, colors=colors),
        materials=dataclasses.replace(
            materials, labels=labels, strange=materials.strange & (labels == materials.labels)
        ),
    )
