"""Fingers of a tracked motion are those of the landmarks; unseen hands are relaxed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.animation.detail import detail_joints
from a2v.footage.figure import NAMES, PARENTS
from a2v.footage.hands import _axes_of, _relaxed, _rest, track_hands, with_hands
from a2v.kinematics import rotvec_to_rotmat
from a2v.types import Motion

FRAMES = 30
TIMES = np.arange(FRAMES) / 30


def hand(side: str, bend: float, turn: np.ndarray) -> np.ndarray:
    """Landmarks (21, 3) of a turned hand; every finger joint is bent by `bend`, radians."""
    rest = _rest(side)
    points = np.zeros((21, 3))
    for finger in range(5):
        at = rest.knuckles[finger]
        points[1 + 4 * finger] = at
        for bone in range(3):
            angle = bend * (bone + 1)
            step = np.array([np.cos(angle), np.sin(angle), 0.0]) if finger else _relaxed()[0, bone]
            at = at + rest.lengths[finger, bone] * step
            points[2 + 4 * finger + bone] = at
    return np.asarray(points @ rest.axes @ turn.T)


def tracked(left: list[np.ndarray | None], turn: np.ndarray, yaw: float = 0.0, tilt: float = 0.0):
    return track_hands(
        [(one, None) for one in left],
        np.tile(turn, (FRAMES, 2, 1, 1)),
        np.full(FRAMES, yaw),
        np.full(FRAMES, tilt),
        TIMES,
    )


@pytest.mark.parametrize("bend", [0.05, 1.2])
def test_bends_are_found_again_whatever_the_wrist_does(bend):
    turn = rotvec_to_rotmat(np.array([0.4, -0.7, 0.3]))
    found = tracked([hand("left", bend, turn) for _ in range(FRAMES)], turn)
    index = found.fingers[15, 0, 1]
    angles = np.arctan2(index[:, 1], index[:, 0])
    assert np.allclose(np.diff(angles, prepend=0) % (2 * np.pi), bend, atol=0.08)
    assert np.allclose(found.axes[15, 0], _rest("left").axes @ turn.T, atol=1e-6)


def test_the_cameras_turn_is_taken_out():
    turn = rotvec_to_rotmat(np.array([0.0, 0.3, 0.0]))
    camera = rotvec_to_rotmat(np.array([0.0, 0.5, 0.0])) @ rotvec_to_rotmat(np.array([-0.2, 0, 0]))
    seen = hand("left", 0.5, camera.T @ turn)
    found = tracked([seen] * FRAMES, turn, yaw=0.5, tilt=0.2)
    assert np.allclose(found.axes[10, 0], _rest("left").axes @ turn.T, atol=1e-6)


def test_a_palm_that_the_wrist_contradicts_is_not_believed():
    found = tracked([hand("left", 0.5, np.diag([-1.0, 1, -1]))] * FRAMES, np.eye(3))
    assert np.allclose(found.axes[:, 0], _rest("left").axes)
    assert np.allclose(found.fingers, _relaxed())


def test_a_hand_that_is_not_seen_any_more_relaxes_and_noise_is_smoothed():
    noise = np.random.default_rng(0).normal(0, 0.004, (FRAMES, 21, 3))
    own = [hand("left", 1.2, np.eye(3)) + step for step in noise]
    found = tracked([*own[:12], *[None] * (FRAMES - 12)], np.eye(3))
    assert np.abs(found.fingers[-1, 0] - _relaxed()).max() < 0.02
    jumps = np.linalg.norm(np.diff(found.fingers[:10, 0, 1, 2], axis=0), axis=-1)
    assert jumps.max() < 0.08
    assert tracked([own[0], *[None] * (FRAMES - 1)], np.eye(3)) is None


def test_the_motion_gets_fingers_that_a_rig_follows():
    hands = tracked([hand("left", 1.0, np.eye(3))] * FRAMES, np.eye(3))
    joints = np.random.default_rng(0).normal(size=(FRAMES, len(NAMES), 3)).astype(np.float32)
    motion = Motion(
        joints=joints,
        rotations=np.zeros_like(joints),
        root=joints[:, 0],
        fps=30,
        parents=np.asarray(PARENTS),
        joint_names=NAMES,
    )
    made = with_hands(motion, hands)
    assert np.array_equal(made.joints[:, : len(NAMES)], joints)
    found = detail_joints(made)
    assert {
        f"{side}_{finger}_4" for side in ("left", "right") for finger in ("thumb", "little")
    } <= set(found)
    lengths = [
        np.linalg.norm(found[f"left_index_{place + 1}"] - found[f"left_index_{place}"], axis=-1)
        for place in (1, 2, 3)
    ]
    assert np.allclose(np.mean(lengths, axis=1), _rest("left").lengths[1], atol=1e-5)
    assert dataclasses.replace(made).frames == FRAMES


def test_axes_are_those_of_a_hand():
    for side in ("left", "right"):
        rest = _rest(side)
        assert np.allclose(rest.axes @ rest.axes.T, np.eye(3))
        assert rest.axes[0, 1] < 0  # arms hang
        assert rest.knuckles[1, 2] > rest.knuckles[4, 2]  # the index is at the thumb's side
        assert np.allclose(_axes_of(hand(side, 0.3, np.eye(3))[None], side)[0], rest.axes)
