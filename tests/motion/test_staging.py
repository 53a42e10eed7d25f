"""Clips as they are shown, and steps with wishes."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics.ground import ground_trajectory
from a2v.lab.evaluation.physics import contact_speeds
from a2v.motion.clips import clip_library
from a2v.motion.direction import Direction
from a2v.motion.plan import make_steps, plan_motion
from a2v.motion.staging import LEAST_SECONDS, Play, clip_seconds, staged
from a2v.motion.timeline import Take
from a2v.motion.ways import GroundPath
from a2v.types import FloatArray, Motion

NAMES = clip_library().skeleton.joint_names


def made(words: str, seed: int = 0) -> Motion:
    plan = plan_motion(words)
    return plan.make(Take(frames=round((plan.seconds or 4) * 30), fps=30, seed=seed))


def joint(motion: Motion, name: str) -> FloatArray:
    return motion.joints[:, NAMES.index(name)].astype(np.float64)


def speeds(motion: Motion) -> FloatArray:
    return np.linalg.norm(np.diff(motion.joints, axis=0), axis=-1).max(axis=1) * 30


@pytest.mark.parametrize("name", ["Kick", "Hit in the chest", "Wave", "Sit down", "Land"])
def test_one_shots_are_seen_and_do_not_freeze(name: str) -> None:
    assert clip_seconds(name) >= LEAST_SECONDS
    speed = speeds(staged(name, Play(frames=150, fps=30)))
    assert speed[-15:].max() > 0.005


@pytest.mark.parametrize("name", ["Idle", "Sit", "Listen", "Nod", "Hold a sword"])
def test_who_stands_or_sits_lives(name: str) -> None:
    assert speeds(staged(name, Play(frames=150, fps=30))).max() > 0.3
    one, other = (staged(name, Play(frames=90, fps=30, seed=seed)).joints for seed in (1, 2))
    assert np.linalg.norm(one - other, axis=-1).mean() > 0.005


@pytest.mark.parametrize("name", ["Idle", "Walking cycle", "Crouch walk", "Two-handed chop"])
def test_feet_stay_in_place_and_bones_keep_their_lengths(name: str) -> None:
    motion = staged(name, Play(frames=120, fps=30))
    feet = np.stack([joint(motion, "ball_l"), joint(motion, "ball_r")], axis=1)
    assert np.median(contact_speeds(feet, 30)) < 0.1
    bones = motion.joints[:, 1:] - motion.joints[:, motion.parents[1:]]
    assert np.abs(np.linalg.norm(bones, axis=-1) - clip_library().lengths[1:]).max() < 2e-3


def test_cycles_that_close_stay_closed_with_life() -> None:
    loop = staged("Idle", Play(frames=120, fps=30, cycles=2)).joints
    step = np.abs(np.diff(loop, axis=0)).max()
    assert np.abs(loop[0] - loop[-1]).max() < 2 * step + 2e-3


def test_ways_angles_and_counts_are_kept() -> None:
    assert made("walk 4 meters").root[-1, 2] == pytest.approx(4, abs=0.25)
    for words, angle in (("turn left 90 degrees", 90), ("turn right 180 degrees", -180)):
        heading = np.degrees(ground_trajectory(made(words)).heading)
        assert heading[-1] - heading[0] == pytest.approx(angle, abs=5)
    jogged = made("run at 3 m/s").root
    assert np.linalg.norm(jogged[-1] - jogged[0]) == pytest.approx(
        3 * (len(jogged) - 1) / 30, rel=0.08
    )
    raised = joint(made("wave three times"), "hand_r")[:, 1] > 1.4
    assert np.diff(raised.astype(int), prepend=0).clip(0).sum() >= 3
    low = made("do 4 squats").root[:, 1]
    assert (np.diff((low < low.max() - 0.2).astype(int)) > 0).sum() == 4


def test_sides_are_kept() -> None:
    for side, high in (("left", "hand_l"), ("right", "hand_r")):
        motion = made(f"wave with the {side} hand")
        other = "hand_r" if high == "hand_l" else "hand_l"
        assert joint(motion, high)[:, 1].max() > joint(motion, other)[:, 1].max() + 0.3


def test_a_layer_leaves_the_legs_and_brings_the_arms() -> None:
    layered, other = made("walk while waving"), made("walk while pointing")
    assert joint(layered, "hand_r")[:, 1].max() > 1.3
    for name in ("foot_l", "foot_r", "calf_l", "pelvis"):
        np.testing.assert_allclose(joint(layered, name), joint(other, name), atol=1e-5)
    assert np.abs(joint(layered, "hand_r") - joint(other, "hand_r")).max() > 0.3
    still = made("walk without moving the arms")
    wrist = joint(still, "hand_l") - joint(still, "upperarm_l")
    assert np.linalg.norm(wrist - wrist[20], axis=-1)[20:].max() < 0.35


def test_clips_follow_a_path() -> None:
    plan = plan_motion("Walking cycle", directed=True)
    path = GroundPath(np.array([[0.0, 0.0], [0.0, 3.0], [3.0, 3.0]]))
    take = Take(frames=60, fps=30)
    motion = make_steps(None, plan.steps, take, direction=Direction(path=path))
    assert np.abs(motion.root[-1, [0, 2]] - [3, 3]).max() < 0.3
    turned = make_steps(None, plan_motion("Wave").steps, take, direction=Direction(heading=1.5))
    assert ground_trajectory(turned).heading[20] == pytest.approx(1.5, abs=0.15)
    with pytest.raises(InputError, match="a path needs an action that travels"):
        make_steps(None, plan_motion("Wave").steps, take, direction=Direction(path=path))
