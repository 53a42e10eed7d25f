"""A folder of videos becomes the actions of a custom model, which works beside shipped ones."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.lab.datasets.bvh_folder import BVHFolderSettings, load_bvh_folder
from a2v.motion import MotionModel
from pipelines.cli import main
from pipelines.commands.follow import videos_below
from tests.support.flows import export_one_step
from tests.support.footage import picture, write_clip

QUICK = ("--follow.face", "false", "--follow.steps", "10", "--workers", "1", "--quiet")


def tiny_flow(data: Path, out: Path) -> Path:
    """Train a flow for two iterations."""
    sizes = {"iterations": 2, "code-size": 8, "width": 8, "pool": 50, "threads": 1}
    options = [part for name, size in sizes.items() for part in (f"--flow.{name}", str(size))]
    command = ["train", "flow", "--dataset", "bvh", "--data", str(data), "--out", str(out)]
    assert main([*command, "--license", "none", "--bvh.frames", "12", *options]) == 0
    return out / "motion.onnx"


def test_videos_of_an_action_become_an_action_beside_a_shipped_one(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    export_one_step(monkeypatch)
    clips, actions = tmp_path / "clips", tmp_path / "actions"
    (clips / "slide").mkdir(parents=True)
    images = [picture(110 + 6 * index) for index in range(9)]  # 17 frames of the motion
    for name in ("one.mp4", "two.mp4"):
        write_clip(clips / "slide" / name, images)
    (clips / "slide" / "broken.mp4").write_bytes(b"no video")
    rig = ("--rig", "vrm")
    assert main(["follow", "--video", str(clips), "--out", str(actions), *rig, *QUICK]) == 0
    assert "broken.mp4 is left out" in capsys.readouterr().err
    assert sorted(path.name for path in actions.glob("slide/*")) == ["one.bvh", "two.bvh"]

    (actions / "Walk").mkdir()
    walk = [
        "motion",
        "--action",
        "Walk",
        "--seconds",
        "1",
        "--out",
        str(actions / "Walk" / "a.bvh"),
    ]
    assert main([*walk, *rig]) == 0
    found = load_bvh_folder(actions, BVHFolderSettings(frames=12))
    assert found.actions == ("Walk", "slide")

    model = tiny_flow(actions, tmp_path / "run")
    assert set(MotionModel.load(str(model)).actions) == {"Walk", "slide"}
    made = tmp_path / "made.bvh"
    command = ["motion", "--model", str(model), "--action", "slide", "--frames", "20"]
    assert main([*command, "--out", str(made)]) == 0
    assert read_motion(made).frames == 20


def test_what_is_no_folder_of_videos_is_said(clip: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has no videos"):
        videos_below(tmp_path)
    shutil.copy(clip, tmp_path / "a.mp4")
    assert videos_below(tmp_path) == [(tmp_path / "a.mp4", tmp_path.name)]
    target = str(tmp_path / "out.bvh")
    assert main(["follow", "--video", str(tmp_path), "--out", target]) == 2
