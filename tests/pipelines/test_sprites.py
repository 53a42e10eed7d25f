"""Sprites: cut alike, in rows of directions, with a description that finds each again."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.rendering import read_cameras
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import PersonRequest
from pipelines.requests.video import VideoRequest
from pipelines.sprites import MAX_SIDE, seen_around, sprite_sheet

VIEWS = [f"dir{number:02d}" for number in range(8)]


def frames() -> np.ndarray:
    """Three frames from eight directions, a patch each of a color of its own."""
    made = np.zeros((3, 8, 40, 30, 4), np.uint8)
    for frame in range(3):
        for view in range(8):
            made[frame, view, 5 + frame : 35, 8 : 20 + frame] = (10 * frame, 20 * view, 99, 255)
    return made


def test_every_sprite_is_where_the_description_says() -> None:
    given = frames()
    sheet, facts = sprite_sheet(given, VIEWS, 12.0)
    assert sheet.shape == (8 * 30, 3 * 14, 4)
    assert facts["meta"]["size"] == {"w": 42, "h": 240}
    assert len(facts["frames"]) == 24
    for view, name in enumerate(VIEWS):
        for frame in range(3):
            entry = facts["frames"][f"{name}_{frame:04d}"]
            place, cut = entry["frame"], entry["spriteSourceSize"]
            found = sheet[
                place["y"] : place["y"] + place["h"], place["x"] : place["x"] + place["w"]
            ]
            wanted = given[
                frame, view, cut["y"] : cut["y"] + cut["h"], cut["x"] : cut["x"] + cut["w"]
            ]
            np.testing.assert_array_equal(found, wanted)
            assert entry["duration"] == pytest.approx(1000 / 12, abs=1e-3)
            assert entry["pivot"]["x"] * cut["w"] + cut["x"] == pytest.approx(15)
    assert [tag["to"] for tag in facts["meta"]["frameTags"]][-1] == 23


def test_an_empty_and_a_too_large_sheet() -> None:
    sheet, _ = sprite_sheet(np.zeros((1, 2, 4, 4, 4), np.uint8), VIEWS[:2], 10.0)
    assert sheet.shape == (8, 4, 4)
    large = np.broadcast_to(np.uint8(255), (MAX_SIDE // 4, 1, 2, 5, 4))
    with pytest.raises(InputError, match="fewer --frames"):
        sprite_sheet(large, VIEWS[:1], 10.0)


def test_cameras_stand_around() -> None:
    request = VideoRequest(
        person=PersonRequest(photo="a.jpg"), motion=MotionRequest(action="Walk"), film=FilmRequest()
    )
    film = seen_around(request, 8).film
    assert film.background == "transparent"
    cameras = read_cameras(film.camera)
    assert [camera.azimuth for camera in cameras] == [45.0 * number for number in range(8)]
    assert all(camera.follow for camera in cameras)
    with pytest.raises(InputError, match="expected one of"):
        seen_around(request, 7)
    for changed in (FilmRequest(views="front"), FilmRequest(background="photo")):
        other = VideoRequest(person=request.person, motion=request.motion, film=changed)
        with pytest.raises(InputError, match="views of its own"):
            seen_around(other, 8)
