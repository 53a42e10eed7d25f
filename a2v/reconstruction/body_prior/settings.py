"""Settings of the `body-prior` backend."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.errors import InputError


@dataclass(frozen=True)
class SurfaceSettings:
    """Settings of the surface from the body.

    Attributes
    ----------
    resolution : int
        Grid cells over the person's longer side; 320 gives cells of about 5 mm.
    vertices : int
        Target number of vertices, at least 25,000.
    reach : float
        Largest distance by which the rim is pulled to the silhouette, meters.
    rounds : int
        Rounds of matching and deforming.
    depth : float
        Fraction of the sideways push that is also applied in depth.
    lobe : float
        Largest half thickness of fused hair, skirts and bags, meters.
    """

    resolution: int = 320
    vertices: int = 36_000
    reach: float = 0.12
    rounds: int = 5
    depth: float = 0.7
    lobe: float = 0.09

    def __post_init__(self) -> None:
        if not 200 <= self.resolution <= 640:
            raise InputError(f"resolution is {self.resolution}; expected 200 to 640 cells")
        if not 25_000 <= self.vertices <= 200_000:
            raise InputError(f"vertices is {self.vertices}; expected 25000 to 200000")
        if not 1 <= self.rounds <= 20:
            raise InputError(f"rounds is {self.rounds}; expected 1 to 20")
        if not (0 <= self.reach <= 0.5 and 0 <= self.depth <= 2 and 0 <= self.lobe <= 0.5):
            raise InputError("reach and lobe must be from 0 to 0.5 meters, depth from 0 to 2")
