"""A sample person who slides to the right becomes a motion."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.footage.figure import PARENTS, person_skeleton
from a2v.footage.follow import follow_person
from a2v.footage.ground import evenly
from a2v.footage.remarks import clock
from a2v.kinematics import bone_lengths
from a2v.kinematics.names import canonical_joints, missing_joints
from tests.support.footage import QUICK, picture, write_clip


def test_the_motion_lasts_as_long_as_the_video(followed):
    assert followed.motion.fps == 30
    assert followed.motion.frames == int(0.97 * 30) + 1
    assert followed.facts["seen"] == followed.facts["frames"] == 20


def test_whoever_goes_to_the_right_of_the_picture_goes_to_the_right(found):
    root = found[1].joints[:, 0]
    away = root[-1] - root[0]
    assert away[0] > 0.3  # 95 pixels of a person of 180 pixels
    assert abs(away[2]) < 0.35


def test_it_is_one_body_on_the_ground_that_faces_the_camera(followed):
    motion = followed.motion
    lengths = bone_lengths(motion.joints.astype(np.float64), person_skeleton())
    assert np.ptp(lengths, axis=0).max() < 2e-3
    names = motion.joint_names
    assert (
        abs(motion.joints[:, [names.index("left_foot"), names.index("right_foot")], 1].min()) < 0.06
    )
    assert 1.4 < motion.joints[:, names.index("head_top"), 1].mean() < 1.85
    across = (
        motion.joints[:, names.index("left_shoulder")]
        - motion.joints[:, names.index("right_shoulder")]
    )
    assert (across[:, 0] > 0.2).all()
    assert not missing_joints(canonical_joints(names, list(PARENTS)))


def test_a_second_shot_and_a_person_who_leaves_are_said(tmp_path):
    images = (
        [picture(120 + 2 * index) for index in range(12)]
        + [picture(None)] * 8
        + [picture(200, wall=7)] * 7
    )
    found = follow_person(write_clip(tmp_path / "cut.mp4", images), QUICK)
    said = " ".join(found.remarks)
    assert "cut at 0:01.3" in said
    assert found.motion.frames in (22, 23)  # 11 steps of 1 / 15 s


def test_a_person_who_leaves_for_good_ends_the_motion(tmp_path):
    seen = [picture(150 + 4 * index) for index in range(15)]
    path = write_clip(tmp_path / "gone.mp4", seen + [picture(None)] * 24)
    found = follow_person(path, QUICK)
    assert found.facts["frames"] == 39
    assert 13 <= found.facts["seen"] <= 15
    assert found.motion.frames in (2 * found.facts["seen"] - 2, 2 * found.facts["seen"] - 1)
    (remark,) = found.remarks
    last = clock((found.facts["seen"] - 1) / 15)
    assert remark == f"the person is not seen any more from {last} on"


def test_of_two_the_larger_is_followed_and_it_is_said(tmp_path):
    path = write_clip(
        tmp_path / "two.mp4", [picture(100 + index, others=(260,)) for index in range(8)]
    )
    found = follow_person(path, QUICK)
    assert "2 people" in " ".join(found.remarks)
    with pytest.raises(InputError, match=r"follow\.person is 3"):
        follow_person(path, dataclasses.replace(QUICK, person=3))


def test_nobody_is_said_in_one_sentence(tmp_path):
    path = write_clip(tmp_path / "empty.mp4", [picture(None)] * 6)
    with pytest.raises(InputError, match="no person found"):
        follow_person(path, QUICK)
    with pytest.raises(InputError, match="start is 9"):
        follow_person(path, dataclasses.replace(QUICK, start=9.0))


def test_even_times_keep_what_is_linear():
    times = np.cumsum(np.random.default_rng(0).uniform(0.02, 0.05, 30))
    values = np.stack([3 * times, 1 - times], axis=-1)
    made = evenly(values, times, 30)
    at = times[0] + np.arange(len(made)) / 30
    assert np.allclose(made, np.stack([3 * at, 1 - at], axis=-1))


def test_times_are_written_as_clocks():
    assert [clock(value) for value in (0, 3.24, 59.96, 125)] == [
        "0:00.0",
        "0:03.2",
        "1:00.0",
        "2:05.0",
    ]


def test_a_film_on_its_side_is_said_and_can_be_turned(tmp_path):
    images = [np.rot90(picture(110 + 5 * step)) for step in range(8)]
    clip = write_clip(tmp_path / "side.mp4", images)
    lying = follow_person(clip, QUICK)
    assert "follow.turn 270" in " ".join(lying.remarks)
    upright = follow_person(clip, dataclasses.replace(QUICK, turn=270))
    assert "follow.turn" not in " ".join(upright.remarks)
    assert upright.facts["video"] == [320, 240]
    height = upright.motion.joints[..., 1]
    assert np.ptp(height, axis=1).min() > 1.2
