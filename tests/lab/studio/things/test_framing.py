"""The visible part of a person in a picture."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.lab.studio.things.framing import Square, share_left, unhidden
from a2v.lab.studio.things.solids import box


def test_half_of_the_pictures_are_framed_by_what_is_seen() -> None:
    seen = np.stack(
        np.meshgrid(np.linspace(-0.3, 0.3, 9), np.linspace(0, 1.7, 60), [0.0]), axis=-1
    ).reshape(-1, 3)
    table, wall = box(3, 1.2, 0.1).moved([0, 0, 1.0]), box(3, 5, 0.1).moved([0, 0, 1.0])
    low = [unhidden(seen, table, np.random.default_rng(seed))[:, 1].min() for seed in range(60)]
    assert set(np.round(low, 1)) == {0.0, 0.6}
    assert 0.3 < np.mean(np.array(low) > 0.5) < 0.7
    assert all(
        len(unhidden(seen, wall, np.random.default_rng(seed))) == len(seen) for seed in range(6)
    )


def test_a_square_is_drawn_around_somebody_and_may_cut_them() -> None:
    person = box(0.6, 1.8, 0.3).moved([0.1, 0.9, 0])
    square = Square.around(person.vertices, 0.9)
    assert square.side == pytest.approx(2.0)
    assert square.middle == pytest.approx([0.1, 0.9])
    assert share_left(person.vertices, person.faces, None, square) == 1
    cut = [square.cut(np.random.default_rng(seed)) for seed in range(20)]
    assert all(1.3 < one.side < 1.9 for one in cut)
    left = [share_left(person.vertices, person.faces, None, one) for one in cut]
    assert 0.4 < min(left) < max(left) <= 1


def test_what_a_thing_before_somebody_leaves() -> None:
    person, table = box(0.6, 1.8, 0.3).moved([0, 0.9, 0]), box(3, 0.9, 0.1).moved([0, 0.45, 1.0])
    square = Square.around(person.vertices, 0.9)
    assert share_left(person.vertices, person.faces, table, square) == pytest.approx(0.5, abs=0.02)
    assert share_left(person.vertices, person.faces, table.moved([0, 0, -2]), square) == 1  # behind
