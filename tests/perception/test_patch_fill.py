"""Holes are filled with patches of the rest of the picture."""

from __future__ import annotations

import numpy as np

from a2v.perception.behind import find_regions
from a2v.perception.paint_out import paint_out, shadow_around
from a2v.perception.patch_fill import fill_by_patches
from a2v.types import BoolArray, ByteArray


def room(height: int = 150, width: int = 200) -> ByteArray:
    """A wall that a lamp on the left lights, and a floor below it, with grain."""
    rows, columns = np.indices((height, width))
    light = 1.0 - 0.45 * columns / width
    wall, floor = np.array([225, 205, 190]), np.array([120, 90, 60])
    plain = np.where((rows < 0.7 * height)[..., None], wall, floor) * light[..., None]
    return np.clip(
        plain + np.random.default_rng(1).normal(0, 2, (height, width, 1)), 0, 255
    ).astype(np.uint8)


def person(height: int = 150, width: int = 200) -> BoolArray:
    rows, columns = np.indices((height, width))
    return np.asarray((np.abs(columns - 105) < 18) & (rows > 20) & (rows < 130))


def test_the_light_on_a_wall_goes_on_without_bands() -> None:
    behind, mask = room(), person()
    photo = np.where(mask[..., None], np.uint8([30, 60, 160]), behind)
    painted = paint_out(photo, mask.astype(np.float32)).astype(float)
    off = np.abs(painted - behind)[mask]
    assert off.mean() < 5  # grain alone is 2.7; by shift maps alone it is over 8
    assert (
        off.max(axis=-1) > 30
    ).mean() < 0.06  # where the border between wall and floor is a few pixels off
    rows = slice(
        40, 90
    )  # the wall's mean over the hole changes as around it: no step at either border
    inside = painted[rows, 88:122].mean(axis=(0, 2))
    assert np.abs(np.diff(inside)).max() < 3
    across = painted[95:115, 105].mean(
        axis=1
    )  # the border between wall and floor is as sharp as beside the person
    assert (
        np.abs(np.diff(across)).max()
        > 0.5 * np.abs(np.diff(behind[95:115, 40].mean(axis=1).astype(float))).max()
    )


def test_what_is_known_stays_and_seeds_repeat() -> None:
    import cv2

    colors = cv2.cvtColor(room().astype(np.float32) / 255, cv2.COLOR_RGB2Lab)
    hole = person()
    filled = fill_by_patches(colors, hole)
    np.testing.assert_array_equal(filled[~hole], colors[~hole])
    np.testing.assert_array_equal(filled, fill_by_patches(colors, hole))
    assert np.isfinite(filled).all()


def test_a_shadow_next_to_the_person_is_found_and_a_darker_thing_is_not() -> None:
    import cv2

    photo, mask = room().astype(float), person()
    rows, columns = np.indices(mask.shape)
    shade = ((columns - 130) / 28.0) ** 2 + ((rows - 128) / 10.0) ** 2 < 1
    thing = (rows > 40) & (rows < 80) & (columns > 124) & (columns < 140)
    photo[shade] *= 0.6
    photo[thing] = (20, 30, 120)
    colors = cv2.cvtColor(photo.astype(np.float32) / 255, cv2.COLOR_RGB2Lab)
    found, _ = shadow_around(colors, mask, find_regions(colors, mask))
    visible = shade & ~mask
    assert found[visible].mean() > 0.7
    assert found[thing].mean() < 0.2
    assert found[:, :60].mean() < 0.02
