"""Things in hands are neither shape nor color of the person."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.reconstruction.reading.held import held_things
from a2v.types import IntArray, Subject
from tests.support.subjects import blank_subject

SCALE = 300.0
"""Pixels per meter."""
GREEN, BLUE, RED, WALL = (40, 220, 90), (40, 60, 160), (190, 40, 40), (120, 120, 125)


def _scene(bag: tuple[int, int, int], *, box: tuple[slice, slice]) -> tuple[Subject, IntArray]:
    """A person of 600 pixels with a red shirt and blue trousers; a hand at the hip, and a bag."""
    image, mask = np.full((700, 500, 3), WALL, np.uint8), np.zeros((700, 500), np.float32)
    shown = np.full((700, 500), -1)
    for part, color, place in (
        ("head", (220, 180, 150), (slice(40, 110), slice(220, 280))),
        ("torso", RED, (slice(110, 330), slice(190, 310))),
        ("right_thigh", BLUE, (slice(330, 500), slice(190, 245))),
        ("left_thigh", BLUE, (slice(330, 500), slice(255, 310))),
        ("right_shin", BLUE, (slice(500, 660), slice(190, 245))),
        ("left_shin", BLUE, (slice(500, 660), slice(255, 310))),
        ("right_hand", (220, 180, 150), (slice(320, 345), slice(170, 195))),
    ):
        image[place], shown[place], mask[place] = color, PARTS.index(part), 1.0
    image[box], mask[box] = bag, 1.0
    return dataclasses.replace(blank_subject(8), image=image, mask=mask), shown


def test_a_bag_before_a_leg_is_held() -> None:
    subject, shown = _scene(GREEN, box=(slice(345, 415), slice(140, 230)))
    held = held_things(subject, shown, SCALE)
    assert held[350:410, 145:225].mean() > 0.95
    assert held.sum() < 1.1 * 70 * 90
    assert not held[shown == PARTS.index("torso")].any()


@pytest.mark.parametrize(
    ("color", "box"),
    [
        (BLUE, (slice(345, 415), slice(140, 230))),  # of the trousers' color: their wide leg
        (GREEN, (slice(345, 415), slice(195, 225))),  # a patch on the leg, beside it nothing
        (GREEN, (slice(550, 620), slice(140, 230))),  # far from the hand
        (GREEN, (slice(345, 700), slice(0, 500))),  # a lawn
        (GREEN, (slice(325, 440), slice(165, 340))),  # a skirt
    ],
)
def test_what_is_no_thing_stays_the_persons(
    color: tuple[int, int, int], box: tuple[slice, slice]
) -> None:
    subject, shown = _scene(color, box=box)
    assert not held_things(subject, shown, SCALE).any()


def test_nothing_is_held_where_no_hand_is_seen() -> None:
    subject, shown = _scene(GREEN, box=(slice(345, 415), slice(140, 230)))
    shown[shown == PARTS.index("right_hand")] = -1
    assert not held_things(subject, shown, SCALE).any()
