"""Actions of several sources in one clip."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.motion.catalog import understand
from a2v.motion.clips import clip_library
from a2v.motion.edit import Edit
from a2v.motion.medley import make_sourced, shared_frames
from a2v.motion.prompts import Step


@pytest.fixture(scope="module")
def mixed():
    return make_sourced(
        understand("march for 2 s, then bow, then turn the steering wheel").steps,
        frames=240,
        fps=30,
        seed=2,
    )


def test_a_mix_has_the_frames_that_are_asked_for(mixed) -> None:
    assert mixed.frames == 240
    assert mixed.action == "March,Bow,turn_steering_wheel"
    np.testing.assert_allclose(mixed.action_starts[:2], [0, 2])
    assert mixed.provenance["sources"] == ["cmu-fine", "clips", "humanact12"]
    assert mixed.provenance["told"] == [False, True, False]


def test_bones_stay_as_long_and_nothing_jumps(mixed) -> None:
    lengths = np.linalg.norm(mixed.joints[:, 1:] - mixed.joints[:, mixed.parents[1:]], axis=-1)
    assert np.abs(lengths - clip_library().lengths[1:]).max() < 1e-3
    steps = np.abs(np.diff(mixed.joints.astype(np.float64), axis=0)).max(axis=(1, 2))
    for start in mixed.action_starts[1:]:
        near = round(start * 30)
        assert steps[near - 2 : near + 3].max() < 0.25
    assert mixed.joints[..., 1].min() > -0.1


def test_the_next_goes_on_where_the_last_ended(mixed) -> None:
    at = round(mixed.action_starts[1] * 30)
    assert np.linalg.norm((mixed.root[at] - mixed.root[at - 1])[[0, 2]]) < 0.1
    assert np.linalg.norm(mixed.root[at, [0, 2]]) > 0.3


def test_open_lengths_are_shared_as_long_as_actions_last() -> None:
    steps = [
        Step(action="Bow", source="clips"),
        Step(action="Walk", source="cmu", seconds=2.0),
        Step(action="Idle", source="clips"),
    ]
    counts = shared_frames(steps, frames=300, fps=30)
    assert sum(counts) == pytest.approx(300, abs=2)
    assert counts[1] == 60
    assert counts[2] > counts[0]


def test_one_model_alone_is_as_ever() -> None:
    from a2v.motion import MotionModel
    from a2v.motion.direct import make_motion
    from a2v.motion.timeline import Take

    steps = understand("salsa").steps
    mine = make_sourced(steps, frames=60, fps=30, seed=3)
    theirs = make_motion(MotionModel.load("cmu-fine"), steps, Take(frames=60, fps=30, seed=3))
    np.testing.assert_array_equal(mine.joints, theirs.joints)


def test_clips_take_the_edits_that_others_take() -> None:
    steps = understand("walking cycle").steps
    slow, quick = (
        make_sourced(steps, frames=60, fps=30, edit=Edit(speed=speed)) for speed in (1.0, 2.0)
    )
    assert quick.root[-1, 2] == pytest.approx(2 * slow.root[-1, 2], rel=0.1)  # feet are planted
    still = make_sourced(steps, frames=60, fps=30, edit=Edit(in_place=True))
    assert np.abs(still.root[-1, [0, 2]] - still.root[0, [0, 2]]).max() < 0.15
    loop = make_sourced(understand("idle").steps, frames=120, fps=30, edit=Edit(loop=True))
    step = np.abs(np.diff(loop.joints, axis=0)).max()
    assert np.abs(loop.joints[0] - loop.joints[-1]).max() < 3 * step + 1e-3
    several = make_sourced(steps, frames=20, fps=30, count=3)
    assert several.joints.shape[:2] == (3, 20)


def test_steps_without_a_source_are_refused() -> None:
    with pytest.raises(InputError, match="needs a source"):
        make_sourced([Step(action="Walk")], frames=10, fps=30)
