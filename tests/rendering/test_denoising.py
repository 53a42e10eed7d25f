"""The light on a person is denoised at half the resolution and keeps the edges of its guides."""

from __future__ import annotations

import numpy as np

from a2v.rendering.denoising import denoise_person
from a2v.rendering.tracer import Traced
from a2v.types import FloatArray

UP, SIDE = np.float32([0, 1, 0]), np.float32([1, 0, 0])


def layers(size: int = 64) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return light, albedo and normal of a striped person, bright above, dark below."""
    upper = (np.arange(size) < 31)[:, None, None]  # the edge is within a pair of rows
    light = np.where(upper, np.float32(0.9), np.float32(0.2)) * np.ones((size, size, 3), np.float32)
    stripes = np.where(np.arange(size) % 2, np.float32(0.7), np.float32(0.2))[None, :, None]
    normal = np.where(upper, UP, SIDE) * np.ones((size, size, 1), np.float32)
    return light, stripes * np.ones_like(light), normal.astype(np.float32)


def test_texture_and_edges_of_light_stay_at_full_resolution() -> None:
    light, albedo, normal = layers()
    person = np.ones((64, 64), np.float32)
    made = denoise_person(light * albedo, albedo, normal, person)
    inside = np.s_[4:-4, 4:-4]
    np.testing.assert_allclose(made[inside] / albedo[inside], light[inside], rtol=0.12)


def test_noise_is_removed() -> None:
    light, albedo, normal = layers()
    noise = np.random.default_rng(0).gamma(8, 1 / 8, light.shape).astype(np.float32)
    made = denoise_person(light * albedo * noise, albedo, normal, np.ones((64, 64), np.float32))
    before = np.std(noise[8:24, 8:-8])
    after = np.std((made / albedo / light)[8:24, 8:-8])
    assert after < 0.15 * before


def test_partly_covered_pixels_keep_their_coverage() -> None:
    light, albedo, normal = layers()
    person = np.where(np.arange(64) < 20, np.float32(0), np.float32(1))[None].repeat(64, axis=0)
    person[:, 20] = 0.25
    part = person[..., None]
    made = denoise_person(light * albedo * part, albedo * part, normal * part, person)
    assert (made[:, :20] == 0).all()
    np.testing.assert_allclose(made[8:24, 20], (light * albedo)[8:24, 20] * 0.25, rtol=0.1)


def test_values_of_pixels_are_laid_out_in_an_even_part_of_the_picture() -> None:
    size = 64
    rows, columns = np.array([3, 7, size - 1]), np.array([5, size - 1, 9])
    values = np.arange(9, dtype=np.float32).reshape(3, 3) + 1
    traced = Traced(color=values, albedo=values, normal=values, person=values[:, 0])
    window, (color, _, _, person) = traced.laid(rows * size + columns, size)
    assert color.shape[0] % 2 == color.shape[1] % 2 == 0
    assert window[0].start % 2 == window[1].start % 2 == 0
    whole = np.zeros((size, size, 3), np.float32)
    whole[window] = color
    np.testing.assert_array_equal(whole[rows, columns], values)
    assert np.count_nonzero(whole) == 9
    assert np.count_nonzero(person) == 3
