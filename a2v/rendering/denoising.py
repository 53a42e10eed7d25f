"""Open Image Denoise on whole frames or on their noisy parts."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from a2v.types import FloatArray

_ALIKE = np.float32(0.2)
"""Length of the difference of two normals at which a weight falls to exp(-1/2)."""


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


def denoise_person(
    color: FloatArray, albedo: FloatArray, normal: FloatArray, person: FloatArray
) -> FloatArray:
    """Denoise the light on a person at half the resolution; linear RGB (H, W, 3) float32.

    `color`, `albedo` and `normal` (H, W, 3) are means over the samples, which are 0 where a sample
    misses the person; `person` (H, W) is the fraction of samples that hit it. H and W are even.

    Albedo and normals have next to no noise. So only their ratio to the color, the light, is
    denoised, from the means of 2 x 2 pixels. Each pixel gets the light of its four neighbors among
    these, weighted by distance and by how much their normals agree (joint bilateral upsampling,
    Kopf et al., SIGGRAPH 2007), times its own albedo.
    """
    import cv2

    shape = person.shape[1] // 2, person.shape[0] // 2
    light, reflected, normals, covered = (
        cv2.resize(part, shape, interpolation=cv2.INTER_AREA)
        for part in (color, albedo, normal, person)
    )
    seen = covered > 0
    if not seen.any():
        return color
    light = light / np.maximum(reflected, 1e-4)
    light[~seen] = np.median(light[seen], axis=0)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)
    light, normals, seen = (
        np.pad(part, ((1, 1), (1, 1)) + ((0, 0),) * (part.ndim - 2), mode="edge")
        for part in (denoise_plain(light), normals, seen)
    )
    own = normal / np.maximum(person, 1e-6)[..., None]
    made = np.zeros_like(color)
    for y, x in itertools.product((0, 1), repeat=2):
        total = np.zeros((*shape[::-1], 3), np.float32)
        weights = np.full(shape[::-1], 1e-8, np.float32)
        for down, right in itertools.product((y, y + 1), (x, x + 1)):
            window = slice(down, down + shape[1]), slice(right, right + shape[0])
            near = np.float32((0.75 if down == 1 else 0.25) * (0.75 if right == 1 else 0.25))
            off = np.square(own[y::2, x::2] - normals[window]).sum(axis=-1)
            weight = near * (np.exp(off * (-0.5 / _ALIKE**2)) + np.float32(1e-4)) * seen[window]
            total += weight[..., None] * light[window]
            weights += weight
        made[y::2, x::2] = total / weights[..., None]
    return np.asarray(made * albedo, np.float32)


def denoise_plain(picture: FloatArray, *, border: int = 8) -> FloatArray:
    """Denoise a picture (H, W, 3) of light that has no object edges; float32.

    The picture is mirrored at its borders, where the network's colors would be off by some levels.
    """
    import mitsuba_oidn as oidn

    height, width = picture.shape[:2]
    down, right = -(height + 2 * border) % 16, -(width + 2 * border) % 16
    whole = np.pad(
        picture, ((border, border + down), (border, border + right), (0, 0)), mode="symmetric"
    )
    clean = oidn.denoise(
        np.ascontiguousarray(whole, np.float32),
        np.ones_like(whole, np.float32),
        hdr=True,
        quality=oidn.Quality.Fast,
    )
    return np.array(clean, np.float32)[border : border + height, border : border + width]
