"""Sampling of textures at hits of rays."""

from __future__ import annotations

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import srgb_to_linear
from a2v.geometry.rays import at_barycentric
from a2v.types import ByteArray, FloatArray, IntArray, Surface


def sample_bilinear(image: np.ndarray, at: FloatArray) -> FloatArray:
    """Sample an image (H, W, C) bilinearly at columns and rows (n, 2) float32; returns (n, C).

    The center of the first pixel is (0, 0).
    """
    import cv2

    width = 4096  # OpenCV's maps are images of at most 32767 pixels a side
    rows = -(-len(at) // width)
    padded = np.zeros((rows * width, 2), np.float32)
    padded[: len(at)] = at
    found = cv2.remap(
        image,
        padded.reshape(rows, width, 2),
        None,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(found).reshape(rows * width, -1)[: len(at)]


_LINEAR = srgb_to_linear(np.arange(256) / 255)
"""Linear light of each byte."""


def texture_of(surface: Surface) -> tuple[FloatArray, ByteArray]:
    """Return the texture coordinates (F, 3, 2) and the texture (H, W, 3) uint8 of a surface.

    Raises
    ------
    InputError
        The surface has no texture.
    """
    if surface.uv is None or surface.texture is None:
        raise InputError("the surface has no texture")
    return surface.uv, surface.texture


def texture_at(surface: Surface, faces: IntArray, barycentric: FloatArray) -> FloatArray:
    """Sample the texture bilinearly at barycentric coordinates (n, 2) of faces (n,); linear light
    (n, 3) float32.

    Raises
    ------
    InputError
        The surface has no texture.
    """
    places, texture = texture_of(surface)
    height, width = texture.shape[:2]
    place = at_barycentric(places[faces], barycentric)
    at = np.stack([place[:, 0] * width - 0.5, (1 - place[:, 1]) * height - 0.5], axis=1)
    return np.asarray(_LINEAR[sample_bilinear(texture, at.astype(np.float32))])
