"""Skirts on legs that are together: where they end, and what is not a skirt."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body.parts import PARTS, on_parts
from a2v.reconstruction.canonical.hem import shadow_between_legs, skirt_hem
from a2v.reconstruction.canvas import bare_legs
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


def test_trousers_have_a_shadow_between_the_legs_and_skirts_have_none(
    body: Body, knee: float
) -> None:
    assert shadow_between_legs(_dressed(body, knee - 0.6, gap=60), body, CAMERA)
    assert not shadow_between_legs(_dressed(body, knee - 0.6), body, CAMERA)
    assert not shadow_between_legs(_dressed(body, knee - 0.6, gap=8), body, CAMERA)  # a fold


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
