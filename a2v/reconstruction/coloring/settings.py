"""Settings of the coloring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.reconstruction.rules import COLORING, left_out


@dataclass(frozen=True)
class ColorSettings:
    """Settings of the coloring.

    Attributes
    ----------
    lambda_nn : float
        Weight of the neighbors in Eq. 14.
    neighbors : int
        Neighbors of a vertex in Eq. 14 (the paper's 10).
    tolerance : float
        Relative residual at which Eq. 14 counts as solved.
    band : float
        Width of the transition band behind the silhouette, meters: second term of Eq. 14 only.
    texture : int
        Width and height of the texture, texels; 0 for vertex colors only.
    synthesis : bool
        Continue visible cloth, hair and skin over the unseen side (`a2v.reconstruction.backs`);
        otherwise continue the colors of the nearest vertices only (Eq. 14).
    delight : bool
        Remove the shading of the photo from its colors (`coloring.shading`), so that they
        can be lit again.
    seed : int
        Of the matching of patches.
    without : str
        Rules to leave out (`a2v.reconstruction.rules.COLORING`), separated by commas.
    """

    lambda_nn: float = 1.0
    neighbors: int = 10
    tolerance: float = 3e-3
    band: float = 0.015
    texture: int = 2048
    synthesis: bool = True
    delight: bool = True
    seed: int = 0
    without: str = ""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.lambda_nn) and self.lambda_nn > 0):
            raise InputError(f"lambda_nn is {self.lambda_nn}; expected a positive number")
        if not 1 <= self.neighbors <= 64:
            raise InputError(f"neighbors is {self.neighbors}; expected 1 to 64")
        if not 0 < self.tolerance < 1:
            raise InputError(f"tolerance is {self.tolerance}; expected a number between 0 and 1")
        if self.texture and not 256 <= self.texture <= 4096:
            raise InputError(f"texture is {self.texture}; expected 0, or 256 to 4096 texels")
        if not 0 <= self.band <= 0.2:
            raise InputError(f"band is {self.band}; expected 0 to 0.2 meters")
        if self.seed < 0:
            raise InputError(f"color.seed is {self.seed}; expected 0 or a positive number")
        left_out(self.without, COLORING)

    @property
    def off(self) -> frozenset[str]:
        """The names of the rules that are left out."""
        return left_out(self.without, COLORING)
