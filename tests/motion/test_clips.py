"""The library of clips: its contents and how they play."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats.bvh import read_bvh
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.motion.clips import AUTHORS, LIBRARY, REPEATED_SECONDS, clip_library, play_clip
from a2v.motion.edit import mirror_motion

LOOPS = [clip.name for clip in clip_library().clips if clip.plays == "loop"]


def lengths_of(motion):
    return np.linalg.norm(motion.joints[:, 1:] - motion.joints[:, motion.parents[1:]], axis=-1)


def test_all_clips_ship_small_with_author_and_license() -> None:
    library = clip_library()
    assert len(library.clips) == len(set(library.actions)) >= 77 + 14 + 100
    assert {(clip.author, clip.license) for clip in library.clips} == set(AUTHORS.values())
    assert LIBRARY.stat().st_size < 2e6
    assert not missing_joints(
        canonical_joints(library.skeleton.joint_names, library.skeleton.parents.tolist())
    )
    assert play_clip("Bow", frames=3, fps=30).provenance["license"] == "CC0-1.0"


def test_the_first_seed_is_the_file_itself(data_dir) -> None:
    import zipfile

    archive = zipfile.ZipFile(data_dir / "clips_cc0.zip")
    for name, file in (("Bow", "bow"), ("Sit down", "sitting-enter"), ("Backflip", "backflip")):
        read = read_bvh(archive.read(f"{file}.bvh"))
        played = play_clip(name, frames=read.frames, fps=read.fps)
        own = [played.joint_names.index(joint) for joint in read.joint_names]
        bones = [
            np.diff(
                joints[
                    :, [[parent, joint] for joint, parent in enumerate(read.parents) if parent >= 0]
                ],
                axis=2,
            )[:, :, 0]
            for joints in (played.joints[:, own], read.joints)
        ]
        along, theirs = (bone / np.linalg.norm(bone, axis=-1, keepdims=True) for bone in bones)
        assert (along * theirs).sum(-1).min() > np.cos(
            0.03
        )  # all bones point as in the file; they are as long as the library's


def test_bones_keep_their_length_whatever_the_seed() -> None:
    wanted = clip_library().lengths[1:]
    for seed in (0, 3, 4):
        assert (
            np.abs(
                lengths_of(play_clip("Talk", frames=70, fps=24, seed=seed, speed=1.3)) - wanted
            ).max()
            < 1e-4
        )


def test_seeds_differ_and_come_back() -> None:
    one, again, other = (
        play_clip("Jab", frames=40, fps=30, seed=seed).joints for seed in (5, 5, 6)
    )
    assert np.array_equal(one, again)
    assert np.abs(one - other).max() > 0.05
    assert np.abs(one - play_clip("Jab", frames=40, fps=30).joints).mean() < 0.3


@pytest.mark.parametrize("name", LOOPS)
def test_cycles_go_on_without_a_jump(name: str) -> None:
    library = clip_library()
    index = library.index(name)
    cycle, fps = len(library.joints[index]), library.clips[index].fps
    joints = play_clip(name, frames=2 * cycle + 2, fps=fps).joints.astype(np.float64)
    steps = np.abs(np.diff(joints, axis=0)).max(axis=(1, 2))
    assert (
        steps[cycle - 1] <= 1.8 * steps.max() * 0.999
        or steps[cycle - 1] <= 1.5 * np.delete(steps, cycle - 1).max() + 2e-3
    )


def test_clips_that_walk_stand_on_their_feet() -> None:
    motion = play_clip("Walking cycle", frames=120, fps=30)
    for ball in ("ball_l", "ball_r"):
        points = motion.joints[:, motion.joint_names.index(ball)].astype(np.float64)
        speed = np.linalg.norm(np.gradient(points, axis=0), axis=-1) * 30
        assert np.median(speed[points[:, 1] < 0.02]) < 0.1
    assert motion.root[-1, 2] - motion.root[0, 2] == pytest.approx(1.05 * 119 / 30, abs=0.3)


def test_what_is_no_cycle_is_repeated_or_held() -> None:
    library = clip_library()
    assert library.seconds("Nod") >= REPEATED_SECONDS
    held = play_clip("Sit down", frames=90, fps=30).joints
    assert np.array_equal(held[-1], held[-10])
    twice = play_clip("Victory", frames=81, fps=24).joints
    assert np.abs(twice[40] - twice[0]).max() < 0.1


def test_mirrored_fingers_change_sides() -> None:
    motion = play_clip("Shoot a pistol", frames=5, fps=30)
    mirrored = mirror_motion(motion)
    left, right = (motion.joint_names.index(f"index_03_{side}") for side in "lr")
    np.testing.assert_allclose(
        mirrored.joints[:, left], motion.joints[:, right] * (-1, 1, 1), atol=1e-5
    )


def test_unknown_clips_are_refused() -> None:
    with pytest.raises(InputError, match="no clip is called 'Dig'"):
        play_clip("Dig", frames=3, fps=30)
