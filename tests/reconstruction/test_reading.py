"""A reading of a photo: stored and drawn, and found by a list of readers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from a2v.body.parts import PARTS
from a2v.reconstruction.reading import READERS, HairSeen, Reading, ReadingSettings
from a2v.reconstruction.reading.draw import draw_reading, facts_of
from a2v.reconstruction.reading.record import ARMS

SIZE = (60, 40)


def reading() -> Reading:
    """A trunk with a left hand, skin, a held thing and long hair."""
    shown = np.full(SIZE, -1, np.int8)
    shown[20:40, 10:30] = PARTS.index("torso")
    arms = np.zeros(SIZE, np.uint8)
    arms[30:36, 24:34] = 1 << ARMS.index("left_hand")
    skin = np.zeros(SIZE, bool)
    skin[30:36, 20:30] = True
    taken = np.zeros(SIZE, bool)
    taken[36:39, 12:16] = True
    hair = np.zeros((2 * SIZE[0], 2 * SIZE[1]), bool)
    hair[20:40, 30:40] = True
    return Reading(
        shown=shown,
        found_arms=arms,
        better=np.zeros(len(PARTS), bool),
        taken=taken,
        skin=skin,
        hands=np.array([0.8, 0.6, 0.5]),
        bare_forearms=("left_lower_arm",),
        hangs=True,
        hem=np.array([0.5, 0.45]),
        hair=HairSeen(pixels=hair, like_cloth=False, free=True),
    )


def test_a_reading_is_what_was_stored(tmp_path: Path) -> None:
    made = reading()
    made.save(tmp_path / "reading.npz")
    again = Reading.load(tmp_path / "reading.npz")
    assert again.to_bytes() == made.to_bytes()
    assert again.gloves is None
    assert again.bare_forearms == ("left_lower_arm",)
    assert again.hair is not None
    assert again.hair.at(np.array([[35.0, 25.0], [5.0, 5.0]])).tolist() == [True, False]


def test_arms_are_those_of_their_bits() -> None:
    arms = reading().arms
    assert arms[PARTS.index("left_hand")].sum() == 60
    assert not np.delete(arms, PARTS.index("left_hand"), axis=0).any()


def test_a_drawing_shows_what_was_found_and_says_the_facts() -> None:
    made = reading()
    picture = draw_reading(made)
    assert picture.shape[0] > SIZE[0]
    places = {
        "room": picture[5, 5],
        "trunk": picture[25, 12],
        "skin": picture[32, 22],
        "taken": picture[37, 13],
        "hair": picture[15, 17],
    }
    assert len({tuple(color) for color in places.values()}) == len(places)
    facts = " ".join(facts_of(made))
    assert "hem at 50 cm" in facts
    assert "gloves: no" in facts
    assert "left_lower_arm" in facts


def test_readers_can_be_left_out_one_by_one() -> None:
    names = [reader.__name__ for reader in READERS]
    for name in names[1:]:
        assert [one.__name__ for one in ReadingSettings(without=name).readers] == [
            other for other in names if other != name
        ]
