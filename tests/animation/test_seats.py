"""Seats under people who sit."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.animation import retarget
from a2v.animation.rig import place, rig_of
from a2v.animation.seats import find_seats
from a2v.motion.clips import play_clip
from a2v.props import Props
from a2v.types import Body


def moves_of(action: str, body: Body) -> np.ndarray:
    return retarget(play_clip(action, frames=75, fps=30), body)


@pytest.mark.parametrize("action", ["Sit", "Sit down", "Sit and talk"])
def test_who_sits_has_a_seat_at_the_height_of_the_pelvis(action: str, body: Body) -> None:
    moves = moves_of(action, body)
    props = Props.of(find_seats(moves, body, 30))
    assert props.names.count("seat_1") == 1
    assert "leg_4" in props.names
    seat = props.vertices[np.unique(props.faces[props.owner == props.names.index("seat_1")])]
    assert 0.3 < seat[:, 1].max() < 0.65
    skin = place(rig_of(body).skin, moves[-1:].astype(np.float64))[0]
    over = (np.abs(skin - seat.mean(axis=0))[:, [0, 2]] < 0.15).all(axis=1)
    lowest = skin[over, 1].min()
    assert abs(lowest - seat[:, 1].max()) < 0.05  # the seat is where the person rests


@pytest.mark.parametrize("action", ["Idle", "Squat", "Crouch", "Sit on the floor", "Wave"])
def test_nobody_else_has_one(action: str, body: Body) -> None:
    assert find_seats(moves_of(action, body), body, 30) == []
