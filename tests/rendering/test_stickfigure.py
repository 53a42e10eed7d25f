"""Stick figures are upright and to scale, distinguish left and right, and have all frames."""

from __future__ import annotations

import dataclasses
import io

import numpy as np
import pytest
from PIL import Image

from a2v.errors import InputError
from a2v.kinematics import CMU, HUMANACT12
from a2v.rendering import probe_video
from a2v.rendering.stickfigure import (
    StickSettings,
    animate,
    plot_path,
    plot_rows,
    project,
    save_stick_figures,
)
from tests.support.motions import person

FRONT = StickSettings(size=200, azimuth=0, elevation=0)
SIDE = StickSettings(size=200, azimuth=90, elevation=0)


def pixels(image, color):
    """Rows and columns (N, 2) of pixels near a color."""
    rgb = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)])
    return np.argwhere(np.abs(image.astype(int) - rgb).max(-1) < 12)


def drawn(figure):
    stream = io.BytesIO()
    figure.savefig(stream, dpi=100, format="png")
    return np.asarray(Image.open(stream).convert("RGB"))


def test_the_view_is_a_rotation_with_the_camera_where_it_says():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(20, 3))
    for azimuth, elevation in ((0, 0), (30, 15), (-120, 60)):
        seen = project(points, azimuth, elevation)
        assert np.allclose(np.linalg.norm(seen, axis=1), np.linalg.norm(points, axis=1))
        basis = project(np.eye(3), azimuth, elevation)
        assert np.linalg.det(basis) == pytest.approx(1)
    assert np.allclose(project(points, 0, 0), points)
    assert np.allclose(
        project(np.array([1.0, 0, 0]), 90, 0), [0, 0, 1], atol=1e-12
    )  # from the person's left
    assert np.allclose(project(np.array([0, 1.0, 0]), 0, 90), [0, 0, 1], atol=1e-12)  # from above


@pytest.mark.parametrize("skeleton", [CMU, HUMANACT12])
def test_left_is_red_on_the_viewers_right_and_up_is_up(skeleton):
    frame = next(animate(person(skeleton), settings=FRONT))
    left, right, head = (pixels(frame, color) for color in (FRONT.left, FRONT.right, FRONT.middle))
    assert min(len(left), len(right), len(head)) > 50
    assert left[:, 1].mean() > right[:, 1].mean() + 20
    assert head[:, 0].min() < left[:, 0].mean()
    behind = next(animate(person(skeleton), settings=dataclasses.replace(FRONT, azimuth=180)))
    assert pixels(behind, FRONT.left)[:, 1].mean() < pixels(behind, FRONT.right)[:, 1].mean() - 20


def test_axes_are_equal():
    motion = person()
    span = np.ptp(motion.joints[0], axis=0)
    frame = next(
        animate(motion, settings=dataclasses.replace(FRONT, size=600, bone=0.02, head=0.001))
    )
    seen = np.concatenate(
        [pixels(frame, color) for color in (FRONT.left, FRONT.right, FRONT.middle)]
    )
    high, wide = np.ptp(seen, axis=0)
    assert wide / high == pytest.approx(span[0] / span[1], rel=0.05)


def test_shadow_and_path_lie_on_the_ground_below_a_jumper():
    high = person(height=0.6)
    frame = next(animate(high, settings=dataclasses.replace(FRONT, elevation=20)))
    shadow, body = pixels(frame, "#c9c9c4"), pixels(frame, FRONT.left)
    assert len(shadow) > 20
    assert (
        np.quantile(shadow[:, 0], 0.1) > body[:, 0].max()
    )  # (a few pixels of the head's edge are of that gray)


def test_the_figure_moves_and_the_path_grows():
    motion = person(frames=8, step=0.25)
    frames = list(animate(motion, settings=dataclasses.replace(FRONT, azimuth=90, elevation=20)))
    assert len(frames) == 8
    assert frames[0].shape == (200, 200, 3)
    assert frames[0].dtype == np.uint8
    columns = [pixels(frame, FRONT.middle)[:, 1].mean() for frame in frames]
    assert (np.diff(columns) < -3).all()  # +z is to the left, seen from the person's left
    assert len(pixels(frames[-1], "#3a9d5d")) > len(pixels(frames[2], "#3a9d5d")) > 0


