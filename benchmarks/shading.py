"""Measure the benefit of removing the photo's shading, and the errors of its camera: `python -m
benchmarks.shading --studio runs/studio` (a minute a photo).

Photos of the pinned panels, whose albedo and cameras are known (docs/evaluation.md). Colors: where
the photo shows the surface well, its colors with and without shading against the true albedo,
after a gain for each channel, since nobody knows the light's strength and color: the error's root
mean square over the albedo's, and PSNR of sRGB. Camera: the angle at which it sees the ground at
the feet, and its pitch.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.body import FitResult, fit_body, nearest_parts
from a2v.body.parts import PARTS
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import vertex_normals
from a2v.lab.evaluation.reconstruction import PANELS, open_case, open_studio
from a2v.lab.evaluation.reconstruction.cases import Case
from a2v.lab.evaluation.reconstruction.maps import camera_of_crop, surface_maps
from a2v.perception import find_person
from a2v.reconstruction import ColorSettings
from a2v.reconstruction.backends import backend_of
from a2v.reconstruction.colorings import color_by_photo
from a2v.rendering.viewpoint import find_viewpoint, soles_slope
from a2v.types import BoolArray, FloatArray, Reconstruction, Subject, Surface

_MAP = 1024


@dataclass(frozen=True, kw_only=True)
class Row:
    """Of one photo: relative error and PSNR (dB) with shading and without, and degrees at the feet,
    true, by the soles and found."""

    name: str
    error: tuple[float, float]
    psnr: tuple[float, float]
    angle: tuple[float, float, float]


def measure(case: Case, subject: Subject, fit: FitResult, shape: Reconstruction) -> Row:
    """Measure one photo; perception, fit and shape are those of the pipeline."""
    made = [
        color_by_photo(
            shape, subject, fit.body, fit.camera, settings=ColorSettings(texture=0, delight=delight)
        )
        for delight in (False, True)
    ]
    albedo, sure = _true_albedo(case, subject, fit, made[0])
    scores = [_against(one.colors[sure], albedo[sure]) for one in made]
    parts = nearest_parts(shape.surface.vertices, fit.body)
    slope = soles_slope(
        shape.surface, [parts == PARTS.index(name) for name in ("left_foot", "right_foot")]
    )
    true = case.surface.provenance["camera_height"] / case.surface.provenance["camera_distance"]
    usual = find_viewpoint(None).slope
    angle = np.degrees(
        np.arctan([true, usual if slope is None else slope, find_viewpoint(slope).slope])
    )
    errors, psnrs = zip(*scores, strict=True)
    return Row(
        name=f"{case.name} {case.index}", error=errors, psnr=psnrs, angle=tuple(angle.tolist())
    )


def _true_albedo(
    case: Case, subject: Subject, fit: FitResult, surface: Surface
) -> tuple[FloatArray, BoolArray]:
    """True colors (V, 3) at the pixels of the vertices, and where they can be compared (V,): well
    seen, away from the rims of both surfaces."""
    import cv2

    shape = (int(case.mask.shape[0]), int(case.mask.shape[1]))
    maps = surface_maps(case.surface, case.normals, case.camera, shape, size=_MAP, side=1)
    crop = camera_of_crop(case.camera, subject)
    pixels = case.camera.project(crop.unproject(fit.camera.project(surface.vertices), 0.0)) * (
        _MAP / max(shape)
    )
    near = np.ones((9, 9), np.uint8)
    depth = np.nan_to_num(maps.depth, nan=9.0)
    inner = (cv2.erode(maps.mask.astype(np.uint8), near) > 0) & (
        cv2.dilate(depth, near) - cv2.erode(depth, near) < 0.04
    )
    soft = cv2.GaussianBlur(maps.colors, (0, 0), 1.0)
    at = np.clip(pixels.astype(int), 0, np.array(inner.shape[::-1]) - 1)
    sure = inner[at[:, 1], at[:, 0]] & (vertex_normals(surface.vertices, surface.faces)[:, 2] > 0.4)
    return sample_image(soft, pixels), sure if surface.visible is None else sure & surface.visible


def _against(colors: FloatArray, true: FloatArray) -> tuple[float, float]:
    """Return the relative error of linear colors (n, 3), and PSNR of sRGB, after a gain per
    channel."""
    mine, wanted = srgb_to_linear(colors), srgb_to_linear(true)
    gained = mine * ((mine * wanted).sum(axis=0) / (mine**2).sum(axis=0))
    error = float(np.sqrt(((gained - wanted) ** 2).sum() / (wanted**2).sum()))
    return error, float(-10 * np.log10(np.mean((linear_to_srgb(gained) - true) ** 2)))


def told(rows: list[Row]) -> str:
    """Return the table with the means below it."""
    lines = [
        "| photo | error, with shading | without | PSNR dB, with | without | ground at the feet, ° "
        "| soles | found |",
        "|---|" + "---|" * 7,
    ]
    for row in rows:
        a, b, c = row.angle
        lines.append(
            f"| {row.name} | {row.error[0]:.3f} | {row.error[1]:.3f} | {row.psnr[0]:.1f} | "
            f"{row.psnr[1]:.1f} | {a:.0f} | {b:.0f} | {c:.0f} |"
        )
    error, psnr, angle = (
        np.array([getattr(row, name) for row in rows]) for name in ("error", "psnr", "angle")
    )
    usual = np.degrees(np.arctan(find_viewpoint(None).slope))
    off = [np.abs(angle[:, 0] - x).mean() for x in (0, usual, angle[:, 1], angle[:, 2])]
    lines.append(
        f"\nmeans of {len(rows)}: error {error.mean(axis=0).round(3)}, PSNR "
        f"{psnr.mean(axis=0).round(2)} dB"
    )
    lines.append(
        f"better in {(error[:, 1] < error[:, 0]).sum()}; the worst becomes "
        f"{(error[:, 1] / error[:, 0]).max():.2f} times what it was"
    )
    lines.append(
        "degrees off: level {:.1f}, the usual slope {:.1f}, soles alone {:.1f}, found {:.1f}".format(
            *off
        )
    )
    return "\n".join(lines)


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--studio",
        type=Path,
        required=True,
        help="folder with the studio's poses and guides (made there if missing)",
    )
    parser.add_argument(
        "--data", type=Path, default=Path(os.environ.get("A2V_DATA", "../shared/data"))
    )
    parser.add_argument("--panel", choices=sorted(PANELS), default="report")
    parser.add_argument("--photos", type=int, default=12)
    options = parser.parse_args()
    studio, rows = open_studio(options.studio, options.data), []
    for pin in PANELS[options.panel][: options.photos]:
        case = open_case(studio, pin)
        subject = find_person(case.image)
        fit = fit_body(subject)
        rows.append(measure(case, subject, fit, backend_of("pifu")(subject, fit.body, fit.camera)))
        print(rows[-1].name, flush=True)
    print(told(rows))


if __name__ == "__main__":
    main()
