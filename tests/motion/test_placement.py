"""Places of clips: bones, paths, floors."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics import CMU, skeleton_from_parents
from a2v.motion.placement import (
    body_parts,
    leg_length,
    level_floor,
    place_on_ground,
    scale_bones,
    scale_path,
    to_native,
)
from export import sample as sample_script


def test_the_floor_of_a_climbing_walk_is_levelled():
    frames, window = 600, 60
    t = np.arange(frames)
    joints = np.zeros((2, frames, 3, 3), np.float32)
    joints[:, :, 0, 1] = 1.0
    joints[:, :, 1, 1] = 0.1 * np.maximum(np.sin(t / 3), 0)  # two feet that lift in turn
    joints[:, :, 2, 1] = 0.1 * np.maximum(-np.sin(t / 3), 0)
    sloped = joints.copy()
    sloped[0, ..., 1] += (np.maximum(t - window, 0) * 0.004)[:, None]  # 2.2 m at the end
    sloped[1, ..., 1] -= (np.maximum(t - window, 0) * 0.004)[:, None]
    level = level_floor(sloped, window)
    assert np.array_equal(level[:, :window], sloped[:, :window])
    assert np.abs(level[..., 1] - joints[..., 1]).max() < 0.13
    assert (
        np.abs(np.diff(level[..., 1] - joints[..., 1], axis=1)).max() < 0.01
    )  # no jump where pieces meet
    assert np.array_equal(level_floor(sloped[:, :window], window), sloped[:, :window])
    assert np.allclose(level_floor(joints, window), joints, atol=0.02)
    for length in (61, 62, 75, 100):
        assert np.isfinite(level_floor(sloped[:, :length], window)).all()
    assert np.allclose(sample_script.level_floor(sloped, window), level)


def test_clips_begin_above_the_origin_and_touch_the_ground():
    joints = np.random.default_rng(0).normal(size=(3, 9, 20, 3)).astype(np.float32)
    placed = place_on_ground(joints, 60)
    assert np.allclose(placed[:, 0, 0, [0, 2]], 0, atol=1e-6)
    assert np.allclose(placed[..., 1].min(axis=(1, 2)), 0, atol=1e-6)
    assert np.allclose(np.diff(placed, axis=1), np.diff(joints, axis=1), atol=1e-5)


def test_a_path_is_scaled_and_poses_are_not():
    joints = np.random.default_rng(0).normal(size=(2, 9, 20, 3)).astype(np.float32)
    scaled = scale_path(joints, np.array([2.0, 0.5]))
    assert np.allclose(scaled - scaled[:, :, :1], joints - joints[:, :, :1], atol=1e-5)
    for clip, step in ((0, 2.0), (1, 0.5)):
        assert np.allclose(
            scaled[clip, :, 0] - scaled[clip, 0, 0],
            step * (joints[clip, :, 0] - joints[clip, 0, 0]),
            atol=1e-5,
        )


def test_legs_that_are_not_known_are_all_bones():
    chain = skeleton_from_parents([-1, 0, 1], ["a", "b", "c"])
    assert set(body_parts(chain)) == {"torso", "all"}
    assert leg_length(np.array([0.0, 2.0, 3.0]), chain) == 5
    assert scale_bones(np.float32([0, 2, 3]), chain, {"torso": 2, "c": 0.5}).tolist() == [0, 4, 3]
    with pytest.raises(InputError, match="no bone 'legs'"):
        scale_bones(np.ones(3, np.float32), chain, {"legs": 2})
    assert leg_length(np.ones((4, 20)), CMU).tolist() == [len(body_parts(CMU)["legs"])] * 4


def test_native_joints_go_back_to_meters():
    joints = np.random.default_rng(0).normal(size=(2, 9, 20, 3)).astype(np.float32)
    native = to_native(joints, meters_per_unit=0.5, signs=(1.0, -1.0, -1.0))
    assert np.allclose(
        native * 0.5 * np.float32([1, -1, -1]), joints - joints[:, :1, :1], atol=1e-6
    )
