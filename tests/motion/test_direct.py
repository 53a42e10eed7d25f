"""Paths and poses, with the shipped model that can be directed."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics.ground import ground_path
from a2v.motion import MotionModel
from a2v.motion.direct import Path, follow_path, natural_speed, reach_poses


@pytest.fixture(scope="module")
def model() -> MotionModel:
    return MotionModel.load("cmu-fine")


def away(motion, path: Path) -> np.ndarray:
    """Distance of the root from the path, frame by frame, metres."""
    dense = path.at(np.linspace(0, path.lengths[-1], 2000))
    return np.linalg.norm(motion.root[:, None, [0, 2]] - dense[None], axis=-1).min(1)


PATHS = {
    "straight": np.array([[0, 0], [0, 5.0]]),
    "corner": np.array([[1, 2], [1, 5], [4, 5.0]]),
    "circle": np.stack([2 * (1 - np.cos(np.linspace(0, 5, 50))), 2 * np.sin(np.linspace(0, 5, 50))], axis=-1),
}


@pytest.mark.parametrize("name", PATHS)
def test_a_walk_keeps_to_its_path(model: MotionModel, name: str) -> None:
    path = Path(PATHS[name])
    motion = follow_path(model, "Walk", path, seed=1)
    distance = away(motion, path)
    assert distance.mean() < 0.05
    assert distance.max() < 0.15
    assert np.linalg.norm(motion.root[-1, [0, 2]] - PATHS[name][-1]) < 0.3
    turned = ground_path(motion).smooth(motion.fps).heading
    ahead = path.heading(np.linspace(0, path.lengths[-1], motion.frames))
    off = np.abs(np.angle(np.exp(1j * (turned - ahead))))
    assert np.median(off) < np.radians(15)
    lengths = np.linalg.norm(motion.joints - motion.joints[:, np.maximum(motion.parents, 0)], axis=-1)
    assert np.ptp(lengths, axis=0).max() < 1e-3


def test_the_same_seed_gives_the_same_motion_and_another_another(model: MotionModel) -> None:
    path = Path(PATHS["straight"])
    first, again, other = (follow_path(model, "Walk", path, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.joints, again.joints)
    assert np.abs(first.joints - other.joints[: first.frames]).max() > 0.05


def test_speed_is_what_was_asked_for(model: MotionModel) -> None:
    motion = follow_path(model, "Walk", Path(PATHS["straight"]), speed=1.0)
    assert abs(motion.frames / motion.fps - 5.0) < 0.3
    assert natural_speed(model, "Walk slowly") < natural_speed(model, "Jog")


def test_given_poses_are_reached(model: MotionModel) -> None:
    one, other = (model.sample("Walk", frames=60, seed=seed) for seed in (3, 5))
    goal = other.joints[30] - other.joints[30, 0] * (1, 0, 1) + (0.3, 0, 1.5)
    motion = reach_poses(model, "Walk", {0: one.joints[0], 40: goal}, frames=60)
    assert np.linalg.norm(motion.joints[40] - goal, axis=-1).max() < 0.02
    assert np.linalg.norm(motion.joints[0] - one.joints[0], axis=-1).max() < 0.02


def test_what_cannot_be_directed_says_so(model: MotionModel) -> None:
    with pytest.raises(InputError, match="cannot be directed"):
        follow_path(MotionModel.load("humanact12"), "walk", Path(PATHS["straight"]))
    with pytest.raises(InputError, match="needs an action that travels"):
        follow_path(model, "Wash windows", Path(PATHS["straight"]), speed=0.0)
    with pytest.raises(InputError, match="the same"):
        Path(np.array([[0, 0], [0, 0.0]]))
    with pytest.raises(InputError, match="expected 2 to"):
        Path(np.zeros((1, 2)))
    with pytest.raises(InputError, match="within one window"):
        reach_poses(model, "Walk", {0: np.zeros((20, 3))}, frames=500)
