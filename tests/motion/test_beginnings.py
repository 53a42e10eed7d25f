"""Actions that begin with the movement."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.motion import MotionModel
from a2v.motion.beginnings import LEAD_SECONDS, rests, shifted
from a2v.motion.direct import make_motion
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take, perform
from a2v.types import Motion


def test_what_people_stand_still_is_found_but_for_a_moment() -> None:
    joints = np.zeros((3, 60, 5, 3))
    for clip, begin in enumerate((0, 20, 35)):
        joints[clip, begin:, :, 2] = 0.1 * np.arange(60 - begin)[:, None]
    found = rests(joints, 12.0, 60)
    lead = round(LEAD_SECONDS * 12)
    assert found[0] == 0
    assert np.abs(found[1:] - (np.array([20, 35]) - lead)).max() <= 2
    moved = shifted(joints, found)
    assert moved.shape == joints.shape
    np.testing.assert_array_equal(moved[1, 0], joints[1, found[1]])
    np.testing.assert_array_equal(moved[2, -1], joints[2, -1])
    assert rests(joints, 12.0, 1).tolist() == [0, 0, 0]


def seconds_until_it_moves(motion: Motion) -> float:
    """Return the seconds until the joints' mean speed reaches half of `FAST`."""
    speed = np.linalg.norm(np.diff(motion.joints, axis=0), axis=-1).mean(-1)
    even = np.convolve(speed, np.ones(8) / 8, mode="valid") * motion.fps
    return float(np.argmax(even > 0.5 * FAST[str(motion.action)]) / motion.fps)


# : Mean speed of the joints, meters per second, at which the action is in progress.
FAST = {"Jump kick": 1.0, "Hop and turn": 0.5, "Start running": 1.2}


@pytest.mark.parametrize("action", sorted(FAST))
def test_an_action_begins_at_once_and_as_the_data_where_it_is_not_asked_to(action: str) -> None:
    model = MotionModel.load("cmu-fine")
    steps = [Step(action=action)]
    late, made = [], []
    for seed in range(4):
        late.append(
            seconds_until_it_moves(perform(model, steps, Take(frames=240, fps=30.0, seed=seed)))
        )
        clip = make_motion(model, steps, Take(frames=240, fps=30.0, seed=seed))
        assert clip.frames == 240
        made.append(seconds_until_it_moves(clip))
    assert np.mean(made) < 1.3
    assert np.mean(made) < np.mean(late) + 0.05


def test_a_second_action_begins_at_once_too() -> None:
    model = MotionModel.load("cmu-fine")
    steps = [Step(action="Walk", seconds=2.0), Step(action="Jump kick", seconds=4.0)]
    moved = []
    for skip_rest in (False, True):
        made = perform(model, steps, Take(frames=60, fps=12.0, seed=4), skip_rest=skip_rest)
        speed = np.linalg.norm(np.diff(made.joints, axis=0), axis=-1).mean(-1)
        moved.append(speed[30:48].mean())
        lengths = np.linalg.norm(made.joints - made.joints[:, np.maximum(made.parents, 0)], axis=-1)
        assert np.ptp(lengths, axis=0).max() < 1e-3
        assert speed[22:26].max() < 1.5 * speed.max()
    assert moved[1] >= 0.9 * moved[0]


def test_clips_of_a_batch_begin_each_by_itself() -> None:
    model = MotionModel.load("cmu-fine")
    made = perform(
        model,
        [Step(action="Jump kick")],
        Take(frames=60, fps=model.fps, seed=1, count=6),
        skip_rest=True,
    )
    plain = perform(
        model, [Step(action="Jump kick")], Take(frames=60, fps=model.fps, seed=1, count=6)
    )
    assert made.joints.shape == plain.joints.shape
    off = [
        float(np.abs(one[:12] - other[:12]).max())
        for one, other in zip(made.joints, plain.joints, strict=True)
    ]
    assert max(off) > 0.05
    np.testing.assert_allclose(made.joints[:, 0, 0, [0, 2]], 0, atol=1e-4)
