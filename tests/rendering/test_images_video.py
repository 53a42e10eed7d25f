from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.rendering import (
    contact_sheet,
    probe_video,
    read_video,
    side_by_side,
    write_gif,
    write_video,
    write_webp,
    write_within,
)


def clip(frames: int = 12, height: int = 64, width: int = 96) -> list[np.ndarray]:
    """A colored square that moves over a gradient."""
    base = np.zeros((height, width, 3), np.uint8)
    base[..., 0] = np.linspace(40, 200, width).astype(np.uint8)
    base[..., 1] = 90
    pictures = []
    for index in range(frames):
        picture = base.copy()
        picture[20:40, 4 + 4 * index : 24 + 4 * index] = (230, 40, 60)
        pictures.append(picture)
    return pictures


@pytest.mark.parametrize(("height", "width"), [(64, 96), (63, 97)])
def test_video_round_trip(tmp_path: Path, height: int, width: int) -> None:
    path, pictures = tmp_path / "clip.mp4", clip(height=height, width=width)
    write_video(path, iter(pictures), 12.5)
    info = probe_video(path)
    assert (info.width, info.height) == (width + width % 2, height + height % 2)
    assert (info.frames, info.fps, info.codec, info.pixel_format) == (12, 12.5, "h264", "yuv420p")
    back = list(read_video(path))
    for index, (picture, frame) in enumerate(zip(pictures, back, strict=True)):
        error = frame[:height, :width].astype(float) - picture
        assert np.sqrt((error**2).mean()) < 8
        # flat colors survive: the matrix and the range are right
        np.testing.assert_allclose(
            frame[25:35, 14 + 4 * index].mean(axis=0), picture[30, 14 + 4 * index], atol=8
        )
    data = path.read_bytes()
    assert 0 < data.index(b"moov") < data.index(b"mdat")  # plays while it loads


def test_nothing_is_left_of_a_video_that_fails(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"

    def failing():  # type: ignore[no-untyped-def]
        yield from clip(3)
        raise RuntimeError("the renderer stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        write_video(path, failing(), 10)
    with pytest.raises(InputError, match="no frames"):
        write_video(path, [], 10)
    with pytest.raises(InputError, match="frame 1 is"):
        write_video(path, [clip(1)[0], clip(1, width=98)[0]], 10)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("fps", [0, -1, float("nan")])
def test_odd_speeds_are_named(tmp_path: Path, fps: float) -> None:
    for write, name in ((write_video, "a.mp4"), (write_gif, "a.gif"), (write_webp, "a.webp")):
        with pytest.raises(InputError, match="fps"):
            write(tmp_path / name, clip(2), fps)


def test_wrong_files_are_named(tmp_path: Path) -> None:
    (tmp_path / "text.mp4").write_text("no video")
    for path in (tmp_path / "text.mp4", tmp_path / "missing.mp4"):
        with pytest.raises(InputError, match=path.name):
            probe_video(path)
        with pytest.raises(InputError, match=path.name):
            list(read_video(path))
    with pytest.raises(InputError, match=r"\.mp4"):
        write_video(tmp_path / "clip.avi", clip(2), 10)


@pytest.mark.parametrize(("write", "name"), [(write_gif, "clip.gif"), (write_webp, "clip.webp")])
def test_animations_keep_frames_length_and_looks(tmp_path: Path, write, name: str) -> None:  # type: ignore[no-untyped-def]
    path, pictures = tmp_path / name, clip()
    write(path, pictures, 12)
    with Image.open(path) as animation:
        assert animation.n_frames == 12
        assert animation.info["loop"] == 0
        durations = []
        for index in range(12):
            animation.seek(index)
            frame = np.asarray(animation.convert("RGB")).astype(float)
            durations.append(animation.info["duration"])
            assert np.abs(frame - pictures[index]).mean() < 8
    assert sum(durations) == pytest.approx(1000, abs=5)


def test_srgb_curve() -> None:
    values = np.linspace(0, 1, 256)
    np.testing.assert_allclose(srgb_to_linear(linear_to_srgb(values)), values, atol=1e-5)
    assert float(linear_to_srgb(np.array(0.18))) == pytest.approx(0.4613, abs=1e-3)
    assert (np.diff(linear_to_srgb(values)) > 0).all()


def test_sheets_hold_every_picture() -> None:
    pictures = [np.full((10 + index, 20, 3), 40 * index, np.uint8) for index in range(5)]
    sheet = contact_sheet(pictures, rows=2, cols=3, gap=2)
    assert sheet.shape == (2 * 14 + 2, 3 * 20 + 4, 3)
    for index in range(5):
        y, x = (index // 3) * 16 + 7, (index % 3) * 22 + 10
        assert tuple(sheet[y, x]) == (40 * index,) * 3
    labeled = contact_sheet(pictures, cols=5, labels=list("abcde"))
    assert labeled.shape[0] == 14 + 16
    assert (labeled[:16].min(axis=(0, 2)) < 128).sum() >= 5  # there is ink above the pictures
    row = side_by_side(pictures[:3])
    assert row.shape == (12, 60, 3)
    with pytest.raises(InputError, match="fit"):
        contact_sheet(pictures, rows=1, cols=2)
    with pytest.raises(InputError, match="no picture"):
        contact_sheet([])
    with pytest.raises(InputError, match="uint8"):
        side_by_side([np.zeros((4, 4, 3))])


@pytest.mark.parametrize("name", ["a.gif", "a.webp"])
def test_animations_fit_what_they_are_given_and_keep_their_length(
    tmp_path: Path, name: str
) -> None:
    draw = np.random.default_rng(0)
    noisy = [
        (picture // 2 + draw.integers(0, 128, picture.shape)).astype(np.uint8)
        for picture in clip(24)
    ]
    write_within(tmp_path / name, noisy, 12, megabytes=10)
    whole = (tmp_path / name).stat().st_size
    write_within(tmp_path / name, noisy, 12, megabytes=whole / 5e6)
    assert (tmp_path / name).stat().st_size <= whole / 5
    with Image.open(tmp_path / name) as animation:
        assert animation.width < 96
        durations = []
        for index in range(animation.n_frames):
            animation.seek(index)
            animation.load()
            durations.append(animation.info["duration"])
    assert sum(durations) == pytest.approx(2000, abs=15)
    before = (tmp_path / name).read_bytes()
    with pytest.raises(InputError, match="do not fit"):
        write_within(tmp_path / name, noisy, 12, megabytes=1e-6)
    assert (tmp_path / name).read_bytes() == before
    with pytest.raises(InputError, match="neither"):
        write_within(tmp_path / "a.mp4", noisy, 12, megabytes=1)
