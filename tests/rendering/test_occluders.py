"""Objects of a place, in front of a person or behind."""

from __future__ import annotations

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.occluders import behind_things, find_things
from a2v.rendering.room import find_floor, ground_under
from a2v.types import BoolArray, ByteArray, IntArray

CAMERA = ViewCamera(origin=(0.0, 1.5, 4.0), target=(0.0, 0.9, 0.0), fov=55)
SIDE = 160


def place() -> tuple[ByteArray, IntArray, BoolArray]:
    """A wall, a floor and a box with a lid: its regions, and the place of the box.

    The box stands a meter in front of the origin, to the right.
    """
    ground, below = ground_under(CAMERA, SIDE)
    rows, columns = np.indices((SIDE, SIDE))
    regions = np.where(below & (ground[..., 1] > -1.5), 1, 0)
    foot = int(CAMERA.project(np.array([[0.0, 0.0, 1.0]]), SIDE)[0, 1])
    box = (np.abs(columns - SIDE / 2 - 18) < 14) & (rows < foot) & (rows > foot - 26)
    regions[box] = 2
    regions[box & (rows < foot - 20)] = 3
    colors = np.array([[220, 220, 210], [120, 90, 60], [60, 60, 160], [90, 90, 200]], np.uint8)
    return colors[regions], regions, box


def test_a_thing_hides_who_is_behind_it_and_nobody_in_front() -> None:
    picture, regions, box = place()
    floor = find_floor(picture, CAMERA, np.zeros(2), regions)
    assert not floor[box].any()
    things = find_things(floor, regions, CAMERA)
    assert np.abs(things[box] - 3.0).max() < 0.15  # lid and front stand a meter in front of it
    assert things[5, 5] > 5.0  # the wall
    red = np.full_like(picture, (255, 0, 0))
    behind = behind_things(red, picture, things, distance=4.0)
    inner = np.zeros_like(box)
    inner[2:-2, 2:-2] = box[4:, 2:-2] & box[:-4, 2:-2] & box[2:-2, 4:] & box[2:-2, :-4]
    np.testing.assert_array_equal(behind[inner], picture[inner])
    far = np.abs(np.indices(box.shape)[1] - SIDE / 2 - 18) > 18
    np.testing.assert_array_equal(behind[far], red[far])
    np.testing.assert_array_equal(behind_things(red, picture, things, distance=2.5), red)


def test_the_thing_is_drawn_at_the_size_of_the_frame() -> None:
    picture, regions, box = place()
    things = find_things(find_floor(picture, CAMERA, np.zeros(2), regions), regions, CAMERA)
    large = np.full((2 * SIDE, 2 * SIDE, 3), 255, np.uint8)
    shown = behind_things(large, picture, things, distance=4.0)
    assert (shown != 255).any(axis=-1).sum() > 3.0 * box.sum()
