"""Steps of their own length and tempo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics.ground import heading
from a2v.motion import MotionModel
from a2v.motion.prompts import Step, Vocabulary
from a2v.motion.timeline import Take, perform, read_timeline, step_frames


@pytest.fixture(scope="module")
def model() -> MotionModel:
    return MotionModel.load("cmu")


def test_steps_without_lengths_are_what_sample_makes(model: MotionModel) -> None:
    one, other = (
        perform(model, [Step(action="Walk")], Take(frames=161, fps=model.fps, seed=4)),
        model.sample("Walk", frames=161, seed=4),
    )
    np.testing.assert_array_equal(one.joints, other.joints)
    assert one.action == other.action


def test_each_step_is_as_long_as_it_says(model: MotionModel) -> None:
    steps = [Step(action="Walk", seconds=2.0), Step(action="Jump", frames=13), Step(action="Run")]
    assert step_frames(steps, frames=60, fps=12.0) == [24, 13, 20]
    assert perform(model, steps, Take(frames=60, fps=model.fps)).frames == 57


def test_tempo_takes_a_step_through_more_or_less_motion(model: MotionModel) -> None:
    slow = perform(
        model, [Step(action="Walk", frames=49, speed=0.5)], Take(frames=60, fps=model.fps, seed=2)
    )
    plain = model.sample("Walk", frames=25, seed=2)
    assert slow.frames == 49
    assert (
        abs(np.diff(slow.joints, axis=0)).mean() < 0.6 * abs(np.diff(plain.joints, axis=0)).mean()
    )
    for end in (0, -1):
        np.testing.assert_allclose(slow.joints[end], plain.joints[end], atol=1e-4)


def test_another_rate_and_tempo_take_as_long_as_they_say(model: MotionModel) -> None:
    steps = [Step(action="Walk", seconds=2.0), Step(action="Jump", frames=15)]
    plain, fine, quick = (
        perform(model, steps, Take(frames=60, fps=fps, seed=3), speed=speed)
        for fps, speed in ((12.0, 1.0), (30.0, 1.0), (30.0, 1.5))
    )
    assert (plain.frames, fine.frames, quick.frames) == (24 + 15, 60 + 15, 60 + 15)
    assert (fine.fps, quick.fps) == (30, 30)
    np.testing.assert_allclose(fine.joints[:50:5], plain.joints[:20:2], atol=1e-4)
    assert abs(np.diff(quick.root, axis=0)).mean() > 1.2 * abs(np.diff(fine.root, axis=0)).mean()


def test_a_change_of_action_is_even_and_keeps_bones_and_floor(model: MotionModel) -> None:
    motion = perform(
        model,
        [Step(action="Walk", seconds=3.0), Step(action="Dance", seconds=3.0)],
        Take(frames=60, fps=model.fps, seed=1, count=8),
    )
    speed = np.linalg.norm(np.diff(motion.joints, axis=1), axis=-1).max(-1)
    assert speed[:, 33:45].max() <= 1.2 * speed.max()
    assert speed[:, 35].mean() < 1.5 * speed.mean()  # no leap where the second begins
    lengths = np.linalg.norm(
        motion.joints - motion.joints[:, :, np.maximum(motion.parents, 0)], axis=-1
    )
    assert np.ptp(lengths, axis=1).max() < 1e-3
    lowest = motion.joints[..., 1].min(-1)
    assert np.abs(lowest[:, :36].min(1) - lowest[:, 36:].min(1)).max() < 0.15
    facing = np.unwrap(heading(motion.joints, model.skeleton))
    assert np.abs(facing[:, 36] - facing[:, 35]).max() < np.radians(30)


def test_a_step_has_its_own_seed(model: MotionModel) -> None:
    steps = [Step(action="Walk", seconds=2.0, seed=7), Step(action="Jump", seconds=2.0)]
    one, other = (
        perform(model, steps, Take(frames=60, fps=model.fps, seed=seed)) for seed in (1, 2)
    )
    np.testing.assert_allclose(
        one.joints[:24, :, ::2], other.joints[:24, :, ::2], atol=1e-6
    )  # the ground is the whole clip's
    assert np.abs(one.joints[24:] - other.joints[24:]).max() > 0.05


def test_a_file_of_steps(tmp_path: Path) -> None:
    vocabulary = Vocabulary.of(MotionModel.load("cmu-fine").card)
    path = tmp_path / "t.yaml"
    path.write_text(
        "- {action: stroll, style: slowly, seconds: 2}\n- {action: jump, frames: 15, seed: 3, "
        "speed: 1.5}\n"
    )
    steps, matches = read_timeline(path, vocabulary)
    assert steps == [
        Step(action="Walk slowly", seconds=2),
        Step(action=matches[1].action, frames=15, seed=3, speed=1.5),
    ]
    for text, words in (
        ("walk", "list of steps"),
        ("- walk", "step 1 of"),
        ("- {action: walk, time: 2}", "unknown entry"),
        ("- {action: walk, seconds: two}", "expected a number"),
        ("- {action: walk, seconds: 2, frames: 3}", "both seconds"),
        ("- {action: transcendence}", "none of the actions that are known"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=words):
            read_timeline(path, vocabulary)


def test_too_much_or_nothing_is_refused(model: MotionModel) -> None:
    with pytest.raises(InputError, match="no action"):
        perform(model, [], Take(frames=60, fps=model.fps))
    with pytest.raises(InputError, match="at most"):
        perform(model, [Step(action="Walk", seconds=600.0)] * 3, Take(frames=60, fps=model.fps))


def test_a_clip_knows_when_its_actions_begin(model: MotionModel) -> None:
    steps = [
        Step(action="Walk", seconds=2.0),
        Step(action="Jump", frames=15),
        Step(action="Dance", seconds=1.0),
    ]
    made = perform(model, steps, Take(frames=60, fps=30.0, seed=3), speed=1.5)
    assert made.action_starts is not None
    np.testing.assert_allclose(made.action_starts, [0.0, 2.0, 2.5])
    assert perform(model, steps[:1], Take(frames=60, fps=30.0)).action_starts is None


def test_a_timeline_has_layers_and_other_wishes(tmp_path) -> None:
    from a2v.motion.plan import plan_motion
    from a2v.motion.timeline import Take

    file = tmp_path / "t.yaml"
    file.write_text(
        "- {action: walk, over: wave, distance: 3, look: camera}\n"
        "- {action: clap, count: 4}\n"
        "- {action: jump, still: 'arms, head', in_place: true}\n"
    )
    plan = plan_motion(timeline=file)
    first, second, third = (step.wishes for step in plan.steps)
    assert (first.over, first.over_source, first.distance, first.look) == (
        "Wave",
        "clips",
        3,
        "camera",
    )
    assert second.count == 4
    assert third.still == ("arms", "head")
    assert third.in_place
    assert all(told.kept for match in plan.matches for told in match.told)
    motion = plan.make(Take(frames=round(plan.seconds * 30), fps=30))
    assert motion.provenance["look"] == ["camera", "", ""]
    assert motion.root[round(motion.action_starts[1] * 30), 2] == pytest.approx(3, abs=0.35)
    file.write_text("- {action: walk, side: top}\n")
    with pytest.raises(InputError, match="side is 'top'; choose from left"):
        plan_motion(timeline=file)
    file.write_text("- {action: walk, in_place: 3}\n")
    with pytest.raises(InputError, match="expected true or false"):
        plan_motion(timeline=file)
