from __future__ import annotations

from pathlib import Path

import numpy as np

from a2v.rendering import read_video, write_video
from pipelines.engine.progress import Pace
from pipelines.outputs import write_shared


def test_time_left_leaves_out_the_start_and_is_right_from_the_tenth_frame_on() -> None:
    """Two workers that take 6 s to start and then about .4 s a frame."""
    draw = np.random.default_rng(3)
    ends = np.sort(np.concatenate([6 + np.cumsum(draw.normal(0.4, 0.04, 150)) for _ in range(2)]))
    pace, worst = Pace(), 0.0
    for done, now in enumerate(ends, 1):
        left = pace.left(done, len(ends), now)
        if done <= 4:
            assert left is None
        elif 10 <= done < len(ends) - 10:
            worst = max(worst, abs(left / (ends[-1] - now) - 1))
    assert worst < 0.2
    assert pace.left(300, 300, ends[-1] + 1) == 0


def test_a_gif_and_a_sheet_of_a_video(tmp_path: Path) -> None:
    from PIL import Image

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
