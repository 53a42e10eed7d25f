"""What is known of a surface's vertices before they are labeled, and the labels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS, on_parts
from a2v.types import BoolArray, FloatArray, IntArray

KINDS: tuple[str, ...] = ("unsure", "skin", "hair", "upper", "lower", "shoes")
"""Labels of a surface; "upper" is also what hangs down from it (a dress), "unsure" is what none
explains."""
UNSURE, SKIN, HAIR, UPPER, LOWER, SHOES = range(len(KINDS))

HEAD_PARTS = ("head", "neck")
ARM_PARTS = tuple(part for part in PARTS if part.endswith("_arm"))
LEG_PARTS = tuple(part for part in PARTS if part.endswith(("thigh", "shin")))
HANDS = tuple(part for part in PARTS if part.endswith("hand"))
FOOT_PARTS = tuple(part for part in PARTS if part.endswith("foot"))
_TELLING = 20
"""At least so many vertices of a limb that the photo shows say what lies before its hidden ones."""


def allowed_parts(kind: int) -> tuple[str, ...]:
    """The body parts on which a label may lie."""
    return {
        UNSURE: PARTS,
        SKIN: PARTS,
        HAIR: (*HEAD_PARTS, "torso"),
        UPPER: ("neck", "torso", *ARM_PARTS, *HANDS, *LEG_PARTS),
        LOWER: ("torso", *LEG_PARTS, *FOOT_PARTS),
        SHOES: (*FOOT_PARTS, *(part for part in LEG_PARTS if part.endswith("shin"))),
    }[kind]


@dataclass(frozen=True, eq=False)
class Seen:
    """What is known of a surface's vertices before they are labeled.

    Attributes
    ----------
    vertices : (V, 3)
        Meters.
    colors : (V, 3)
        The photo's at `known` vertices, those that a network (or a prior) expects elsewhere; sRGB
        in [0, 1].
    known : (V,) bool
    parts : (V,) int
        Index into `a2v.body.PARTS`.
    front : (V,) int
        The known vertex of the same limb that the photo shows next to each vertex's own pixel: its
        mirrored counterpart for those behind.
    twin : (V,) int
        The known vertex at the mirrored spot of the body, for vertices that are not known; -1 where
        the photo does not show it.
    scalp : (V,) bool
        Where hair grows on a head that has some.
    bare : (V,) bool
        The body's face, seen or not.
    neighbors : (V, N) int
        Nearest vertices.
    skin : (3,), optional
        The face's color, sRGB; None if it was not seen.
    face : (V,) bool
        Vertices within the face, of which nothing is continued.
    rest : (V, 3), optional
        Where they are at rest, meters: garments' borders run around the body there. None: borders
        are as they are found.
    cloth : (V,) bool, optional
        What is neither skin nor hair nor shoe: a layer that hangs.
    """

    vertices: FloatArray
    colors: FloatArray
    known: BoolArray
    parts: IntArray
    front: IntArray
    twin: IntArray
    scalp: BoolArray
    bare: BoolArray
    neighbors: IntArray
    skin: FloatArray | None
    face: BoolArray
    rest: FloatArray | None = None
    cloth: BoolArray | None = None

    def on(self, *names: str) -> BoolArray:
        """Which vertices (V,) lie on the parts of these names."""
        return on_parts(self.parts, *names)


LIMB_PARTS: tuple[tuple[str, ...], ...] = (
    HEAD_PARTS, ("torso",), *((f"{side}_upper_arm", f"{side}_lower_arm") for side in ("left", "right")),
    *((f"{side}_hand",) for side in ("left", "right")), *((f"{side}_thigh", f"{side}_shin", f"{side}_foot") for side in ("left", "right")),
)  # fmt: skip
"""Parts that stand for each other: what the photo shows of one before a hidden spot says what is
there."""


def seen_before(pixels: FloatArray, known: BoolArray, parts: IntArray) -> IntArray:
    """The known vertex (V,) of the same limb whose pixel is nearest to each vertex's own (V, 2); of
    any limb where the photo shows none of it.

    A hand before the belly says nothing of the back.
    """
    from scipy.spatial import cKDTree

    front = np.flatnonzero(known)[cKDTree(pixels[known]).query(pixels, workers=1)[1]]
    for names in LIMB_PARTS:
        own = on_parts(parts, *names)
        shown = np.flatnonzero(own & known)
        if len(shown) >= _TELLING:
            front[own] = shown[cKDTree(pixels[shown]).query(pixels[own], workers=1)[1]]
    return np.asarray(front)


def lab_of(colors: FloatArray) -> FloatArray:
    """CIELAB (..., 3) of sRGB in [0, 1] (..., 3)."""
    from skimage.color import rgb2lab

    lab: FloatArray = rgb2lab(np.clip(colors, 0, 1))
    return lab
