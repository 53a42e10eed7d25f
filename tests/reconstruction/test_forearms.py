"""Forearms without sleeves are found by their pixels, and are skin where the photo hides them."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS
from a2v.reconstruction.canonical.coloring import layout
from a2v.reconstruction.coloring.canvas import Canvas
from a2v.reconstruction.coloring.tones import bare_arms
from a2v.reconstruction.reading.arms import bare_forearms
from tests.support.subjects import blank_subject

TORSO = PARTS.index("torso")
LEFT, RIGHT = "left_lower_arm", "right_lower_arm"


def _found(left: float, right: float | None, trunk: float = 0.0) -> tuple[str, ...]:
    """The bare forearms of a picture with these shares of skin on forearms and trunk; None: the
    forearm has no pixels."""
    generator = np.random.default_rng(0)
    shown = np.full((100, 100), TORSO)
    skin = generator.random((100, 100)) < trunk
    arms = np.zeros((len(PARTS), 100, 100), bool)
    for name, share, top in ((LEFT, left, 30), (RIGHT, right, 60)):
        if share is not None:
            place = np.s_[top : top + 10, 20:80]
            arms[PARTS.index(name)][place] = True
            skin[place] = generator.random((10, 60)) < share
    return bare_forearms(blank_subject(100), arms, skin, shown)


def test_bare_forearms_look_like_skin() -> None:
    assert _found(0.95, 0.9) == (LEFT, RIGHT)
    assert _found(0.2, 0.1) == ()
    assert _found(0.9, 0.1) == (LEFT,)
    assert _found(0.9, None) == (LEFT, RIGHT)  # sleeves are equal
    assert _found(0.1, None) == ()


def test_cloth_in_the_color_of_skin_says_nothing() -> None:
    assert _found(0.95, 0.9, trunk=0.5) == ()
    assert (
        bare_forearms(
            blank_subject(100),
            np.zeros((len(PARTS), 100, 100), bool),
            None,
            np.zeros((100, 100), int),
        )
        == ()
    )


def test_only_forearms_of_which_hardly_anything_is_known_are_told_by_their_pixels() -> None:
    parts = np.repeat([PARTS.index(LEFT), PARTS.index(RIGHT), TORSO], 100)
    canvas = Canvas(
        rest=np.zeros((300, 3)),
        parts=parts,
        twin=np.arange(300),
        atlas=layout(256),
        agreement=np.zeros((len(PARTS), 1, 1), np.uint8),
        bare=(LEFT, RIGHT),
    )
    known = np.zeros(300, bool)
    known[:10] = known[100:140] = True  # a tenth of the left one, two fifths of the right one
    found = bare_arms(canvas, known)
    assert found[10:100].all()
    assert found.sum() == 90
