"""Warped photos, and the page that shows methods side by side."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.geometry.images import sample_image
from a2v.lab.evaluation.comparison import write_comparison, write_comparison_survey
from a2v.lab.evaluation.warp import BACKGROUND, Warp
from a2v.rendering import ViewCamera
from tests.support.photographs import dressed_scene

SIZE = 96


@pytest.fixture(scope="module")
def scene():
    return dressed_scene()


def view(body, side=1.0, shift=0.0):
    """Return a nearly parallel camera, far in front of the body or behind it."""
    middle = (body.vertices.min(axis=0) + body.vertices.max(axis=0)) / 2 + np.float32([shift, 0, 0])
    height = float(np.ptp(body.vertices[:, 1]))
    away = 200.0
    origin = middle + np.float32([0, 0, side * away])
    return ViewCamera(
        origin=tuple(map(float, origin)),
        target=tuple(map(float, middle)),
        fov=float(np.degrees(2 * np.arctan(0.6 * height / away))),
    )


def test_an_unmoved_body_from_the_front_is_the_photo(scene):
    subject, body, camera = scene
    warp, front = Warp(subject, body, camera), view(body)
    picture = warp.frame(body.vertices, front, SIZE)
    shown = (picture != BACKGROUND).any(axis=-1)
    rows, columns = np.nonzero(shown)
    assert 0.03 < shown.mean() < 0.7
    # where the view's pixels lie in the photo
    height = float(np.ptp(body.vertices[:, 1]))
    meters = 1.2 * height / SIZE
    middle = (body.vertices.min(axis=0) + body.vertices.max(axis=0)) / 2
    points = np.stack(
        [
            middle[0] + (columns + 0.5 - SIZE / 2) * meters,
            middle[1] - (rows + 0.5 - SIZE / 2) * meters,
            0 * rows,
        ],
        axis=-1,
    )
    wanted = sample_image(subject.image, camera.project(points))
    assert np.median(np.abs(wanted - picture[rows, columns])) < 4


def test_what_the_photo_did_not_see_is_filled_and_the_body_carries_it(scene):
    subject, body, camera = scene
    warp = Warp(subject, body, camera)
    front, back = (
        warp.frame(body.vertices, view(body), SIZE),
        warp.frame(body.vertices, view(body, -1.0), SIZE),
    )
    covered = (back != BACKGROUND).any(axis=-1)
    assert (
        np.array_equal(covered, (front != BACKGROUND).any(axis=-1)[:, ::-1])
        or abs(covered.mean() - (front != BACKGROUND).any(axis=-1).mean()) < 0.02
    )
    moved = warp.frame(body.vertices + np.float32([0.5, 0, 0]), view(body, shift=0.5), SIZE)
    assert np.abs(moved.astype(int) - front).mean() < 1
    away = warp.frame(body.vertices + np.float32([50, 0, 0]), view(body), SIZE)
    assert (away == BACKGROUND).all()


def test_the_page_and_the_study_hold_the_films(tmp_path):
    def film(level):
        return [np.full((16, 16, 3), level + frame, np.uint8) for frame in range(4)]

    films = {
        "ours <3": {"front": film(10), "back": film(60)},
        "theirs": {"front": film(110), "back": film(160)},
    }
    page = tmp_path / "sheet.html"
    write_comparison(page, films, action="Walk", fps=10, shown=3)
    text = page.read_text()
    assert "ours &lt;3" in text
    assert len(re.findall("<video", text)) == 4
    assert len(re.findall("<img", text)) == 2 * 2 * 3
    assert "http" not in text
    key = json.loads(
        write_comparison_survey(tmp_path / "survey.html", films, action="Walk", fps=10).read_text()
    )
    assert sorted(clip["source"] for clip in key["clips"].values()) == [
        "ours <3",
        "ours <3",
        "theirs",
        "theirs",
    ]
    assert sorted(question["action"] for question in key["questions"]) == [
        "Walk, back",
        "Walk, front",
    ]


def test_films_that_do_not_fit_are_refused(tmp_path):
    frame = np.zeros((16, 16, 3), np.uint8)
    with pytest.raises(InputError, match="equal lengths and views"):
        write_comparison(
            tmp_path / "a.html",
            {"a": {"front": [frame]}, "b": {"front": [frame] * 2}},
            action="Walk",
            fps=10,
        )
    with pytest.raises(InputError, match=r"ends in \.html"):
        write_comparison(tmp_path / "a.png", {"a": {"front": [frame]}}, action="Walk", fps=10)
