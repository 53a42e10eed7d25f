"""The mean face of MakeHuman's skins (CC0), in the tone of a person's skin."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.images import sample_image
from a2v.io import read_npz
from a2v.types import FloatArray

MEAN_FACE = Path(__file__).parent / "mean_face.npz"
"""Made by ``scripts/make_mean_face.py``."""
STEPS = 64.0
"""Steps of the stored logarithms per unit."""
EXTENT = 0.24
"""Width of pictures of the face, meters."""
_GRID = 33
"""Points per side at which the warp is found; between them it is linear."""
_STIFF = 1e-4
"""Smoothing of the warp: neighboring landmarks of different people do not fold it."""


@functools.cache
def _stored() -> tuple[FloatArray, FloatArray]:
    """Logarithm (S, S, 3) of the mean face's linear light relative to the cheeks, and the places
    (478, 2) of the detector's landmarks in it, as shares of its width."""
    stored = read_npz(MEAN_FACE)
    return stored["logarithm"].astype(np.float32) / STEPS, stored["places"].astype(np.float64)


def mean_face(places: FloatArray, skin: FloatArray, size: int) -> FloatArray:
    """Return the mean face (size, size, 3) float32, sRGB in [0, 1], with cheeks of the color `skin`
    (3,) and the detector's landmarks at `places` (478, 2), pixels."""
    import cv2
    from scipy.interpolate import RBFInterpolator

    logarithm, stored = _stored()
    wide = logarithm.shape[1]
    way = RBFInterpolator(places / size, stored - places / size, smoothing=_STIFF)
    line = np.linspace(0, 1, _GRID)
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    fine = (np.stack(np.meshgrid(np.arange(size), np.arange(size)), axis=-1) + 0.5) / size
    index = (fine * (_GRID - 1)).astype(np.float32)
    bend = cv2.remap(
        way(grid).reshape(_GRID, _GRID, 2).astype(np.float32),
        index[..., 0],
        index[..., 1],
        cv2.INTER_LINEAR,
    )
    ratio = sample_image(logarithm, wide * (fine + bend).reshape(-1, 2), linear=True)
    light = srgb_to_linear(skin) * np.exp(ratio.reshape(size, size, 3))
    return linear_to_srgb(light)
