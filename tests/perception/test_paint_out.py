"""The photo without the person."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.perception.paint_out import in_photo, paint_out


def stripes(height: int = 120, width: int = 160) -> np.ndarray:
    """A picture whose rows differ and whose columns repeat: sky over sea over sand."""
    rows = np.select([np.arange(height) < 50, np.arange(height) < 85], [0, 1], 2)
    colors = np.array([[120, 170, 230], [30, 90, 110], [220, 200, 160]], np.uint8)
    grain = np.random.default_rng(0).integers(-6, 7, (height, width, 3))
    return np.clip(colors[rows][:, None] + grain, 0, 255).astype(np.uint8)


def test_the_horizon_goes_on_behind_the_person():
    behind = stripes()
    mask = np.zeros(behind.shape[:2], np.float32)
    mask[25:110, 65:95] = 1
    photo = np.where(mask[..., None] > 0, np.uint8([200, 20, 20]), behind)
    painted = paint_out(photo, mask)
    hole = mask > 0
    off = np.abs(painted.astype(float) - behind)[hole]
    assert off.mean() < 8  # grain alone is 4 on average between two of its draws
    assert (
        off.max(axis=-1) > 60
    ).mean() < 0.02  # the red is gone, and the borders of sea and sand are continuous
    away = np.zeros_like(hole)
    away[:, :60] = away[:, 100:] = True
    changed = (painted[away] != photo[away]).any(axis=-1)
    assert changed.mean() < 0.001  # pixels that are taken for a shadow
    np.testing.assert_array_equal(painted, paint_out(photo, mask))


def test_nothing_to_paint_and_nothing_to_paint_with():
    photo = stripes()
    np.testing.assert_array_equal(paint_out(photo, np.zeros(photo.shape[:2])), photo)
    with pytest.raises(InputError, match="nine tenths"):
        paint_out(photo, np.ones(photo.shape[:2]))
    with pytest.raises(InputError, match="the same size"):
        paint_out(photo, np.ones((3, 4)))


def test_a_mask_lies_over_its_crop_even_beyond_the_photo():
    mask = np.zeros((10, 20), np.float32)
    mask[:, 10:] = 1
    placed = in_photo(mask, (-10, 5, 30, 25), (40, 30))  # twice as large as the mask
    assert placed.shape == (30, 40)
    assert placed[6:24, 12:29].min() == 1
    assert placed[:5].max() == placed[25:].max() == placed[:, 30:].max() == placed[:, :8].max() == 0
