"""The floor of the photo's place, and paths that stay on it."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.rendering.camera import ViewCamera
from a2v.rendering.room import Spot, find_detour, find_floor, ground_under, standing_room
from a2v.types import BoolArray, ByteArray, FloatArray

CAMERA = ViewCamera(origin=(0.2, 1.5, 3.5), target=(0.0, 0.9, 0.0), fov=55)
SIDE = 160
WALL = -1.2
"""z of a wall, meters."""


def picture() -> tuple[ByteArray, BoolArray]:
    """A brown floor, a white wall behind z = -1.2, a green box, and the floor's mask."""
    ground, below = ground_under(CAMERA, SIDE)
    floor = below & (ground[..., 1] > WALL)
    box = floor & (ground[..., 0] > 0.9) & (ground[..., 1] < -0.3)
    colors = np.where(floor[..., None], np.array([130, 95, 60]), np.array([225, 222, 215]))
    colors = np.where(box[..., None], np.array([60, 150, 70]), colors)
    grain = np.random.default_rng(0).normal(0, 3, (SIDE, SIDE, 1))
    return np.clip(colors + grain, 0, 255).astype(np.uint8), floor & ~box


def walk(angle: float, seconds: float = 5.0, fps: float = 30.0) -> FloatArray:
    """Roots (T, 2) of somebody who goes straight on at 1.2 m/s."""
    way = np.arange(round(seconds * fps))[:, None] * 1.2 / fps
    return np.asarray(way * np.array([np.sin(angle), np.cos(angle)]))


def test_ground_is_where_the_camera_sees_it() -> None:
    ground, below = ground_under(CAMERA, SIDE)
    points = np.stack([ground[..., 0], np.zeros(below.shape), ground[..., 1]], axis=-1)[below]
    rows, columns = np.nonzero(below)
    np.testing.assert_allclose(
        CAMERA.project(points, SIDE), np.stack([columns, rows], axis=1) + 0.5, atol=1e-6
    )


def test_the_floor_ends_at_the_wall_and_at_things() -> None:
    shown, truth = picture()
    found = find_floor(shown, CAMERA, np.zeros(2))
    assert (found & truth).sum() / (found | truth).sum() > 0.9


@pytest.mark.parametrize("angle", [0.0, 1.5, 3.1, 4.6])
@pytest.mark.parametrize("entering", [True, False])
def test_a_way_stays_on_the_floor_and_in_the_picture(angle: float, entering: bool) -> None:
    shown, _ = picture()
    allowed = standing_room(
        find_floor(shown, CAMERA, np.zeros(2)), CAMERA, (0, 0, SIDE, SIDE), SIDE, 1.5
    )
    roots = walk(angle)
    assert allowed(roots).mean() < 0.7
    found = find_detour(roots, allowed, fps=30, entering=entering)
    assert found.share >= 0.95
    np.testing.assert_allclose(found.places[0], roots[0])
    if entering:
        assert found.turns[0] == 0
    walked = np.linalg.norm(np.diff(found.places, axis=0), axis=1).sum()
    assert walked > 0.9 * 1.2 * 5  # bent, not shortened


def test_a_way_that_fits_stays_as_it_is() -> None:
    roots = walk(0.7, seconds=1.0)
    found = find_detour(roots, lambda places: np.ones(len(places), bool), fps=30, entering=False)
    np.testing.assert_allclose(found.places, roots, atol=1e-9)
    assert not found.turns.any()


def test_a_body_turns_as_its_way_does() -> None:
    roots = walk(0.0)
    found = find_detour(
        roots, lambda places: np.linalg.norm(places, axis=1) < 1.0, fps=30, entering=False
    )
    last = found.spots[-1]
    ahead = np.array([[roots[-1][0], 1.0, roots[-1][1]], [roots[-1][0], 1.0, roots[-1][1] + 0.5]])
    moved = last.moved(ahead)
    way = found.places[-1] - found.places[-3]
    facing = (moved[1] - moved[0])[[0, 2]]
    assert facing @ way / np.linalg.norm(facing) / np.linalg.norm(way) > 0.98
    assert np.linalg.norm(moved[0, [0, 2]] - found.places[-1]) < 1e-5
    assert isinstance(last, Spot)
