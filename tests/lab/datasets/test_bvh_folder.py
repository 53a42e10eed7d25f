"""Folders of BVH files: real recordings, and folders with mistakes."""

from __future__ import annotations

import shutil
import zipfile

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.formats.bvh import read_bvh, write_bvh
from a2v.kinematics import CMU, bone_lengths, forward_kinematics, inverse_kinematics, skeleton_of
from a2v.lab.datasets import load_dataset
from a2v.lab.datasets.bvh_folder import BVHFolderSettings

CLIPS = {"walk": ("07/07_01", "08/08_01"), "jump": ("09/09_01", "02/02_04")}


@pytest.fixture(scope="module")
def recorded(data_dir, tmp_path_factory):
    """Four CMU recordings (120 Hz, inches over 0.45) in two actions."""
    folder = tmp_path_factory.mktemp("own")
    with zipfile.ZipFile(data_dir / "cmu_bvh.zip") as archive:
        for action, names in CLIPS.items():
            (folder / action).mkdir()
            for name in names:
                (folder / action / f"{name.split('/')[1]}.bvh").write_bytes(
                    archive.read(f"cmu_bvh/{name}.bvh")
                )
    return folder


@pytest.fixture
def copied(recorded, tmp_path):
    return shutil.copytree(recorded, tmp_path / "own")


def test_recordings_become_clips_in_meters_at_the_wanted_rate(recorded):
    dataset = load_dataset("bvh", recorded)
    assert dataset.actions == ("jump", "walk")
    assert dataset.labels.tolist() == [0, 0, 1, 1]
    assert dataset.subjects == ("02", "09", "07", "08")
    assert (dataset.fps, dataset.length) == (20.0, 60)
    whole = read_bvh(recorded / "walk" / "07_01.bvh")
    clip = dataset.joints[2]
    assert len(clip) == int((whole.frames - 1) / whole.fps * 20 + 1e-6) + 1
    # every sixth frame of 120 Hz is a frame of 20 Hz
    assert np.allclose(clip, whole.joints[::6][: len(clip)], atol=2e-3)
    head = clip[:, dataset.skeleton.index("Head"), 1]
    assert 1.3 < np.median(head) < 1.8


def test_bones_keep_their_lengths_and_kinematics_reach_every_joint(recorded):
    dataset = load_dataset("bvh", recorded)
    skeleton = dataset.skeleton
    for joints in dataset.joints:
        lengths = bone_lengths(joints, skeleton)
        assert np.ptp(lengths, axis=0).max() < 1e-5
        again = forward_kinematics(
            inverse_kinematics(joints, skeleton), joints[:, 0], lengths, skeleton
        )
        assert np.abs(again - joints).max() < 1e-5
    assert {skeleton.joint_names[i] for i in skeleton.feet} == {
        "LeftFoot",
        "LeftToeBase",
        "RightFoot",
        "RightToeBase",
    }
    # the rest pose is the file's: legs hang down, so that no turn is near the edge of a half turn
    assert skeleton.rest_directions[skeleton.index("LeftLeg"), 1] < -0.5


def test_clips_as_motions_obey_the_skeleton_that_they_name(recorded):
    motion = load_dataset("bvh", recorded).motion(3)
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    lengths = bone_lengths(motion.joints, skeleton)
    assert (
        np.abs(
            forward_kinematics(motion.rotations, motion.root, lengths, skeleton) - motion.joints
        ).max()
        < 1e-4
    )


def test_rate_length_and_units_are_settings(recorded):
    inches = load_dataset("bvh", recorded, bvh=BVHFolderSettings(fps=30, frames=40, units="inches"))
    guessed = load_dataset("bvh", recorded, bvh=BVHFolderSettings(fps=30))
    assert (inches.fps, inches.length) == (30, 40)
    assert np.allclose(inches.joints[0] / 0.45, guessed.joints[0], atol=1e-4)
    assert "CMU units" in guessed.notes[0]
    with pytest.raises(InputError, match="fps"):
        BVHFolderSettings(fps=0)
    with pytest.raises(InputError, match="'cubits'"):
        load_dataset("bvh", recorded, bvh=BVHFolderSettings(units="cubits"))
    with pytest.raises(InputError, match="'bvh' only"):
        load_dataset("cmu", recorded, bvh=BVHFolderSettings())


