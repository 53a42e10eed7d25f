"""Keyframes and held joints from files and words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats.registry import MOTION_FORMATS, write_motion
from a2v.kinematics import bone_lengths
from a2v.kinematics.ground import heading
from a2v.motion import MotionModel
from a2v.motion.direction import Hold
from a2v.motion.keyframes import read_holds, read_keyframes, read_poses


@pytest.fixture(scope="module")
def model() -> MotionModel:
    return MotionModel.load("cmu-fine")


@pytest.fixture(scope="module")
def folder(model: MotionModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("poses")
    for suffix in ("npz", "bvh"):
        write_motion(
            folder / f"walk.{suffix}",
            model.sample("Walk", frames=20, seed=3, bone_scale=1.5),
            MOTION_FORMATS,
        )
    return folder


@pytest.mark.parametrize("suffix", ["npz", "bvh"])
def test_poses_have_the_models_bones_and_stand_as_high_on_them(
    model: MotionModel, folder: Path, suffix: str
) -> None:
    own = model.sample("Walk", frames=20, seed=3)
    poses = read_poses(f"{folder}/walk.{suffix}#8-10", model)
    assert [round(time * model.fps) for time, _ in poses] == [0, 1, 2]
    np.testing.assert_allclose(
        bone_lengths(poses[0][1][None], model.skeleton)[0],
        bone_lengths(own.joints, model.skeleton)[0],
        atol=1e-4,
    )
    for number, (_, pose) in enumerate(poses, 8):
        np.testing.assert_allclose(pose[:, 1], own.joints[number, :, 1], atol=0.01)
        np.testing.assert_allclose(
            pose - pose[0], own.joints[number] - own.joints[number, 0], atol=0.01
        )


def test_a_file_of_keyframes(model: MotionModel, folder: Path) -> None:
    path = folder / "keys.yaml"
    path.write_text(
        "- {time: 0, file: walk.npz}\n"
        "- {frame: 45, file: walk.npz, pose: 4, at: [1, 2], heading: 90}\n"
        "- {time: 3, at: [0, 4]}\n"
        "- {joint: left_wrist, at: [0.1, 1.2, 0.3], from: 1, to: 2}\n"
        "- {joint: head, body: [0, 0.6, 0], from: 1, to: 2.5}\n"
    )
    keys, holds = read_keyframes(path, model, fps=30)
    assert [key.time for key in keys] == [0, 1.5, 3]
    moved = keys[1].joints
    assert moved is not None
    np.testing.assert_allclose(moved[0, [0, 2]], [1, 2], atol=1e-9)
    assert abs(heading(moved, model.skeleton) - np.pi / 2) < 1e-6
    assert (keys[2].joints, keys[2].at, keys[2].heading) == (None, (0, 4), None)
    held = [
        Hold(joint="left_wrist", start=1, end=2, at=(0.1, 1.2, 0.3)),
        Hold(joint="head", start=1, end=2.5, at=(0, 0.6, 0), body=True),
    ]
    assert holds == held
    assert (
        read_holds("left_wrist 0.1,1.2,.3 from 1 to 2 s; head body 0,0.6,0 from 1 to 2.5") == held
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("walk", "not a list of"),
        ("- walk", "entry 1 of"),
        ("- {time: 1}", "is empty"),
        ("- {time: 1, speed: 2}", "unknown entry"),
        ("- {time: soon, at: [0, 1]}", "expected a number"),
        ("- {at: [0, 1]}", "frame of entry 1"),
        ("- {time: -1, at: [0, 1]}", "at least 0"),
        ("- {time: 1, at: [0, 1, 2]}", "expected 2 numbers"),
        ("- {time: 1, file: none.npz}", "does not exist"),
        ("- {time: 1, file: walk.npz, pose: 99}", "poses 0 to 19"),
        ("- {time: 1, file: walk.npz, pose: x}", "names no pose"),
        ("- {joint: head, from: 1, to: 2}", "expected 3 numbers"),
        ("- {joint: head, at: [0, 1, 0], from: 2, to: 1}", "a later end"),
    ],
)
def test_what_is_no_keyframe_is_explained(
    model: MotionModel, folder: Path, text: str, words: str
) -> None:
    (folder / "bad.yaml").write_text(text)
    with pytest.raises(InputError, match=words):
        read_keyframes(folder / "bad.yaml", model, fps=30)


@pytest.mark.parametrize(
    "text",
    [
        "left_wrist",
        "left_wrist 1,2 from 1 to 2",
        "left_wrist 1,2,3 from 1",
        "left_wrist 1,2,3 from ² to 3",
    ],
)
def test_words_that_hold_nothing_are_explained(text: str) -> None:
    with pytest.raises(InputError, match="holds no joint"):
        read_holds(text)
