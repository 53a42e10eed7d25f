"""The page in one file, opened by a real browser without a server."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from a2v import Character, InputError, Surface
from a2v.animation import bind, deform
from a2v.body import load_body_model, make_body
from a2v.formats.gltf import write_glb
from a2v.geometry.mesh import vertex_normals
from a2v.rendering import write_page, write_video
from a2v.rendering.page import viewer_script
from tests.support.page import find_browser, opened


@pytest.fixture(scope="module")
def browser() -> str:
    return find_browser()


@pytest.fixture(scope="module")
def character() -> Character:
    """A character that is red in front and blue behind: the color shows the visible side."""
    body = make_body(load_body_model(), grounded=True)
    normals = vertex_normals(body.vertices.astype(np.float64), body.faces.astype(np.int64))
    colors = np.where(normals[:, 2:] > 0, (0.8, 0.1, 0.1), (0.1, 0.1, 0.8))
    vertices = (body.vertices + 0.005 * normals).astype(np.float32)
    return bind(
        Surface(vertices=vertices, faces=body.faces, colors=colors.astype(np.float32)), body
    )


@pytest.fixture(scope="module")
def page(character: Character, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page whose two clips lift the body: `low` for a second, `high` by a meter."""
    folder = tmp_path_factory.mktemp("page")
    moves = np.repeat(character.body.bone_transforms[None], 11, axis=0)
    high = moves.copy()
    high[:, :, 1, 3] += np.linspace(0, 1, 11)[:, None]
    write_glb(folder / "c.glb", character, {"low": (moves, 10.0), "high": (high, 10.0)})
    write_video(folder / "v.mp4", [np.full((64, 64, 3), (20, 200, 20), np.uint8)] * 11, 10.0)
    write_page(folder / "preview.html", folder / "c.glb", folder / "v.mp4", title="up <&> down")
    return folder / "preview.html"


def share(picture: np.ndarray, channel: int) -> tuple[float, float]:
    """Share of the character's half that is colored in `channel`, and its mean row."""
    half = picture[:, :480]
    others = np.delete(half, channel, axis=2).max(axis=2)
    mask = half[..., channel] > others + 40
    rows = np.flatnonzero(mask.any(axis=1))
    return float(mask.mean()), float(rows.mean()) if len(rows) else np.nan


@pytest.mark.slow
def test_a_browser_shows_the_character_from_the_asked_side_at_the_asked_moment(
    browser: str, page: Path, tmp_path: Path
) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    front = opened(browser, page, tmp_path / "a", "azimuth=0&elevation=0&time=0&clip=1")
    back = opened(browser, page, tmp_path / "b", "azimuth=180&elevation=0&time=1&clip=1")
    (red, low), (blue, _) = share(front, 0), share(front, 2)
    assert red > 0.02
    assert blue < 0.2 * red
    (red, _), (blue, high) = share(back, 0), share(back, 2)
    assert blue > 0.02
    assert red < 0.2 * blue
    assert high < low - 30  # the clip's last moment is a meter higher
    assert (
        (front[..., 1] > front[..., 0] + 80) & (front[..., 1] > front[..., 2] + 80)
    ).mean() > 0.05  # the video, green


def test_the_page_is_alone_and_reaches_for_nothing(page: Path) -> None:
    text = page.read_text()
    assert "<title>up &lt;&amp;&gt; down</title>" in text
    assert "Content-Security-Policy\" content=\"default-src 'none'" in text
    own = text.replace(viewer_script(), "")
    assert not re.search(r"https?://|//cdn|(src|href)=\"(?!data:)", own)
    assert "SPDX-License-Identifier: MIT" in text  # three.js' notice goes along
    assert [path.name for path in page.parent.glob(".*")] == []


def test_what_is_no_glb_or_mp4_is_refused(tmp_path: Path, page: Path) -> None:
    glb = (page.parent / "c.glb").read_bytes()
    with pytest.raises(InputError, match="binary glTF"):
        write_page(tmp_path / "p.html", b"solid")
    with pytest.raises(InputError, match="MP4"):
        write_page(tmp_path / "p.html", glb, b"GIF89a..")
    with pytest.raises(InputError, match=r"nothing\.glb"):
        write_page(tmp_path / "p.html", tmp_path / "nothing.glb")
    assert list(tmp_path.iterdir()) == []


def test_the_glb_moves_as_the_page_is_told(character: Character) -> None:
    """The browser's picture shows the same lift as our frames."""
    up = character.body.bone_transforms.copy()
    up[:, 1, 3] += 1
    np.testing.assert_allclose(
        deform(character, up) - character.surface.vertices,
        np.tile((0, 1, 0), (len(character.parts), 1)),
        atol=1e-5,
    )
