"""In place, loops, mirror, speed: on clips of the shipped model."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.animation import retarget
from a2v.body import load_body_model, make_body
from a2v.errors import InputError
from a2v.kinematics.ground import ground_trajectory
from a2v.kinematics.resample import resample_motion
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.edit import (
    Edit,
    change_speed,
    edited,
    make_loop,
    mirror_motion,
    put_in_place,
    repeat_loop,
)
from a2v.motion.on_rig import retarget_edited
from a2v.motion.prompts import Step
from a2v.motion.settling import air_seconds, rises, settle
from a2v.motion.timeline import Take
from a2v.types import Motion
from tests.support.motions import person


def sampled(action: str, seed: int = 0, fps: float = 30.0) -> Motion:
    made = MotionModel.load("cmu").sample([action], frames=60, seed=seed)
    return resample_motion(made[0] if made.batch else made, fps)


def acceleration(joints: np.ndarray, fps: float) -> np.ndarray:
    return np.linalg.norm(np.diff(joints.astype(np.float64), n=2, axis=0), axis=-1) * fps**2


@pytest.mark.parametrize("action", ["Walk", "Run", "Jump", "Animal Behavior"])
def test_a_loop_closes(action: str) -> None:
    clip = sampled(action)
    loop = make_loop(clip, in_place=True)
    rounds = np.concatenate([loop.joints] * 20)
    seam = acceleration(rounds, loop.fps)[loop.frames - 2 : loop.frames]
    assert np.percentile(seam, 95) <= 1.2 * np.percentile(acceleration(clip.joints, clip.fps), 95)
    step = np.linalg.norm(np.diff(rounds[:, 0, [0, 2]], axis=0), axis=-1)
    assert step[loop.frames - 1] <= 1.5 * step[: loop.frames - 1].max() + 1e-3
    assert (
        np.abs(rounds[-loop.frames, 0] - rounds[0, 0]).max() < 0.01
    )  # no drift after nineteen rounds
    lengths = np.linalg.norm(loop.joints - loop.joints[:, np.maximum(loop.parents, 0)], axis=-1)
    assert np.ptp(lengths, axis=0).max() < 1e-4


@pytest.mark.parametrize("action", ["Run and duck", "Crossover walk"])
def test_a_loop_in_place_of_somebody_who_turns_closes(action: str) -> None:
    loop = make_loop(
        make_motion(
            MotionModel.load("cmu-fine"), [Step(action=action)], Take(frames=150, fps=30.0)
        ),
        in_place=True,
    )
    twice = np.concatenate([loop.joints] * 2)
    root = acceleration(twice[:, :1], loop.fps)[:, 0]
    assert root[loop.frames - 2 : loop.frames].max() <= root[: loop.frames - 2].max()


def test_a_cycle_of_somebody_who_first_stands_moves() -> None:
    walk = sampled("Walk")
    stands = {
        name: np.concatenate([np.repeat(getattr(walk, name)[:1], 40, axis=0), getattr(walk, name)])
        for name in ("joints", "rotations", "root")
    }
    clip = dataclasses.replace(walk, **stands)
    speed = [
        np.linalg.norm(np.diff(motion.joints, axis=0), axis=-1).mean(-1)
        for motion in (clip, make_loop(clip))
    ]
    assert speed[0][:15].mean() < 0.3 * speed[0].max()
    assert speed[1].mean() > speed[0].mean()


def test_a_loop_that_travels_goes_on() -> None:
    loop = make_loop(sampled("Walk"))
    path = ground_trajectory(loop)
    assert np.linalg.norm(path.position[-1] - path.position[0]) > 0.3


def test_rounds_of_a_loop_go_on_from_one_another() -> None:
    loop = make_loop(sampled("Walk"))
    rounds = repeat_loop(loop, 3)
    np.testing.assert_array_equal(rounds.joints[: loop.frames], loop.joints)
    steps = np.linalg.norm(np.diff(rounds.root, axis=0), axis=-1)
    assert steps[loop.frames - 1] <= 1.3 * steps[: loop.frames - 1].max()
    away = np.linalg.norm(
        rounds.root[[loop.frames, -1]][:, [0, 2]] - rounds.root[0, [0, 2]], axis=-1
    )
    assert away[1] > 2 * away[0]


@pytest.mark.parametrize("in_place", [False, True])
def test_a_loop_closes_on_a_rig_whose_feet_were_cleaned_on_the_way(in_place: bool) -> None:
    body = make_body(load_body_model(), grounded=True)
    loop = edited(sampled("Walk", seed=2), Edit(loop=True))
    moves = retarget_edited(loop, body, Edit(loop=True, in_place=in_place))
    assert len(moves) == loop.frames
    where = moves[:, 0, :3, 3]
    travelled = np.linalg.norm(where[-1, [0, 2]] - where[0, [0, 2]])
    assert (travelled < 0.05) == in_place
    if in_place:
        rounds = np.concatenate([moves[..., :3, 3]] * 2)
        accelerations = acceleration(rounds, loop.fps)
        each = np.percentile(
            accelerations[: loop.frames], 95, axis=1
        )  # of a frame: a foot may be set down just where the clip repeats
        assert each[-2:].max() <= each[:-2].max()
    else:
        plain = retarget(loop, body)
        np.testing.assert_allclose(where[0, [0, 2]], plain[0, 0, [0, 2], 3], atol=0.02)


def test_a_clip_that_is_too_short_is_refused() -> None:
    with pytest.raises(InputError, match="too few for a loop"):
        make_loop(sampled("Walk").first(20))


def test_in_place_keeps_the_sway_and_takes_the_travel() -> None:
    clip = sampled("Walk")
    still = put_in_place(clip)
    travelled = np.linalg.norm(clip.root[-1, [0, 2]] - clip.root[0, [0, 2]])
    assert travelled > 1
    assert np.abs(still.root[:, [0, 2]]).max() < 0.15
    assert np.ptp(still.root[:, 0]) > 0.005
    np.testing.assert_allclose(still.root[:, 1], clip.root[:, 1], atol=1e-5)
    heading = ground_trajectory(still).heading
    assert np.abs(heading - heading.mean()).max() < np.radians(30)


def test_mirroring_twice_changes_nothing_and_once_changes_sides() -> None:
    clip = sampled("Walk")
    once = mirror_motion(clip)
    np.testing.assert_array_equal(mirror_motion(once).joints, clip.joints)
    left, right = (clip.joint_names.index(name) for name in ("left_knee", "right_knee"))
    np.testing.assert_allclose(once.joints[:, left], clip.joints[:, right] * (-1, 1, 1), atol=1e-6)


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_speed_changes_time_alone(speed: float) -> None:
    clip = sampled("Walk")
    other = change_speed(clip, speed)
    assert other.fps == clip.fps
    assert abs(other.frames - clip.frames / speed) <= 2
    np.testing.assert_allclose(other.joints[-1], clip.joints[-1], atol=0.05)


def test_a_path_stays_what_it_is_where_it_is_straight() -> None:
    clip = sampled("Walk")
    path = ground_trajectory(clip)
    straight = type(path)(np.stack([np.arange(60) * 0.1, np.zeros(60)], axis=-1), np.zeros(60))
    np.testing.assert_allclose(straight.smooth(30).position, straight.position, atol=1e-9)


def test_a_clip_that_rises_is_brought_down_and_its_jumps_stay():
    motion = person(frames=60, step=0.05)
    clock = np.arange(60) / motion.fps
    jump = 0.4 * np.maximum(0, 1 - (10 * (clock - 3.0) / 4) ** 2)  # in the air for .8 s
    raised = (0.1 * clock + jump)[:, None] * np.float32([0, 1, 0])
    floating = dataclasses.replace(
        motion,
        joints=motion.joints + raised[:, None].astype(np.float32),
        root=motion.root + raised.astype(np.float32),
    )
    settled = settle(floating, seconds=1.2)
    lowest = settled.joints[..., 1].min(axis=1) - motion.joints[..., 1].min(axis=1)
    on_ground = jump == 0
    assert lowest.min() > -1e-5
    assert lowest[on_ground].max() < 0.15 < 0.55 < raised[on_ground, 1].max()
    assert lowest[30] > 0.3
    np.testing.assert_allclose(
        settled.joints[:, 0] - settled.root, motion.joints[:, 0] - motion.root, atol=1e-5
    )
    np.testing.assert_allclose(settle(motion).joints, motion.joints, atol=1e-6)


def test_climbing_may_rise():
    fine, coarse = (MotionModel.load(name).card for name in ("cmu-fine", "cmu"))
    assert rises(fine, "Climb stairs")
    assert rises(coarse, "Step")
    assert not any(rises(card, "Walk") for card in (fine, coarse))
    assert not rises(fine, "Salsa")
    assert (
        air_seconds(fine, "Salsa")
        < 0.35
        < air_seconds(fine, "Hopscotch")
        == air_seconds(coarse, "Jump")
    )
