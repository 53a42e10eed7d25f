"""The protocol of the reconstruction benchmark."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from a2v.errors import InputError

SPLIT = "validation"

METRICS: Mapping[str, tuple[str, int]] = {
    "chamfer": ("Chamfer cm↓", 2),
    "p2s": ("P2S cm↓", 2),
    "normals": ("Normals↑", 3),
    "normals_nearest": ("Normals, nearest↑", 3),
    "iou": ("IoU↑", 3),
    "psnr_front": ("Front PSNR↑", 2),
    "ssim_front": ("Front SSIM↑", 3),
    "psnr_back": ("Back PSNR↑", 2),
    "ssim_back": ("Back SSIM↑", 3),
}
"""Columns of the tables by metric, and their decimals."""


@dataclass(frozen=True)
class BenchmarkSettings:
    """The protocol.

    Attributes
    ----------
    views : int
        Photos.
    seed : int
        Chooses them, and the points on the predicted surface.
    size : int
        Rays along each side of the square photo, for silhouettes, normals and colours.
    points : int
        Points on the predicted surface.
    true_mask : bool
        Give the true mask to perception, which then does not look for its own.
    """

    views: int = 20
    seed: int = 0
    size: int = 512
    points: int = 50_000
    true_mask: bool = False

    def __post_init__(self) -> None:
        if self.views < 1 or self.points < 100 or not 64 <= self.size <= 2048:
            raise InputError(
                f"views={self.views}, points={self.points}, size={self.size}; expected at least 1 and 100, and a size from 64 to 2048"
            )
