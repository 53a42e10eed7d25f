"""The views' names above the pictures of the video."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.rendering import read_video
from a2v.types import RenderSettings
from pipelines.engine.store import Store
from pipelines.nodes.values import Blob, Image, Poses
from pipelines.run import run


@pytest.mark.parametrize("titles", [False, True])
def test_names_stand_above_the_views(tmp_path: Path, titles: bool) -> None:
    store = Store(str(tmp_path / "store"))
    frames = np.empty((3, 2), dtype=object)
    for t, c in np.ndindex(3, 2):
        frames[t, c] = store.put(Image.of(np.full((48, 64, 3), 90 + 60 * c, np.uint8)))
    poses = store.put(Poses(bone_transforms=np.zeros((3, 1, 4, 4), np.float32), fps=10.0))
    render = RenderSettings(size=64, aspect="4:3", views=("front", "back"), titles=titles)
    outcome = run(
        "video",
        executor="serial",
        store=store,
        overrides={"frame": frames, "poses": poses},
        render=render,
    )
    path = tmp_path / "video.mp4"
    path.write_bytes(bytes(outcome.get("video", Blob)))
    shown = list(read_video(path))
    band = 16 if titles else 0
    assert len(shown) == 3
    assert shown[0].shape == (48 + band, 128, 3)
    np.testing.assert_allclose(shown[1][band + 20, [10, 100], 0], [90, 150], atol=4)
    if titles:
        assert min(shown[1][:band, :64].min(), shown[1][:band, 64:].min()) < 100  # ink over each
