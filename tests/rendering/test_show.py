"""What notebooks show: one piece of HTML that can be turned and played without a server."""

from __future__ import annotations

import dataclasses
import html
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

import a2v
from a2v import Character, InputError, Motion
from a2v.animation import deform
from a2v.motion import MotionModel
from a2v.rendering import write_video
from a2v.rendering.lighter import lighter
from a2v.rendering.show import View, stick_mesh
from tests.support.page import find_browser, opened


@pytest.fixture(scope="module")
def walk() -> Motion:
    return MotionModel.load("cmu").sample("Walk", frames=10, seed=1)


def framed(view: View) -> str:
    """Return the page inside of a notebook's output."""
    (source,) = re.findall(r'srcdoc="([^"]*)"', view._repr_html_())
    return html.unescape(source)


def test_what_is_shown_needs_nothing_else(
    character: Character, walk: Motion, tmp_path: Path
) -> None:
    moves = np.repeat(character.body.bone_transforms[None], 3, axis=0)
    write_video(tmp_path / "v.mp4", [np.zeros((16, 16, 3), np.uint8)] * 2, 10)
    walk.save(tmp_path / "walk.npz")
    for view in (
        a2v.show(character, {"stand": (moves, 10.0)}),
        a2v.show(character.surface),
        a2v.show(walk),
        a2v.show(tmp_path / "walk.npz"),
        a2v.show((tmp_path / "v.mp4").read_bytes()),
    ):
        text = framed(view)
        assert text == view.page
        assert not re.search(r"""(src|href)=["'](?!data:)""", text.split("<script>")[0])
        view.save(tmp_path / "v.html")
        assert a2v.show(tmp_path / "v.html").page == view.page
    with pytest.raises(InputError, match="cannot show int"):
        a2v.show(3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="not a binary glTF"):
        a2v.show(b"something")


def test_a_small_copy_looks_and_moves_like_the_whole(character: Character, walk: Motion) -> None:
    surface = character.surface
    uv = surface.vertices[surface.faces][..., :2] * [0.4, 0.5] + [0.5, 0.0]
    picture = np.broadcast_to(
        np.linspace(0, 255, 1024).astype(np.uint8)[:, None, None], (1024, 1024, 3)
    )  # dark above
    person = dataclasses.replace(
        character, surface=dataclasses.replace(surface, uv=uv.astype(np.float32), texture=picture)
    )
    light = lighter(person, triangles=3000, texture=256)
    assert 2000 < len(light.surface.faces) <= 3000
    assert light.surface.texture is not None
    assert light.surface.texture.shape == (256, 256, 3)
    turn = character.body.bone_transforms.copy()
    turn[:, :3, :3], turn[:, :3, 3] = turn[:, :3, :3] @ np.eye(3), turn[:, :3, 3] + [0.3, 0, 0]
    far, _ = cKDTree(deform(person, turn)).query(deform(light, turn))
    assert np.quantile(far, 0.95) < 0.02
    assert light.surface.uv is not None
    np.testing.assert_allclose(
        light.surface.uv[..., 1],
        0.5 * light.surface.vertices[light.surface.faces][..., 1],
        atol=0.01,
    )  # the same texels
    whole, small = (len(a2v.show(person, small=small).page) for small in (False, True))
    viewer = len(a2v.show(walk).page)  # a stick figure: nearly all of it is the page's own script
    assert small - viewer < (whole - viewer) / 3
    assert lighter(light, triangles=3000, texture=256).surface.vertices is light.surface.vertices


def test_a_stick_figure_has_the_motions_joints(walk: Motion) -> None:
    surface, frames = stick_mesh(walk)
    bones = len(walk.parents) - 1
    assert frames.shape == (10, 6 * bones, 3)
    np.testing.assert_allclose(frames[:, 5::6], walk.joints[:, 1:], atol=1e-6)  # tails
    assert len({tuple(color) for color in surface.colors}) == 3
    both = stick_mesh(MotionModel.load("cmu").sample("Walk", frames=10, count=2))[1]
    assert both.shape == (10, 12 * bones, 3)
    middle = frames[0].reshape(bones, 6, 3).mean(axis=1)  # faces look outwards
    corners = frames[0][surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = (normals * (corners.mean(axis=1) - np.repeat(middle, 8, axis=0))).sum(axis=1)
    assert (outwards > 0)[np.linalg.norm(normals, axis=1) > 1e-9].all()


@pytest.mark.slow
def test_a_browser_shows_it_in_a_frame(walk: Motion, tmp_path: Path) -> None:
    (tmp_path / "export.html").write_text(
        f"<body style='margin:0'>{a2v.show(walk, height=590)._repr_html_()}", encoding="utf-8"
    )
    picture = opened(find_browser(), tmp_path / "export.html", tmp_path, "")
    red, _, blue = np.moveaxis(picture, -1, 0)
    assert (red > blue + 60).sum() > 100  # the left limbs
    assert (blue > red + 50).sum() > 100  # the right ones


def test_importing_a2v_stays_light() -> None:
    code = "import sys, a2v; assert 'a2v.rendering' not in sys.modules; a2v.show; assert 'a2v.rendering.show' in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
