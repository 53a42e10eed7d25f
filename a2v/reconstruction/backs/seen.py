"""The labels, and the evidence on a surface's vertices before they are labeled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS, on_parts
from a2v.system import thread_count
from a2v.types import BoolArray, FloatArray, IntArray

KINDS: tuple[str, ...] = ("unsure", "skin", "hair", "upper", "lower", "shoes")
"""Labels of a surface. "upper" includes what hangs down from it (a dress); "unsure" vertices fit no
label."""
UNSURE, SKIN, HAIR, UPPER, LOWER, SHOES = range(len(KINDS))

HEAD_PARTS = ("head", "neck")
ARM_PARTS = tuple(part for part in PARTS if part.endswith("_arm"))
LEG_PARTS = tuple(part for part in PARTS if part.endswith(("thigh", "shin")))
HANDS = tuple(part for part in PARTS if part.endswith("hand"))
FOOT_PARTS = tuple(part for part in PARTS if part.endswith("foot"))
_TELLING = 20
"""Smallest number of visible vertices of a limb that are used in front of its hidden ones."""


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
class BackEvidence:
    """The evidence on a surface's vertices before they are labeled.

    Attributes
    ----------
    vertices : (V, 3)
        Meters.
    colors : (V, 3)
        Colors of the photo at `known` vertices, expected ones (of a network or a prior) at the
        others; sRGB in [0, 1].
    known : (V,) bool
    parts : (V,) int
        Index into `a2v.body.PARTS`.
    front : (V,) int
        The known vertex of the same limb nearest to the pixel of each vertex: for vertices on the
        back, the one in front of it.
    twin : (V,) int
        The known vertex at the mirrored spot of the body, for vertices that are not known; -1 if
        the photo does not show it.
    scalp : (V,) bool
        The area in which hair can grow.
    bare : (V,) bool
        Vertices that must be skin: the face of the body, visible or not, and unseen forearms that
        have no sleeves.
    neighbors : (V, N) int
        Nearest vertices.
    skin : (3,), optional
        The color of the face, sRGB; None if it is not visible.
    face : (V,) bool
        Vertices within the face, which are not continued.
    rest : (V, 3), optional
        Vertices at rest, meters, where borders of garments run around the body. None: borders stay
        as found.
    cloth : (V,) bool, optional
        Vertices of a hanging layer, which is neither skin nor hair nor shoe.
    strands : (V,) bool, optional
        Vertices of a layer of long hair.
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
    strands: BoolArray | None = None

    def on(self, *names: str) -> BoolArray:
        """Return which vertices (V,) lie on the parts of these names."""
        return on_parts(self.parts, *names)


@dataclass(frozen=True, eq=False)
class Materials:
    """The material of each vertex of a surface.

    Attributes
    ----------
    labels : (V,) int
        Index into `KINDS`.
    strange : (V,) bool
        Vertices of another color than their label (prints).
    panels : (V,) int
        Panels of garments of several colors; 0 elsewhere.
    colors : (V, 3) float64
        Color that the photo shows nearby of the same panel, sRGB; NaN outside of panels.
    """

    labels: IntArray
    strange: BoolArray
    panels: IntArray
    colors: FloatArray

    @classmethod
    def of(cls, labels: IntArray, strange: BoolArray) -> Materials:
        """Materials without panels."""
        return cls(labels, strange, np.zeros(len(labels), int), np.full((len(labels), 3), np.nan))

    @property
    def numbers(self) -> IntArray:
        """`labels` (V,), with larger numbers for the panels of garments."""
        return np.where(self.panels > 0, len(KINDS) + self.panels, self.labels)


LIMB_PARTS: tuple[tuple[str, ...], ...] = (
    HEAD_PARTS,
    ("torso",),
    *((f"{side}_upper_arm", f"{side}_lower_arm") for side in ("left", "right")),
    *((f"{side}_hand",) for side in ("left", "right")),
    *((f"{side}_thigh", f"{side}_shin", f"{side}_foot") for side in ("left", "right")),
)
"""Groups of parts of one limb: a visible place of one part is evidence for a hidden place behind
it."""


def seen_before(pixels: FloatArray, known: BoolArray, parts: IntArray) -> IntArray:
    """The known vertex (V,) of the same limb whose pixel is nearest to that of each vertex (V, 2);
    of any limb, if the photo does not show that limb.

    A hand in front of the belly is no evidence for the back.
    """
    from scipy.spatial import cKDTree

    front = np.flatnonzero(known)[cKDTree(pixels[known]).query(pixels, workers=thread_count())[1]]
    for names in LIMB_PARTS:
        own = on_parts(parts, *names)
        shown = np.flatnonzero(own & known)
        if len(shown) >= _TELLING:
            front[own] = shown[cKDTree(pixels[shown]).query(pixels[own], workers=thread_count())[1]]
    return np.asarray(front)