def test_the_camera_follows_a_long_walk():
    frames = list(
        animate(person(frames=60, step=0.2), settings=dataclasses.replace(FRONT, azimuth=90))
    )
    columns = np.array([pixels(frame, FRONT.middle)[:, 1].mean() for frame in frames])
    assert np.ptp(columns) < 80
    assert (
        min(len(pixels(frame, FRONT.left)) for frame in frames) > 100
    )  # large, not a dot on a long path


def test_grids_hold_the_last_pose_and_have_titles():
    clips = [person(frames=3), person(frames=6)]
    frames = list(animate(clips, titles=["one", "two"], settings=SIDE))
    assert len(frames) == 6
    assert frames[0].shape[1] == 400
    assert frames[0].shape[0] > 200
    assert np.array_equal(frames[3][:, :200], frames[5][:, :200])
    assert not np.array_equal(frames[3][:, 200:], frames[5][:, 200:])


def test_rows_show_each_clip_and_pale_given_poses():
    batch = [person(frames=9), person(HUMANACT12, frames=5)]
    image = drawn(plot_rows(batch, poses=4, titles=["a", "b"], settings=FRONT))
    assert 400 <= image.shape[0] <= 440
    strong = [len(pixels(part, FRONT.left)) for part in np.array_split(image[:400], 2)]
    assert min(strong) > 100
    paler = drawn(plot_rows(batch, poses=4, titles=["a", "b"], given=4, settings=FRONT))
    assert len(pixels(paler, FRONT.left)) < 0.8 * len(pixels(image, FRONT.left))


def test_a_path_is_drawn():
    image = drawn(plot_path(person(frames=30, step=0.08), settings=StickSettings(), title="walk"))
    assert len(pixels(image, "#3a9d5d")) > 50
    assert len(pixels(image, StickSettings().left)) > 50


def test_notebooks_show_figures_without_pyplot():
    figure = plot_rows(person(), poses=2, settings=FRONT)
    shown = np.asarray(Image.open(io.BytesIO(figure._repr_png_())).convert("RGB"))
    assert np.array_equal(shown, drawn(figure))


@pytest.mark.parametrize("suffix", [".png", ".svg", ".gif", ".webp", ".mp4"])
def test_files_by_suffix(tmp_path, suffix):
    path = tmp_path / f"walk{suffix}"
    save_stick_figures(path, person(frames=5), settings=SIDE)
    assert [item.name for item in tmp_path.iterdir()] == [path.name]
    if suffix == ".mp4":
        info = probe_video(path)
        assert (info.width, info.height, info.frames, info.fps) == (200, 200, 5, 10)
    elif suffix in (".gif", ".webp"):
        assert Image.open(path).n_frames == 5
    elif suffix == ".png":
        assert Image.open(path).size[0] > 400


def test_what_cannot_be_drawn_is_explained(tmp_path):
    motion = person()
    for words, call in (
        ("no motion", lambda: animate([])),
        ("2 titles for 1", lambda: animate(motion, titles=["a", "b"])),
        ("at most 64", lambda: animate([motion] * 65)),
        ("frames per second", lambda: animate([motion, dataclasses.replace(motion, fps=20)])),
        ("0 poses", lambda: plot_rows(motion, poses=0)),
        (
            "one clip",
            lambda: plot_path(
                dataclasses.replace(
                    motion,
                    joints=motion.joints[None],
                    rotations=motion.rotations[None],
                    root=motion.root[None],
                )
            ),
        ),
        ("size is 5", lambda: StickSettings(size=5)),
        ("ends in", lambda: save_stick_figures(tmp_path / "x.bmp", motion)),
    ):
        with pytest.raises(InputError, match=words):
            call()
    assert not list(tmp_path.iterdir())
