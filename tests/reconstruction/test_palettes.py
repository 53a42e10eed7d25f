"""Distances of colors from a palette."""

from __future__ import annotations

import numpy as np

from a2v.reconstruction.palettes import palette_distance


def test_the_distance_is_that_of_the_nearest_color() -> None:
    generator = np.random.default_rng(0)
    lab, palette = generator.normal(0, 30, (40, 50, 3)), generator.normal(0, 30, (7, 3))
    shade = np.array([0.3, 1.0, 2.0])
    expected = np.linalg.norm((lab[:, :, None] - palette) * shade, axis=-1).min(axis=-1)
    np.testing.assert_allclose(palette_distance(lab, palette, shade), expected, rtol=1e-12)
    flat = palette_distance(lab.reshape(-1, 3), palette[:1], shade)
    assert flat.shape == (2000,)
    np.testing.assert_array_equal(palette_distance(palette[:1], palette[:1], shade), 0)
