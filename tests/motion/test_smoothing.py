"""Jerky actions are smoothed, others are not."""

from __future__ import annotations

import numpy as np

from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.prompts import Step
from a2v.motion.smoothing import SMOOTHED, smooth_actions
from a2v.motion.timeline import Take, perform
from a2v.types import FloatArray


def jerk(joints: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(joints.astype(float), 3, axis=-3), axis=-1).mean())


def lengths(joints: FloatArray, parents: np.ndarray) -> FloatArray:
    return np.linalg.norm(joints[..., 1:, :] - joints[..., parents[1:], :], axis=-1)


def test_jerky_actions_get_smooth_and_bones_keep_their_lengths() -> None:
    model = MotionModel.load("cmu-fine")
    assert set(SMOOTHED) <= set(model.actions)
    made = perform(model, [Step(action="Elephant")], Take(frames=90, fps=30.0, seed=1))
    even = smooth_actions(made, ["Elephant"])
    assert jerk(even.joints) < 0.6 * jerk(made.joints)
    np.testing.assert_allclose(
        lengths(even.joints, made.parents), lengths(made.joints, made.parents), atol=1e-5
    )
    assert np.linalg.norm(even.joints - made.joints, axis=-1).max() < 0.15
    assert smooth_actions(made, ["Walk"]) is made


def test_only_the_jerky_part_of_a_prompt_is_smoothed() -> None:
    model = MotionModel.load("cmu-fine")
    steps = [Step(action="Walk", seconds=2), Step(action="Sneak", seconds=2)]
    made = perform(model, steps, Take(frames=120, fps=30.0, seed=1))
    even = smooth_actions(made, ["Walk", "Sneak"])
    away = np.linalg.norm(even.joints - made.joints, axis=-1).max(axis=-1)
    assert away[:50].max() < 1e-4
    assert away[70:].max() > 1e-3


def test_commands_smooth_batches_too() -> None:
    model = MotionModel.load("cmu-fine")
    take = Take(frames=60, fps=30.0, seed=1)
    batch = make_motion(model, [Step(action="Snake")], Take(frames=60, fps=30.0, seed=1, count=2))
    raw = perform(model, [Step(action="Snake")], take, skip_rest=True)
    assert batch.joints.shape == (2, 60, raw.joints.shape[1], 3)
    assert jerk(batch.joints) < jerk(raw.joints)
