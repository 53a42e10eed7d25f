"""Which kind of character is made, and how the canonical one takes its shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from a2v.errors import InputError
from a2v.types import Body


@dataclass(frozen=True)
class CharacterSettings:
    """How the character is built.

    Attributes
    ----------
    kind : "canonical" or "fused"
        The body's own mesh in its rest pose, displaced to the dressed surface; or the papers' way:
        one surface fused in the photo's pose and bound afterwards (Eq. 19).
    smoothing : float
        Meters over which observed displacements are smoothed along the body.
    near : float
        An observed point is dropped where the nearest skin to it lies farther than this from its
        vertex on the body at rest, meters.
    """

    kind: Literal["canonical", "fused"] = "canonical"
    smoothing: float = 0.007
    near: float = 0.12

    def __post_init__(self) -> None:
        if self.kind not in ("canonical", "fused"):
            raise InputError(f"character is '{self.kind}'; choose canonical or fused")
        for name in ("smoothing", "near"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(
                    f"character.{name} is {getattr(self, name)}; expected a positive length in meters"
                )


def is_canonical(body: Body, settings: CharacterSettings) -> bool:
    """Whether the character is the canonical one: bodies of other models than Anny have no face,
    teeth and texture layout that are known here."""
    return settings.kind == "canonical" and body.model == "anny"
