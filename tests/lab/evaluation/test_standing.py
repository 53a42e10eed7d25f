"""Measures by each foot's own floor."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics import CMU
from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.physics import contact_speeds, ends_of, joints_physics
from a2v.lab.evaluation.standing import measure, score_standing, standing_table
from a2v.types import Motion
from tests.support.motions import clip, person, waving


def test_a_clip_that_floats_slides_as_much_as_one_that_does_not() -> None:
    walk = person(frames=30, step=0.1, height=0.0)  # a T-pose that glides at 1 m/s
    for height in (0.0, 0.5):
        glides = measure([walk.joints + np.float32([0, height, 0])], walk.fps, CMU)
        assert glides.slide == pytest.approx(1.0, abs=1e-3)
        assert glides.fast == 1.0
    physics = joints_physics(walk.joints, walk.fps, CMU.parents, CMU.feet)
    assert physics.contact_slide == pytest.approx(1.0, abs=1e-3)
    assert physics.contact_fast == 1.0


def test_a_foot_counts_as_down_near_its_own_lowest_level_only() -> None:
    feet = np.zeros((40, 2, 3))
    feet[:, 1, 1] = 0.2  # stands on a box
    feet[20:, :, 1] += 0.1
    feet[20:, :, 2] = 0.5 * np.arange(20)[:, None]
    assert len(contact_speeds(feet, 10.0)) == 40
    assert contact_speeds(feet, 10.0).max() < 0.1
    assert ends_of(CMU.feet, CMU.parents) == [15, 19]


def test_actions_are_scored_beside_their_recordings() -> None:
    data = waving()
    one = data.motion(0)

    def make(action: str, seed: int) -> Motion:
        own = data.joints[
            int(np.flatnonzero(data.labels == data.actions.index(action))[seed % 2])
        ] * np.float32(data.frame.meters_per_unit)
        return clip(own, data.skeleton, data.fps)

    scores = score_standing(make, data, clips=2, seconds=one.frames / data.fps)
    assert [row.action for row in scores] == list(data.actions)
    for row in scores:
        assert row.generated.slide == pytest.approx(row.recorded.slide, rel=0.05)
        assert row.generated.jerk == pytest.approx(row.recorded.jerk, rel=0.25)
        assert row.nearest < 0.02
        assert row.spread is not None
    assert "Slide in contact: median" in standing_table(scores)
    with pytest.raises(InputError, match="at least 2"):
        score_standing(make, data, clips=1)


def test_copies_are_no_second_recording() -> None:
    data = waving()
    same: ActionDataset = dataclasses.replace(
        data,
        joints=tuple(data.joints[0] for _ in data.joints),
        labels=np.zeros(len(data), np.int64),
    )
    scores = score_standing(
        lambda action, seed: clip(data.joints[seed], data.skeleton, data.fps),
        same,
        clips=2,
        seconds=1.0,
    )
    assert scores[0].recordings == 1
    assert scores[0].spread is None
