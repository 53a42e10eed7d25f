"""A faster tempo gives longer steps."""

from __future__ import annotations

import numpy as np

from a2v.kinematics import CMU, bone_lengths
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.edit import Edit
from a2v.motion.prompts import Step
from a2v.motion.stride import LONGEST, lengthened, strides
from a2v.motion.timeline import Take
from tests.support.motions import person


def test_steps_share_the_tempo_up_to_a_limit() -> None:
    np.testing.assert_allclose(strides(np.array([0.5, 1.0, 1.21, 4.0])), [1, 1, 1.1, LONGEST])


def test_the_way_is_longer_and_bones_are_not() -> None:
    walk = person(frames=40, step=0.12)
    longer = lengthened(walk, np.full(40, 1.2))
    ratio = (longer.root[-1] - longer.root[0])[2] / (walk.root[-1] - walk.root[0])[2]
    assert 1.19 < ratio < 1.21
    np.testing.assert_allclose(
        bone_lengths(longer.joints, CMU), bone_lengths(walk.joints, CMU), atol=1e-4
    )
    np.testing.assert_array_equal(lengthened(walk, np.ones(40)).joints, walk.joints)
    stands = person(frames=40, step=0.0)
    np.testing.assert_allclose(
        lengthened(stands, np.full(40, 1.2)).joints, stands.joints, atol=1e-5
    )


def test_a_quick_walk_travels_as_much_faster() -> None:
    model = MotionModel.load("cmu-fine")
    paces = []
    for speed in (1.0, 1.5):
        made = make_motion(
            model,
            [Step(action="Walk")],
            Take(frames=60, fps=30.0, seed=2, count=12),
            edit=Edit(speed=speed),
        )
        paces.append(np.median(np.linalg.norm(made.root[:, -1] - made.root[:, 0], axis=-1) / 2))
    assert 1.2 < paces[1] / paces[0] < 1.8
