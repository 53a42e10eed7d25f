from __future__ import annotations

import dataclasses

import numpy as np

from a2v.kinematics import HUMANACT12
from a2v.kinematics.resample import resample_motion
from tests.support.motions import random_clip


def test_resampling_keeps_shared_frames_and_bones() -> None:
    motion = random_clip(HUMANACT12, frames=21)
    slow, fast = resample_motion(motion, 10.0), resample_motion(motion, 30.0)
    assert (slow.frames, fast.frames) == (11, 31)
    np.testing.assert_allclose(slow.joints, motion.joints[::2], atol=1e-5)
    np.testing.assert_allclose(fast.joints[::3], motion.joints[::2], atol=1e-5)
    lengths = [np.linalg.norm(m.joints[:, 5] - m.joints[:, 2], axis=-1) for m in (motion, fast)]
    np.testing.assert_allclose(lengths[1], lengths[0][0], atol=1e-5)
    still = dataclasses.replace(
        motion,
        joints=motion.joints[[0] * 5 + list(range(16))],
        rotations=motion.rotations[[0] * 5 + list(range(16))],
        root=motion.root[[0] * 5 + list(range(16))],
    )
    np.testing.assert_allclose(resample_motion(still, 60.0).joints[:13], np.tile(motion.joints[:1], (13, 1, 1)), atol=1e-5)
