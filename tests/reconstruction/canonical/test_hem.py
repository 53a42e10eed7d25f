"""Skirts on legs that are together: where they end, and what is not a skirt."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body.parts import PARTS, on_parts
from a2v.reconstruction.coloring.canvas import bare_legs
from a2v.reconstruction.reading.hem import line_between_legs, skirt_hem
from a2v.types import Body, Subject
from tests.support.faces import CAMERA, photographed

SKIN = (205, 150, 120)
CLOTH = (60, 70, 140)


def _dressed(
    body: Body, low: float, *, gap: int | None = None, below: tuple[int, int, int] = SKIN
) -> Subject:
    """A person in cloth from the waist to the height `low`, meters, and bare below.

    A shadow of `gap` pixels runs between the legs.
    """
    subject = photographed(body)
    image = np.full_like(subject.image, 128)
    points = CAMERA.project(
        body.vertices[
            on_parts(body.parts, "torso", "left_thigh", "right_thigh", "left_shin", "right_shin")
        ]
    ).astype(int)
    rows = slice(points[:, 1].min(), points[:, 1].max())
    image[rows, points[:, 0].min() : points[:, 0].max()] = below
    hem = int(CAMERA.project(np.array([[0.0, low, 0.0]]))[0, 1])
    image[rows.start : hem, points[:, 0].min() : points[:, 0].max()] = CLOTH
    if gap is not None:
        middle = int(
            CAMERA.project(body.bone_transforms[[body.bone_names.index("root")], :3, 3])[0, 0]
        )
        image[rows.start : hem, middle - gap // 2 : middle + gap // 2] = (25, 30, 60)
    column, row = np.rint(subject.face[:, :2]).astype(int).T  # type: ignore[index]
    image[row.min() : row.max(), column.min() : column.max()] = SKIN
    return dataclasses.replace(subject, image=image)


@pytest.fixture(scope="module")
def knee(body: Body) -> float:
    return float(
        np.mean(
            [
                body.bone_transforms[body.bone_names.index(f"lowerleg01{side}"), 1, 3]
                for side in (".L", ".R")
            ]
        )
    )


def test_bare_legs_come_out_of_a_skirt(body: Body, knee: float) -> None:
    found = skirt_hem(_dressed(body, knee + 0.08), body, CAMERA)
    assert found is not None
    at_rest = np.mean(
        [
            body.rest_transforms[body.bone_names.index(f"lowerleg01{side}"), 1, 3]
            for side in (".L", ".R")
        ]
    )
    assert abs(found[0] - (at_rest + 0.08)) < 0.02
    assert found[1] <= found[0]


def test_dull_skin_below_the_hem_does_not_move_it(body: Body, knee: float) -> None:
    """A shadow over one knee is nearly as far from the skin as from the cloth."""
    plain = _dressed(body, knee + 0.12)
    before = skirt_hem(plain, body, CAMERA)
    image = plain.image.copy()
    top, bottom = CAMERA.project(np.array([[0.0, knee + 0.03, 0.0], [0.0, knee - 0.12, 0.0]]))[:, 1]
    middle = int(CAMERA.project(body.bone_transforms[[0], :3, 3])[0, 0])
    image[int(top) : int(bottom), middle:] = (126, 106, 112)
    after = skirt_hem(dataclasses.replace(plain, image=image), body, CAMERA)
    assert before is not None
    assert after is not None
    assert abs(after[0] - before[0]) < 0.02


def test_shorts_trousers_and_strange_legs_are_no_skirt(body: Body, knee: float) -> None:
    assert (
        skirt_hem(_dressed(body, knee + 0.08, gap=80), body, CAMERA) is None
    )  # two legs of shorts
    assert skirt_hem(_dressed(body, knee - 0.6), body, CAMERA) is None  # trousers
    assert (
        skirt_hem(_dressed(body, knee + 0.08, below=(240, 240, 240)), body, CAMERA) is None
    )  # a long shirt over white trousers
    assert (
        skirt_hem(dataclasses.replace(_dressed(body, knee + 0.08), face=None), body, CAMERA) is None
    )


def _black(body: Body, *, noise: float = 0.0) -> Subject:
    """A person in black cloth down to the ankles, with noise of the standard deviation `noise`."""
    subject = photographed(body)
    drawn = np.random.default_rng(0).normal(12, noise, subject.image.shape)
    return dataclasses.replace(
        subject, image=drawn.clip(0, 255).astype(np.uint8), mask=np.ones_like(subject.mask)
    )


def _rest_height(body: Body, above_knee: float) -> float:
    """Height at rest, meters, of a place `above_knee` meters over the knees."""
    return above_knee + float(
        np.mean(
            [
                body.rest_transforms[body.bone_names.index(f"lowerleg01{side}"), 1, 3]
                for side in (".L", ".R")
            ]
        )
    )


def _lined(
    subject: Subject, body: Body, low: float, *, color: int = 0, tilt: float = 0.0
) -> Subject:
    """Draw a line of 1.5 cm between the legs from the hips down to the height `low`, meters, that
    moves by `tilt` meters to the side per meter down."""
    hips = body.bone_transforms[body.bone_names.index("root"), :3, 3]
    image = subject.image.copy()
    for height in np.arange(low, hips[1], 0.5 / CAMERA.scale):
        column, row = CAMERA.project(np.array([[hips[0] + tilt * (hips[1] - height), height, 0]]))[
            0
        ]
        image[int(row), int(column) - 9 : int(column) + 9] = color
    return dataclasses.replace(subject, image=image)


def test_a_dark_line_between_the_legs_is_that_of_trousers(body: Body, knee: float) -> None:
    plain = _black(body)
    plain.image[:] = 90
    ankles = _rest_height(body, -0.35)
    assert not line_between_legs(plain, body, CAMERA, ankles)
    assert line_between_legs(_lined(plain, body, knee - 0.4), body, CAMERA, ankles)
    assert line_between_legs(_lined(plain, body, knee - 0.4, tilt=0.03), body, CAMERA, ankles)
    fold = _lined(plain, body, knee)
    assert not line_between_legs(fold, body, CAMERA, ankles)
    assert line_between_legs(fold, body, CAMERA, _rest_height(body, 0.05))  # the legs of shorts
    bright = _lined(plain, body, knee - 0.4, color=150)
    assert not line_between_legs(bright, body, CAMERA, ankles)  # gloss


def test_a_gap_in_the_mask_between_the_legs_is_that_of_trousers(body: Body, knee: float) -> None:
    plain = _black(body)
    marked = _lined(plain, body, knee - 0.4, color=255).image[..., 0] == 255
    apart = dataclasses.replace(plain, mask=(~marked).astype(np.float32))
    assert line_between_legs(apart, body, CAMERA, _rest_height(body, -0.35))


def test_noise_in_black_cloth_is_no_line(body: Body) -> None:
    noisy = _black(body, noise=6.0)
    assert not line_between_legs(noisy, body, CAMERA, _rest_height(body, -0.35))
    assert not line_between_legs(noisy, body, CAMERA, _rest_height(body, 0.05))


def test_a_skirt_too_short_to_judge_has_no_line(body: Body) -> None:
    above = _rest_height(body, 1.0)
    assert not line_between_legs(_lined(_black(body), body, 0.0), body, CAMERA, above)


def test_legs_take_no_cloth_and_cloth_no_legs_around_a_hem() -> None:
    agreement = np.full((len(PARTS), 40, 40), 255, np.uint8)
    hanging, skin = np.zeros((40, 40), bool), np.zeros((40, 40), bool)
    hanging[:20], skin[18:] = True, True
    skin[24] = False  # what hung lower in the photo
    bare_legs(agreement, hanging, skin, 100.0)
    shin, torso, hand = (
        agreement[PARTS.index(name)] for name in ("left_shin", "torso", "left_hand")
    )
    assert not shin[24].any()
    assert shin[25:].all()
    assert not torso[18:20].any()
    assert torso[:18].all()
    assert hand.all()
