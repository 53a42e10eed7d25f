"""Studio films: the ground truth matches the pictures."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.lab.evaluation.films import SHOTS, FilmScore, film_tables
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.film import CAMERAS, FilmSettings, camera_path, shoot
from a2v.lab.studio.variation import split_of
from a2v.motion import MotionModel


@pytest.mark.parametrize("camera", CAMERAS)
def test_whoever_walks_stays_in_the_picture(camera):
    hips = np.stack([np.linspace(0, 2, 60), np.full(60, 0.9), np.linspace(0, 1, 60)], axis=1)
    settings = FilmSettings(camera=camera, yaw=30.0, seed=2)
    path = camera_path(hips, 30.0, settings)
    assert np.allclose(path.axes @ np.swapaxes(path.axes, 1, 2), np.eye(3), atol=1e-9)
    for extent in ([0, 0.8, 0], [0, -0.9, 0]):
        local = np.einsum("tab,tb->ta", path.axes, hips + extent - path.places)
        pixels = path.focal * local[:, :2] / local[:, 2:]
        assert (local[:, 2] > 1).all()
        assert (np.abs(pixels) < np.array([settings.width, settings.height]) / 2).all()


def test_the_picture_shows_the_person_where_the_truth_has_them(data_dir):
    avatar = load_avatar(data_dir / "avatars" / "Asian_F_2_Casual.glb")
    motion = MotionModel.load("cmu-fine").sample("Walk", frames=4, seed=1)
    film = shoot(avatar, motion, FilmSettings(width=160, height=120, seed=1))
    image = next(film.frames()).astype(float)
    local = np.stack(
        [(points[0] - film.path.places[0]) @ film.path.axes[0].T for points in film.joints.values()]
    )
    pixels = film.path.focal * local[:, :2] / local[:, 2:] * [1, -1] + [80, 60]
    assert ((pixels > 0) & (pixels < [160, 120])).all()
    far = dataclasses.replace(
        film,
        transforms=film.transforms
        + np.array([[0, 0, 0, 40.0], [0] * 4, [0] * 4, [0] * 4], np.float32),
    )
    changed = np.abs(image - next(far.frames())).max(axis=-1) > 25
    chest = (
        pixels[
            [
                list(film.joints).index(name)
                for name in ("left_hip", "right_hip", "left_shoulder", "right_shoulder")
            ]
        ]
        .mean(axis=0)
        .astype(int)
    )
    assert changed[chest[1] - 2 : chest[1] + 3, chest[0] - 2 : chest[0] + 3].mean() > 0.8
    assert changed.mean() < 0.25


def test_nobody_of_the_panel_is_in_training():
    assert len(SHOTS) == 20
    assert {split_of(shot.person) for shot in SHOTS} == {"validation"}
    assert {shot.camera for shot in SHOTS} == set(CAMERAS)


def test_tables_have_the_means():
    one = FilmScore(
        "a",
        "walk",
        "still",
        100,
        1,
        6.0,
        12.0,
        5.0,
        7.0,
        20.0,
        8.0,
        10.0,
        1.0,
        5.0,
        100.0,
        6.0,
        8.0,
    )
    text = "\n".join(film_tables([one, dataclasses.replace(one, name="b", error=8.0)]))
    assert "| walk | 2 | 100 | 7.0 |" in text


def test_a_camera_that_is_none():
    with pytest.raises(InputError, match="camera is 'drone'"):
        FilmSettings(camera="drone")
