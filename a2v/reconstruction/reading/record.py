"""What the pixels of a photo show of a person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS
from a2v.record import Record
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

ARMS = tuple(f"{side}_{part}" for side in ("left", "right") for part in ("lower_arm", "hand"))
"""Parts that are found by landmarks."""


@dataclass(frozen=True, kw_only=True)
class HairSeen(Record):
    """Long hair in the photo.

    Attributes
    ----------
    pixels : (H, W) bool
        Pixels that show hair.
    like_cloth : bool
        Whether the clothes have the color of the hair, so that the photo does not show where hair
        on the trunk ends.
    free : bool
        Whether below many ends of the hair there is background or skin. Above a shoulder, hair may
        continue behind it.
    """

    pixels: BoolArray
    like_cloth: bool
    free: bool

    def at(self, pixels: FloatArray) -> BoolArray:
        """Return which of the places `pixels` (n, 2) show hair."""
        column, row = np.floor(pixels).astype(np.int64).T
        high, wide = self.pixels.shape
        return np.asarray(self.pixels[np.clip(row, 0, high - 1), np.clip(column, 0, wide - 1)])


@dataclass(frozen=True, kw_only=True)
class Reading(Record):
    """What the pixels of a photo show of a person, found once. Maps have every `STEP`-th pixel.

    Attributes
    ----------
    shown : (h, w) int8
        Part of the fitted body, without clothes; -1 for none.
    found_arms : (h, w) uint8
        Bit k: `ARMS[k]` by the landmarks.
    better : (P,) bool
        Parts for which the landmarks are better than the fit.
    taken : (h, w) bool
        Pixels of the mask that show the background or held objects.
    skin : (h, w) bool, optional
        Pixels that look like the skin of bare hands; None if unknown.
    gloves : (h, w) bool, optional
        Pixels that look like the gloves on both hands; None for hands without gloves.
    hands : (3,) float64, optional
        Color of the hands or of the gloves, sRGB in [0, 1]; None if unknown.
    bare_forearms : tuple of str
        Forearms without sleeves.
    bare_feet : bool
    hangs : bool
        Whether there is a skirt, a dress or a long coat.
    hem : (2,) float64, optional
        Height of its hem at rest, meters, and of its lowest point. None if it is to be found where
        the surface steps back to the legs.
    hair : HairSeen, optional
        Long hair; None if the photo does not clearly show it.
    """

    shown: IntArray
    found_arms: ByteArray
    better: BoolArray
    taken: BoolArray
    skin: BoolArray | None = None
    gloves: BoolArray | None = None
    hands: FloatArray | None = None
    bare_forearms: tuple[str, ...] = ()
    bare_feet: bool = False
    hangs: bool = False
    hem: FloatArray | None = None
    hair: HairSeen | None = None

    def __post_init__(self) -> None:
        size: dict[str, int] = {}
        for name in ("shown", "found_arms", "taken", "skin", "gloves"):
            self._check(name, ("h", "w"), size)
        self._check("better", (len(PARTS),))
        self._check("hands", (3,))
        self._check("hem", (2,))

    @property
    def arms(self) -> BoolArray:
        """Pixels (P, h, w) of forearms and hands by the landmarks; no others are set."""
        result = np.zeros((len(PARTS), *self.shown.shape), bool)
        for bit, name in enumerate(ARMS):
            result[PARTS.index(name)] = (self.found_arms >> bit) & 1
        return result

    @property
    def like_hands(self) -> BoolArray | None:
        """Pixels (h, w) with the color of the gloves, else of bare skin; None if unknown."""
        return self.skin if self.gloves is None else self.gloves
