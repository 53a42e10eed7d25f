"""Paths, keyframes, headings and held joints, with the shipped model that can be directed."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics.ground import ground_trajectory, heading
from a2v.lab.evaluation.physics import physics_metrics
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion, natural_speed
from a2v.motion.direction import Direction, Hold, Keyframe
from a2v.motion.edit import Edit
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.motion.ways import GroundPath, way_along
from a2v.types import Motion

WALK = [Step(action="Walk")]


@pytest.fixture(scope="module")
def model() -> MotionModel:
    return MotionModel.load("cmu-fine")


def directed(
    model: MotionModel, *, steps=WALK, frames: int = 150, fps: float = 30.0, seed: int = 1, **asked
) -> Motion:
    return make_motion(
        model, steps, Take(frames=frames, fps=fps, seed=seed), direction=Direction(**asked)
    )


def away(motion: Motion, path: GroundPath) -> np.ndarray:
    """Distance of the root from the path, frame by frame, meters."""
    dense = path.at(np.linspace(0, path.lengths[-1], 2000))
    return np.linalg.norm(motion.root[:, None, [0, 2]] - dense[None], axis=-1).min(1)


PATHS = {
    "straight": np.array([[0, 0], [0, 5.0]]),
    "corner": np.array([[1, 2], [1, 5], [4, 5.0]]),
    "circle": np.stack(
        [2 * (1 - np.cos(np.linspace(0, 5, 50))), 2 * np.sin(np.linspace(0, 5, 50))], axis=-1
    ),
}


@pytest.mark.parametrize("name", PATHS)
def test_a_walk_keeps_to_its_path_and_its_feet_to_the_ground(model: MotionModel, name: str) -> None:
    path = GroundPath(PATHS[name])
    motion = directed(model, path=path)
    distance = away(motion, path)
    assert distance.mean() < 0.05
    assert distance.max() < 0.15
    assert np.linalg.norm(motion.root[-1, [0, 2]] - PATHS[name][-1]) < 0.15
    turned = ground_trajectory(motion).smooth(motion.fps)
    way = np.diff(turned.position, axis=0)
    off = turned.heading[1:] - np.arctan2(way[:, 0], way[:, 1])
    assert np.median(np.abs(np.angle(np.exp(1j * off)))) < np.radians(15)
    lengths = np.linalg.norm(
        motion.joints - motion.joints[:, np.maximum(motion.parents, 0)], axis=-1
    )
    assert np.ptp(lengths, axis=0).max() < 1e-3
    free = make_motion(
        model, [Step(action="Walk", frames=motion.frames)], Take(frames=60, fps=30, seed=1, count=4)
    )
    ours, theirs = (physics_metrics(one, floor=None) for one in (motion, free))
    assert ours.contact_slide < 0.2
    assert theirs.contact_slide < 0.1
    assert ours.jitter < 1.5 * theirs.jitter


def test_who_jogs_round_a_bend_does_not_slide(model: MotionModel) -> None:
    ours = []
    for seed in (0, 1):
        made = make_motion(
            model,
            [Step(action="Jog")],
            Take(frames=60, fps=30, seed=seed),
            direction=Direction(path=GroundPath(PATHS["circle"])),
        )
        ours.append(physics_metrics(made, floor=None).contact_slide)
    assert np.mean(ours) < 0.5  # the root keeps its path


def test_a_corner_is_taken_slowly_by_who_is_fast() -> None:
    path = GroundPath(PATHS["corner"])
    for pace, least in ((1.0, 0.5), (3.0, 0.9)):
        way = way_along(path, pace=pace, fps=30)
        speed = np.linalg.norm(np.diff(way.points, axis=0), axis=-1) * 30
        assert speed.max() < 1.02 * pace
        assert speed.min() < least
        assert np.abs(np.diff(speed)).max() * 30 < 6
        assert np.abs(np.diff(way.heading)).max() < np.radians(12)


def test_the_same_seed_gives_the_same_motion_and_another_another(model: MotionModel) -> None:
    path = GroundPath(PATHS["straight"])
    first, again, other = (directed(model, path=path, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.joints, again.joints)
    assert np.abs(first.joints - other.joints[: first.frames]).max() > 0.05


def test_pace_tempo_and_rate_are_what_was_asked_for(model: MotionModel) -> None:
    path = GroundPath(PATHS["straight"])
    assert abs(directed(model, path=path, pace=1.0).frames / 30 - 5) < 0.3
    quick = make_motion(
        model,
        WALK,
        Take(frames=9, fps=24),
        edit=Edit(speed=2.0),
        direction=Direction(path=path, pace=1.0),
    )
    assert abs(quick.frames / 24 - 2.5) < 0.2
    assert natural_speed(model, "Walk slowly") < natural_speed(model, "Jog")


def test_a_heading_is_kept_along_a_path_that_leads_elsewhere(model: MotionModel) -> None:
    motion = directed(
        model,
        steps=[Step(action="Walk sideways")],
        path=GroundPath(np.array([[0, 0], [3.0, 0]])),
        heading=0.0,
    )
    assert away(motion, GroundPath(np.array([[0, 0], [3.0, 0]]))).max() < 0.15
    assert np.abs(heading(motion.joints, model.skeleton)).mean() < np.radians(20)


def test_given_poses_are_reached_in_any_window(model: MotionModel) -> None:
    one, other = (model.sample("Walk", frames=60, seed=seed) for seed in (3, 5))
    near, far = (
        other.joints[30] - other.joints[30, 0] * (1, 0, 1) + (0.3, 0, away) for away in (3.0, 9.0)
    )
    keys = (
        Keyframe(time=0, joints=one.joints[0]),
        Keyframe(time=3, joints=near),
        Keyframe(time=0.5, to_end=True, joints=far),
    )
    motion = directed(model, frames=361, keyframes=keys)
    for frame, pose in ((0, one.joints[0]), (90, near), (345, far)):
        assert np.linalg.norm(motion.joints[frame] - pose, axis=-1).max() < 0.02
    speed = np.linalg.norm(np.diff(motion.joints, axis=0), axis=-1).max(-1) * 30
    assert speed.max() < 10  # no leap towards a pose
    lowest = motion.joints[..., 1].min(-1)
    assert np.quantile(lowest, 0.95) < 0.12
    assert np.quantile(lowest, 0.05) > -0.05


def test_places_and_headings_are_reached_on_the_way(model: MotionModel) -> None:
    keys = (Keyframe(time=4, at=(1.0, 3.0)), Keyframe(time=12, at=(4.0, 6.0), heading=np.pi / 2))
    motion = directed(model, frames=391, keyframes=keys)
    for key in keys:
        assert np.linalg.norm(motion.root[round(key.time * 30), [0, 2]] - key.at) < 0.02
    left, right = model.skeleton.hips
    across = motion.joints[360, left] - motion.joints[360, right]
    assert abs(np.arctan2(-across[2], across[0]) - np.pi / 2) < np.radians(2)
    assert np.linalg.norm(np.diff(motion.root[:, [0, 2]], axis=0), axis=-1).max() * 30 < 3


def test_hands_are_held_in_place_and_before_the_body(model: MotionModel) -> None:
    plain = directed(model, heading=0.0)
    wrist = model.skeleton.index("left_wrist")
    at = plain.joints[75, wrist] + (0, 0.15, 0.1)
    held = directed(
        model, holds=(Hold(joint="left_wrist", start=2.2, end=2.8, at=tuple(at)),), heading=0.0
    )
    assert np.linalg.norm(held.joints[66:85, wrist] - at, axis=-1).max() < 0.08
    own = np.array([0.25, 0.3, 0.35])
    carried = directed(
        model, holds=(Hold(joint="left_wrist", start=1, end=4, at=tuple(own), body=True),)
    )
    yaw = heading(carried.joints, model.skeleton)[30:121]
    turned = np.stack(
        [
            np.cos(yaw) * own[0] + np.sin(yaw) * own[2],
            np.full(91, own[1]),
            np.cos(yaw) * own[2] - np.sin(yaw) * own[0],
        ],
        -1,
    )
    off = np.linalg.norm(
        carried.joints[30:121, wrist] - carried.joints[30:121, 0] - turned, axis=-1
    )
    assert np.median(off) < 0.02
    assert off.max() < 0.12  # where the arm is too short


@pytest.mark.parametrize(("action", "seed"), [("Salsa", 5), ("Salsa", 8), ("Jump", 7)])
def test_several_actions_lead_to_a_pose(model: MotionModel, action: str, seed: int) -> None:
    pose = model.sample("Walk", frames=60, seed=seed).joints[30]
    motion = directed(
        model,
        steps=[Step(action="Walk", seconds=3), Step(action=action, seconds=4)],
        keyframes=(Keyframe(time=6.5, joints=pose),),
    )
    assert np.linalg.norm(motion.joints[195] - pose, axis=-1).max() < 0.02


def test_what_cannot_be_directed_says_so(model: MotionModel) -> None:
    path = GroundPath(PATHS["straight"])
    with pytest.raises(InputError, match="cannot be directed"):
        directed(MotionModel.load("humanact12"), steps=[Step(action="walk")], path=path)
    with pytest.raises(InputError, match="pace is 0 m/s; expected"):
        directed(model, path=path, pace=0.0)
    with pytest.raises(InputError, match="one action"):
        directed(model, steps=[*WALK, *WALK], path=path)
    with pytest.raises(InputError, match="are equal"):
        GroundPath(np.array([[0, 0], [0, 0.0]]))
    with pytest.raises(InputError, match="expected 2 to"):
        GroundPath(np.zeros((1, 2)))
    with pytest.raises(InputError, match="lasts only 4"):
        directed(model, keyframes=(Keyframe(time=9, at=(0, 1)),))
    with pytest.raises(InputError, match="no joint 'tail'"):
        directed(model, holds=(Hold(joint="tail", start=0, end=1, at=(0, 0, 0)),))
    with pytest.raises(InputError, match="one clip"):
        make_motion(model, WALK, Take(frames=60, fps=30, count=2), direction=Direction(path=path))


def test_what_floats_is_on_the_ground_and_what_climbs_is_not_brought_down(
    model: MotionModel,
) -> None:
    salsa = make_motion(model, [Step(action="Salsa")], Take(frames=150, fps=30, seed=1, count=2))
    assert np.quantile(salsa.joints[..., 1].min(-1), 0.95) < 0.12
    ladder = make_motion(model, [Step(action="Climb a ladder")], Take(frames=150, fps=30, seed=1))
    assert ladder.joints[..., 1].min(-1).max() > 0.3
