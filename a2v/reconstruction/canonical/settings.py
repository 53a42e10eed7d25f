"""Settings of the character: its kind, and the shape of the canonical one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from a2v.errors import InputError
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
                    f"character.{name} is {getattr(self, name)}; "
                    "expected a positive length in meters"
                )


def is_canonical(body: Body, settings: CharacterSettings) -> bool:
    """Return whether the character is the canonical one. Only for Anny are face, teeth and texture
    layout available."""
    return settings.kind == "canonical" and body.model == "anny"
