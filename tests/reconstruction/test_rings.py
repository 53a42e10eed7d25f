"""Borders of garments that run around the body."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.reconstruction.backs.rings import around
from a2v.reconstruction.backs.seen import LOWER, SKIN, UPPER


def _cylinder(part: str, middle: float, bottom: float, top: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) around the axis x = `middle`, and their parts."""
    height, angle = np.meshgrid(
        np.arange(bottom, top, 0.01), np.linspace(0, 2 * np.pi, 60, endpoint=False), indexing="ij"
    )
    points = np.stack(
        [middle + 0.08 * np.sin(angle), height, 0.08 * np.cos(angle)], axis=-1
    ).reshape(-1, 3)
    return points, np.full(len(points), PARTS.index(part))


def _ragged(
    points: np.ndarray, true: np.ndarray, kinds: tuple[int, int], known: np.ndarray
) -> np.ndarray:
    """The true labels; a third of the hidden ones within 12 cm of the border is wrong."""
    generator = np.random.default_rng(0)
    border = (points[true == kinds[0], 1].min() + points[true == kinds[1], 1].max()) / 2
    wrong = ~known & (np.abs(points[:, 1] - border) < 0.12) & (generator.random(len(points)) < 0.33)
    return np.where(wrong, sum(kinds) - true, true)


@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_a_hem_goes_on_behind_as_the_photo_shows_it(tilt: float) -> None:
    points, parts = _cylinder("torso", 0.0, 0.7, 1.4)
    true = np.where(points[:, 1] > 1.0 + tilt * points[:, 0] / 0.08, UPPER, LOWER)
    known = points[:, 2] > 0.01
    given = _ragged(points, true, (UPPER, LOWER), known)
    found = around(given, points, parts, known)
    assert (given != true).mean() > 0.02
    off = np.abs(points[:, 1] - 1.0 - tilt * points[:, 0] / 0.08)
    assert not (found != true)[off > 0.012].any()
    assert np.array_equal(found[known], given[known])


def test_a_hidden_trouser_leg_ends_where_the_other_one_does() -> None:
    legs = [
        _cylinder(f"{side}_shin", middle, 0.1, 0.5)
        for side, middle in (("left", 0.12), ("right", -0.12))
    ]
    points, parts = (
        np.concatenate([leg[0] for leg in legs]),
        np.concatenate([leg[1] for leg in legs]),
    )
    true = np.where(points[:, 1] > 0.3, LOWER, SKIN)
    known = (points[:, 2] > 0.01) & (points[:, 0] > 0)
    found = around(_ragged(points, true, (LOWER, SKIN), known), points, parts, known)
    assert not (found != true)[np.abs(points[:, 1] - 0.3) > 0.012].any()


def test_what_tells_no_height_changes_nothing() -> None:
    points, parts = _cylinder("torso", 0.0, 0.7, 1.4)
    known = points[:, 2] > 0.01
    open_coat = np.where(np.abs(points[:, 0]) > 0.03, UPPER, LOWER)  # its border runs up and down
    labels = np.where(known, open_coat, LOWER)
    assert np.array_equal(around(labels, points, parts, known), labels)
    every = np.full(len(points), UPPER)
    assert np.array_equal(around(every, points, parts, known), every)


def test_a_fly_in_the_front_does_not_lift_the_seat() -> None:
    points, parts = _cylinder("torso", 0.0, 0.7, 1.4)
    true = np.where(
        points[:, 1] > 1.0 - 0.05 * np.clip(points[:, 2] / 0.08, 0, 1) ** 2, UPPER, LOWER
    )  # lower in the middle of the front
    known = points[:, 2] > 0.01
    found = around(_ragged(points, true, (UPPER, LOWER), known), points, parts, known)
    assert not (found != true)[
        ~known & (np.abs(points[:, 1] - 1.0) > 0.035)
    ].any()  # .05 and more with a free tilt


def test_a_hidden_border_stays_within_the_range_of_a_visible_one_without_a_plane() -> None:
    points, parts = _cylinder("torso", 0.0, 0.7, 1.4)
    known, flap = points[:, 2] > 0.01, np.abs(points[:, 0] - 0.02) > 0.03
    hem = np.where(flap, 0.88, 1.12)  # of an open jacket, and the waist of the trousers in it
    true = np.where(points[:, 1] > hem, UPPER, LOWER)
    hidden = np.where(points[:, 0] > 0, 1.35, 0.75)  # trousers up to a shoulder blade
    given = np.where(known, true, np.where(points[:, 1] > hidden, UPPER, LOWER))
    found = around(given, points, parts, known)
    assert np.array_equal(found[known], given[known])
    assert (found[~known & (points[:, 1] > 1.13)] == UPPER).all()
    assert (found[~known & (points[:, 1] < 0.87)] == LOWER).all()
