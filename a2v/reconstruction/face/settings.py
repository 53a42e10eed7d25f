"""Settings of the moving face."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from a2v.errors import InputError

FEATURES: tuple[Literal["photo", "model", "skin", "head"], ...] = ("photo", "model", "skin", "head")
"""Where the features of a canonical character's face come from, best first."""


@dataclass(frozen=True)
class FaceSettings:
    """Settings of the moving face.

    Attributes
    ----------
    expressions : bool
        Lay the face of the body into the surface, with its expressions. Otherwise the face of the
        surface stays and does not move.
    smoothing : float
        Smoothing of the thin-plate splines, square meters, which lets them miss landmarks for a
        smoother face.
    features : "photo", "model", "skin" or "head"
        Of a canonical character: bent to the photo's landmarks; those of the model, in the photo's
        colors; the model's face painted in the color of the skin; and the whole head painted in the
        colors of skin and hair. The pipeline takes the first with which a face is found again.
    """

    expressions: bool = True
    smoothing: float = 2e-6
    features: Literal["photo", "model", "skin", "head"] = "photo"

    def __post_init__(self) -> None:
        if self.features not in FEATURES:
            raise InputError(
                f"face.features is '{self.features}'; choose from {', '.join(FEATURES)}"
            )
        if not (np.isfinite(self.smoothing) and self.smoothing >= 0):
            raise InputError(f"face.smoothing is {self.smoothing}; expected 0 or more")
