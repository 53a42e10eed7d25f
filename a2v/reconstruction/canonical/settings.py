"""Settings of the character: its kind, and the shape of the canonical one."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from a2v.errors import InputError
from a2v.io import shorten
from a2v.types import Body


@dataclass(frozen=True)
class CharacterSettings:
    """Settings of the character.

    Attributes
    ----------
    kind : "canonical" or "fused"
        The mesh of the body in its rest pose, displaced to the dressed surface; or, as in the
        papers, one surface fused in the pose of the photo and bound afterwards (Eq. 19).
    smoothing : float
        Length over which observed displacements are smoothed along the body, meters.
    near : float
        An observed point is dropped if the nearest skin to it lies farther than this from its
        vertex on the body at rest, meters.
    legs : "trousers", "shorts" or "skirt"
        Clothes on legs that the photo's lower edge cuts off, if it shows nothing of them.
    legs_color : str
        Their color as six hex digits (343a4c); empty for dark blue.
    """

    kind: Literal["canonical", "fused"] = "canonical"
    smoothing: float = 0.007
    near: float = 0.12
    legs: Literal["trousers", "shorts", "skirt"] = "trousers"
    legs_color: str = ""

    def __post_init__(self) -> None:
        if self.kind not in ("canonical", "fused"):
            raise InputError(f"character is '{self.kind}'; choose canonical or fused")
        if self.legs not in ("trousers", "shorts", "skirt"):
            raise InputError(f"legs is '{self.legs}'; choose trousers, shorts or skirt")
        if self.legs_color and not re.fullmatch("[0-9a-fA-F]{6}", self.legs_color):
            raise InputError(
                f"legs_color is '{shorten(self.legs_color, 20)}'; expected six hex "
                "digits, such as 343a4c"
            )
        for name in ("smoothing", "near"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(
                    f"character.{name} is {getattr(self, name)}; "
                    "expected a positive length in meters"
                )


def is_canonical(body: Body, settings: CharacterSettings) -> bool:
    """Return whether the character is the canonical one. Only for Anny are face, teeth and texture
    layout available."""
    return settings.kind == "canonical" and body.model == "anny"
