from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from a2v.rendering import read_video, write_video
from pipelines.outputs import write_shared


def test_a_gif_and_a_sheet_of_a_video(tmp_path: Path) -> None:
    frames = [np.full((32, 64, 3), 8 * index, np.uint8) for index in range(30)]
    write_video(tmp_path / "video.mp4", frames, 30)
    gif, sheet = write_shared(tmp_path, animation="gif", megabytes=1, sheet=True)
    assert gif.stat().st_size < 1e6
    with Image.open(gif) as made, Image.open(sheet) as picture:
        assert made.n_frames > 5
        assert picture.size == (2 * 64 + 4, 6 * (32 + 16) + 5 * 4)
    assert len(list(read_video(tmp_path / "video.mp4"))) == 30
    assert write_shared(tmp_path, animation=None, megabytes=1, sheet=False) == []
    (sheet,) = write_shared(
        tmp_path, animation=None, megabytes=1, sheet=True, caption=["camera 3.0 m away", "left arm"]
    )
    with Image.open(sheet) as picture:
        assert picture.width == 2 * 64 + 4
        assert picture.height > 6 * (32 + 16) + 5 * 4 + 10
