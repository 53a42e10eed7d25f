"""The sRGB curve and its table."""

from __future__ import annotations

import numpy as np

from a2v.geometry.colors import (
    lab_of_bytes,
    lightness_of_bytes,
    linear_to_srgb,
    srgb_bytes,
    srgb_to_linear,
    to_bytes,
)


def test_the_table_is_the_curve() -> None:
    linear = np.concatenate(
        [np.linspace(-0.1, 1.2, 400_001), np.geomspace(1e-7, 1, 100_001)]
    ).astype(np.float32)
    off = srgb_bytes(linear).astype(int) - to_bytes(linear_to_srgb(linear))
    assert np.abs(off).max() <= 1
    assert (off != 0).mean() < 0.01
    assert (np.diff(srgb_bytes(np.sort(linear)).astype(int)) >= 0).all()
    every = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(srgb_bytes(srgb_to_linear(every / np.float32(255))), every)
    assert srgb_bytes(np.zeros((4, 5, 3))).shape == (4, 5, 3)


def test_lab_of_bytes_is_that_of_scikit_image() -> None:
    """Of few pixels, and of so many that each color is converted once."""
    from skimage.color import rgb2lab

    for side in (20, 400):
        image = np.random.default_rng(0).integers(0, 256, (side, side, 3), dtype=np.uint8)
        image[:3, :3] = np.arange(9).reshape(3, 3, 1)  # the curve's straight part
        expected = rgb2lab(image)
        assert np.abs(lab_of_bytes(image) - expected).max() < 1e-10
        assert np.abs(lightness_of_bytes(image) - expected[..., 0]).max() < 1e-10
