"""The protocol of the reconstruction benchmark."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from a2v.body.limbs import LIMBS
from a2v.errors import InputError
from a2v.lab.evaluation.reconstruction.panels import PANELS

SPLIT = "validation"

METRICS: Mapping[str, tuple[str, int]] = {
    "chamfer": ("Chamfer cm↓", 2),
    "p2s": ("P2S cm↓", 2),
    "chamfer_aligned": ("aligned: Chamfer↓", 2),
    "p2s_aligned": ("P2S↓", 2),
    "chamfer_world": ("in the world: Chamfer↓", 2),
    "p2s_world": ("P2S↓", 2),
    "thick": ("Too thick %↓", 2),
    "slabs": ("Slabs %↓", 2),
    "slabs_slack": ("Slabs, 1 cm aside %↓", 2),
    "normals": ("Normals↑", 3),
    "normals_nearest": ("Normals, nearest↑", 3),
    "iou": ("IoU↑", 3),
    "psnr_front": ("Front PSNR↑", 2),
    "ssim_front": ("Front SSIM↑", 3),
    "psnr_back": ("Back PSNR↑", 2),
    "ssim_back": ("Back SSIM↑", 3),
    "psnr_back_aside": ("Back PSNR, 3 cm aside↑", 2),
    "detail_back": ("Back detail →1", 2),
}
"""Columns of the tables by metric, and their decimals."""

FIT_METRICS: Mapping[str, tuple[str, int]] = {
    "body_aligned": ("Body, aligned Chamfer cm↓", 2),
    "body_world": ("in the world↓", 2),
    "landmarks_world": ("Landmarks there cm↓", 2),
    **{f"depth_{limb}": (f"{limb.replace('_', ' ')} cm↓", 1) for limb in LIMBS},
    "keypoint_mean": ("Keypoints % of height↓", 2),
    "silhouette_iou": ("IoU↑", 3),
}
"""Columns of the table of the fit: its skin against the dressed truth, and the errors of limbs in
depth, relative to the trunk."""


@dataclass(frozen=True)
class BenchmarkSettings:
    """The protocol.

    Attributes
    ----------
    panel : str
        Name of the list of photos (`PANELS`).
    views : int
        Largest number of photos; the first ones of the panel are taken. No panel has more than 40.
    seed : int
        Seed of the choice of points on the predicted surface.
    size : int
        Rays along each side of the square photo, for silhouettes, normals and colors.
    points : int
        Number of points on the predicted surface.
    true_mask : bool
        Give the true mask to perception, which then does not segment the photo.
    bodymap : bool
        Let perception use the body map network; otherwise landmarks are those of the detector.
    distance : float, optional
        Given distance from camera to person, meters; 0 for an orthographic camera. Without it, the
        fit estimates it as for users' photos.
    """

    panel: str = "studio"
    views: int = 40
    seed: int = 0
    size: int = 512
    points: int = 50_000
    true_mask: bool = False
    bodymap: bool = True
    distance: float | None = None

    def __post_init__(self) -> None:
        if self.panel not in PANELS:
            raise InputError(f"unknown panel '{self.panel}'; choose from {', '.join(PANELS)}")
        if self.views < 1 or self.points < 100 or not 64 <= self.size <= 2048:
            raise InputError(
                f"views={self.views}, points={self.points}, size={self.size}; "
                "expected at least 1 view and 100 points, and a size from 64 to 2048"
            )
