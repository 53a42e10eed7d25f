"""Clips that begin in the photo's pose."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.animation import RetargetSettings, retarget
from a2v.animation.entrance import enter_from, in_world
from a2v.errors import InputError
from a2v.types import Body
from tests.support.motions import person


@pytest.fixture(scope="module")
def clips(body: Body) -> tuple[np.ndarray, np.ndarray]:
    motion = person(frames=24, step=0.05)
    return tuple(
        retarget(motion, body, settings=RetargetSettings(raw=True, from_photo=value))
        for value in (False, True)
    )


def test_the_first_frame_is_the_photos_pose_on_the_ground(body, clips):
    own, entered = clips
    np.testing.assert_allclose(entered[0], in_world(body), atol=1e-5)
    lowest = body.vertices[:, 1].min() - body.bone_transforms[0, 1, 3] + entered[0, 0, 1, 3]
    assert lowest == pytest.approx(0, abs=1e-5)
    assert np.abs(entered[0] - own[0]).max() > 0.05
    np.testing.assert_array_equal(entered[9:], own[9:])  # .9 s of 10 frames a second


def test_bones_keep_their_lengths_and_start_without_a_jerk(body, clips):
    own, entered = clips
    rows = np.arange(1, len(body.bone_parents))
    parents = body.bone_parents[rows]

    def offsets(transforms):
        return np.linalg.norm(transforms[:, rows, :3, 3] - transforms[:, parents, :3, 3], axis=-1)

    np.testing.assert_allclose(offsets(entered), offsets(own), atol=2e-3)
    rotations = entered[:, :, :3, :3]
    np.testing.assert_allclose(
        rotations @ np.swapaxes(rotations, -1, -2),
        np.broadcast_to(np.eye(3), rotations.shape),
        atol=1e-5,
    )
    steps = np.linalg.norm(np.diff(entered[:10, :, :3, 3], axis=0), axis=-1).max(axis=1)
    assert steps[0] < 0.5 * steps.max()


def test_another_rig_and_no_time_are_refused(body, clips):
    with pytest.raises(InputError, match="first pose"):
        enter_from(clips[0], clips[0][0, :5], body.bone_parents, fps=10)
    with pytest.raises(InputError, match="more than 0"):
        enter_from(clips[0], clips[0][0], body.bone_parents, fps=10, seconds=0)
