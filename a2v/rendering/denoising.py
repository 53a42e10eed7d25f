"""Open Image Denoise on whole frames or on their noisy parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.rendering.region import Box
from a2v.types import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True)
class Layers:
    """Layers of a traced picture before denoising, float32.

    `color` (H, W, 3) is linear RGB over the backdrop, `albedo` (H, W, 3) the linear reflectance and
    `normal` (H, W, 3) the world normal of the first hit. Where a ray hits nothing, `normal` is the
    ground's, so that the horizon is no edge. `alpha` (H, W) is the fraction of the pixel that
    person or ground covers.
    """

    color: FloatArray
    albedo: FloatArray
    normal: FloatArray
    alpha: FloatArray


def denoise(layers: Layers) -> FloatArray:
    """Denoise one frame by Open Image Denoise, guided by albedo and normals; linear RGB (H, W, 3)
    float32.

    Pixels that show only the backdrop are exact and remain unchanged.
    """
    import mitsuba_oidn as oidn

    color, albedo, normal = (
        np.ascontiguousarray(part, np.float32)
        for part in (layers.color, layers.albedo, layers.normal)
    )
    clean = np.array(
        oidn.denoise(color, albedo, normal, hdr=True, quality=oidn.Quality.High), np.float32
    )
    return np.where(layers.alpha[..., None] > 0, clean, color)


def denoise_parts(
    color: FloatArray, albedo: FloatArray, where: BoolArray, parts: list[Box]
) -> FloatArray:
    """Denoise each of `parts` of `color` (H, W, 3) by itself, where `where` (H, W) is set.

    Overlapping parts are blended. The only guide is `albedo` (H, W, 3): normals bring no
    improvement here (docs/research/rendering.md).
    """
    made, summed, weights = (
        color.copy(),
        np.zeros_like(color),
        np.zeros((*where.shape, 1), np.float32),
    )
    for part in parts:
        weight = part.weight(len(where))[..., None]
        summed[part.window] += weight * _fast(color[part.window], albedo[part.window])
        weights[part.window] += weight
    made[where] = summed[where] / np.maximum(weights[where], 1e-12)
    return made


def denoise_plain(picture: FloatArray, *, border: int = 16) -> FloatArray:
    """Denoise a picture (H, W, 3) of light that has no object edges; float32.

    The picture is mirrored at its borders, where the network's colors would be off by some levels.
    """
    height, width = picture.shape[:2]
    down, right = -(height + 2 * border) % 16, -(width + 2 * border) % 16
    whole = np.pad(
        picture, ((border, border + down), (border, border + right), (0, 0)), mode="symmetric"
    )
    return _fast(whole, np.ones_like(whole))[border : border + height, border : border + width]


def _fast(color: FloatArray, *guides: FloatArray) -> FloatArray:
    import mitsuba_oidn as oidn

    given = (np.ascontiguousarray(part, np.float32) for part in (color, *guides))
    return np.array(oidn.denoise(*given, hdr=True, quality=oidn.Quality.Fast), np.float32)
