"""A rig that is driven frame by frame."""

from __future__ import annotations

import numpy as np

from a2v.animation.live import LiveRig
from a2v.animation.rig import SIDES, rig_of, sole_points
from a2v.kinematics import CMU
from a2v.types import Body, FloatArray
from tests.support.motions import person


def joints() -> FloatArray:
    return np.asarray(person().joints, np.float64)


def test_soles_stand_on_the_ground_and_the_person_begins_above_the_origin(body: Body) -> None:
    own = LiveRig(body, CMU)
    rig = rig_of(body)
    for frame, places in enumerate(joints()):
        bones = own.add(places + np.array([3.0, -1.4, -2.0]))
        assert np.isfinite(bones).all()
        lowest = min(sole_points(bones[None], rig, side)[..., 1].min() for side in SIDES)
        assert abs(lowest) < 0.15
        if not frame:
            assert np.allclose(bones[0, [0, 2], 3], 0, atol=1e-6)
            assert abs(lowest) < 1e-6


def test_a_jump_leaves_the_ground(body: Body) -> None:
    own, rig = LiveRig(body, CMU), rig_of(body)
    standing = joints()[0]
    for _ in range(10):
        own.add(standing)
    bones = own.add(standing + np.array([0.0, 0.3, 0.0]))
    lowest = min(sole_points(bones[None], rig, side)[..., 1].min() for side in SIDES)
    assert 0.2 < lowest < 0.4
