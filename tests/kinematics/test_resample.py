from __future__ import annotations

import dataclasses

import numpy as np

from a2v.kinematics import HUMANACT12
from a2v.kinematics.resample import continuous, frames_made, frames_needed, resample_motion
from tests.support.motions import random_clip


def test_resampling_keeps_shared_frames_and_bones() -> None:
    motion = random_clip(HUMANACT12, frames=21)
    slow, fast = resample_motion(motion, 10.0), resample_motion(motion, 30.0)
    assert (slow.frames, fast.frames) == (11, 31)
    np.testing.assert_allclose(slow.joints, motion.joints[::2], atol=1e-5)
    np.testing.assert_allclose(fast.joints[::3], motion.joints[::2], atol=1e-5)
    lengths = [np.linalg.norm(m.joints[:, 5] - m.joints[:, 2], axis=-1) for m in (motion, fast)]
    np.testing.assert_allclose(lengths[1], lengths[0][0], atol=1e-5)


def test_a_single_frame_is_its_own_neighbor() -> None:
    quats = np.eye(4)[None]
    np.testing.assert_array_equal(continuous(quats), quats)
    np.testing.assert_array_equal(
        continuous(np.concatenate([quats, -quats])), np.concatenate([quats, quats])
    )


def test_a_start_from_rest_overshoots_little() -> None:
    motion = random_clip(HUMANACT12, frames=21)
    order = [0] * 8 + list(range(13))
    still = dataclasses.replace(
        motion,
        joints=motion.joints[order],
        rotations=motion.rotations[order],
        root=motion.root[order],
    )
    away = np.linalg.norm(resample_motion(still, 60.0).joints[:24] - motion.joints[0], axis=-1).max(
        1
    )
    step = np.linalg.norm(motion.joints[1] - motion.joints[0], axis=-1).max()
    assert away[18:].max() < 0.2 * step
    assert away[:12].max() < 0.02 * step


def test_frames_are_counted_both_ways() -> None:
    for rate in (7.5, 12.0, 30.0, 100.0):
        for frames in (1, 2, 13, 150):
            needed = frames_needed(frames, 12.0, rate)
            assert frames_made(needed, 12.0, rate) >= frames
            assert needed == 1 or frames_made(needed - 1, 12.0, rate) < frames