def test_a_zip_gives_the_same_clips_and_folders_below_an_action_name_subjects(recorded, tmp_path):
    with zipfile.ZipFile(tmp_path / "own.zip", "w") as archive:
        for path in recorded.rglob("*.bvh"):
            archive.write(path, f"wrapped/{path.parent.name}/anna/{path.name}")
    zipped = load_dataset("bvh", tmp_path / "own.zip")
    folder = load_dataset("bvh", recorded)
    assert zipped.actions == folder.actions
    assert set(zipped.subjects) == {"anna"}
    assert all(np.array_equal(a, b) for a, b in zip(zipped.joints, folder.joints, strict=True))


def test_our_own_files_load_with_the_known_skeleton(data_dir, tmp_path):
    made = load_dataset("cmu", data_dir).motion(3)
    (tmp_path / "own" / "walk").mkdir(parents=True)
    write_bvh(tmp_path / "own" / "walk" / "a.bvh", made)
    dataset = load_dataset("bvh", tmp_path / "own", bvh=BVHFolderSettings(fps=made.fps))
    assert dataset.skeleton is CMU
    assert np.allclose(dataset.joints[0], made.joints, atol=2e-4)


def spoil(folder, change):
    path = folder / "walk" / "08_01.bvh"
    path.write_text(change(path.read_text()))
    return path


def first_frame(text):
    return text.index("\n", text.index("Frame Time")) + 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: "", r"08_01\.bvh:1: .*empty"),
        (lambda text: text[:-300], r"08_01\.bvh:\d+: .*truncated"),
        (
            lambda text: (
                text[: first_frame(text)] + "nan " + text[first_frame(text) :].split(" ", 1)[1]
            ),
            r"08_01\.bvh:\d+: .*NaN",
        ),
        (
            lambda text: text.replace("RightForeArm", "Tentacle"),
            r"08_01\.bvh has no joint 'Hips': its skeleton",
        ),
        (
            lambda text: text.replace("LThumb", "LThumbs"),
            r"08_01\.bvh has no joint 'LThumb_end'.*not that of .*02_04\.bvh",
        ),
        (
            lambda text: (
                text[: text.index("Frames:")]
                + "Frames: 1\nFrame Time: 0.0083333\n"
                + text[first_frame(text) :].splitlines()[40]
                + "\n"
            ),
            r"08_01\.bvh: the clip has 1 frame",
        ),
    ],
    ids=["empty", "truncated", "nan", "unknown joints", "another skeleton", "one frame"],
)
def test_a_broken_file_is_named_with_the_reason(copied, change, message):
    spoil(copied, change)
    with pytest.raises(InputError, match=message):
        load_dataset("bvh", copied)


def test_folders_without_actions_are_explained(copied, tmp_path):
    (tmp_path / "none").mkdir()
    with pytest.raises(InputError, match=r"holds no \.bvh"):
        load_dataset("bvh", tmp_path / "none")
    shutil.move(copied / "walk" / "08_01.bvh", copied / "08_01.bvh")
    with pytest.raises(InputError, match=r"08_01\.bvh is not in the folder of an action"):
        load_dataset("bvh", copied)


def test_every_clip_can_be_animated(recorded):
    """The loader's result is accepted by retargeting and the writers."""
    motion = load_dataset("bvh", recorded).motion(0)
    target = recorded.parent / "again.bvh"
    write_bvh(target, motion)
    assert np.abs(read_motion(target).joints - motion.joints).max() < 1e-4
