"""How a skirt hangs at rest: its flare by the photo's outline, its texture all around."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.reconstruction.canonical import Sight
from a2v.reconstruction.canonical.hanging import hanging
from a2v.reconstruction.canonical.skirt import COLUMNS, shown_around
from a2v.reconstruction.reading import Reading
from a2v.reconstruction.reading.record import ARMS
from a2v.reconstruction.reading.shown import STEP
from a2v.types import Body, FloatArray
from tests.support.faces import CAMERA, photographed
from tests.support.surfaces import coated

ROWS = 30
LEG = 0.12
"""Radius of the hull, meters."""
ANGLES = 2 * np.pi * np.arange(COLUMNS) / COLUMNS


def rings(heights: FloatArray, wide: float, deep: float) -> FloatArray:
    """Rows (R C, 3) of ellipses at these heights."""
    ring = np.stack([wide * np.sin(ANGLES), 0 * ANGLES, deep * np.cos(ANGLES)], axis=1)
    return np.concatenate([ring + np.array([0.0, height, 0.0]) for height in heights])


@pytest.fixture(scope="module")
def heights(body: Body) -> FloatArray:
    hips = body.bone_transforms[body.bone_names.index("upperleg01.L"), 1, 3]
    return np.linspace(hips, hips - 0.45, ROWS)


def flare(
    body: Body, heights: FloatArray, left: float, right: float, *, arm: bool = False
) -> FloatArray:
    """Displacement at rest of a skirt whose outline is so far from the hull at the hem, meters; an
    `arm` may hang at the picture's left side."""
    subject = photographed(body)
    rows = CAMERA.project(np.stack([0 * heights, heights, 0 * heights], axis=1))
    down = np.clip((np.arange(2048) - rows[0, 1]) / np.ptp(rows[:, 1]), 0, 1)
    column = np.arange(2048)
    inside = [
        sign * (column - rows[0, 0]) < CAMERA.scale * (LEG + down[:, None] * reach)
        for sign, reach in ((-1, left), (1, right))
    ]
    mask = (inside[0] & inside[1]).astype(np.float32)
    size = (2048 // STEP, 2048 // STEP)
    arms = np.zeros(size, np.uint8)
    if arm:
        beside = column[::STEP] < rows[0, 0] - CAMERA.scale * LEG
        arms[:, beside] = 1 << ARMS.index("right_lower_arm")
        mask[:, column < rows[0, 0] - CAMERA.scale * LEG] = 1
    reading = Reading(
        shown=np.full(size, -1, np.int8),
        found_arms=arms,
        better=np.ones(len(PARTS), bool),
        taken=np.zeros(size, bool),
    )
    subject = dataclasses.replace(subject, mask=mask)
    sight = Sight(subject, body, CAMERA, coated(body, cell=0.03, coat=0.01), reading)
    hull = rings(heights, LEG, LEG)
    return hanging(sight, np.full((ROWS, COLUMNS), 0.01), hull, hull)


def test_a_flare_is_as_wide_as_the_outline(body: Body, heights: FloatArray) -> None:
    found = flare(body, heights, 0.2, 0.2)
    assert (np.diff(found.mean(axis=1)) >= 0).all()
    assert 0.12 < found[-1].mean() < 0.22  # a loose skirt is less deep than wide
    straight = flare(body, heights, 0.01, 0.01)
    assert np.abs(straight - 0.01).max() < 0.015


def test_a_side_that_is_held_out_counts_no_more_than_the_other(
    body: Body, heights: FloatArray
) -> None:
    assert np.allclose(flare(body, heights, 0.05, 0.4), flare(body, heights, 0.05, 0.05), atol=0.01)


def test_an_arm_at_one_side_leaves_the_other(body: Body, heights: FloatArray) -> None:
    assert np.allclose(
        flare(body, heights, 0.0, 0.2, arm=True), flare(body, heights, 0.2, 0.2), atol=0.01
    )


def test_legs_apart_widen_the_flare_at_rest(body: Body, heights: FloatArray) -> None:
    """A row keeps its perimeter: on a hull that is wider in the photo the cloth is further away."""
    subject = photographed(body)  # its mask is the whole picture: only the surface tells
    sight = Sight(subject, body, CAMERA, coated(body, cell=0.03, coat=0.01))
    near, apart = (
        hanging(
            sight, np.full((ROWS, COLUMNS), 0.01), rings(heights, wide, LEG),
            rings(heights, LEG, LEG),
        ).mean()
        for wide in (LEG, 2 * LEG)
    )  # fmt: skip
    perimeters = [
        np.pi * np.sqrt(2 * ((w + 0.01) ** 2 + (LEG + 0.01) ** 2)) for w in (LEG, 2 * LEG)
    ]
    assert apart - near == pytest.approx((perimeters[1] - perimeters[0]) / (2 * np.pi), abs=0.005)


def test_all_around_it_takes_the_quarter_that_faces_the_camera() -> None:
    for turned in (0.0, 1.2):
        ring = rings(np.linspace(1.0, 0.6, 12), 0.2, 0.2)
        cosine, sine = np.cos(turned), np.sin(turned)
        ring[:, [0, 2]] = ring[:, [0, 2]] @ np.array([[cosine, -sine], [sine, cosine]])
        both = np.concatenate([ring, 0.98 * ring])
        there = shown_around(both)
        assert (there[there] == there).all()
        assert (np.abs(both[there, 1] - both[:, 1]) < 1e-9).mean() > 0.45  # the same row
        facing = both[there[: len(ring)]]
        assert (facing[:, 2] > 0.2 * np.cos(np.pi / 4) - 0.01).all()
        steps = np.abs(np.diff(np.append(there[:COLUMNS], there[0])))
        assert set(np.minimum(steps, COLUMNS - steps)) <= {0, 1}  # no seam
