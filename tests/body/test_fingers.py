"""Fingers bend as landmarks show them and relax without them; the rest of the body is unchanged."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body import bend_fingers
from a2v.body.fingers import _Hand
from a2v.types import Body, OrthographicCamera
from tests.support.subjects import blank_subject

CAMERA = OrthographicCamera(scale=600.0, center_u=600.0, center_v=1100.0)
LETTERS = (".L", ".R")


def landmarks(points: np.ndarray) -> np.ndarray:
    """Return what the detector would see of points (21, 3), meters."""
    seen = np.ones((21, 4), np.float32)
    seen[:, :2] = CAMERA.project(points)
    seen[:, 2] = CAMERA.scale * (points[:, 2] - points[0, 2])
    return seen


def points_of(body: Body, letter: str) -> np.ndarray:
    """The 21 landmarks of a body's hand."""
    hand = _Hand(body, letter)
    return hand.points(body.bone_transforms.astype(np.float64), np.zeros((1, 18)))[0]


@pytest.mark.parametrize("fist", [0.2, 0.7, 1.0])
def test_landmarks_bend_fingers(body: Body, fist: float) -> None:
    wanted = np.zeros((2, 21, 4), np.float32)
    places = []
    for row, letter in enumerate(LETTERS):
        hand = _Hand(body, letter)
        angles = hand.middle.copy()
        angles[3:15:3], angles[4:15:3] = 1.1 * fist, 1.5 * fist
        angles[:3] = [0.1, -0.15, 0.1]
        places.append(hand.points(body.bone_transforms.astype(np.float64), angles[None])[0])
        wanted[row] = landmarks(places[-1])
    bent = bend_fingers(body, blank_subject(hands=wanted), CAMERA)
    for letter, there in zip(LETTERS, places, strict=True):
        off = np.linalg.norm(points_of(bent, letter) - there, axis=1)
        straight = np.linalg.norm(points_of(body, letter) - there, axis=1)
        assert off.mean() < 0.006
        assert off.mean() < 0.4 * straight.mean()


def test_an_unseen_hand_is_relaxed(body: Body) -> None:
    wanted = np.zeros((2, 21, 4), np.float32)
    wanted[0] = landmarks(points_of(body, ".L"))
    both, left = (
        bend_fingers(body, blank_subject(hands=None), CAMERA),
        bend_fingers(body, blank_subject(hands=wanted), CAMERA),
    )
    right = [
        body.bone_names.index(f"finger{finger}-{joint}.R")
        for finger in range(1, 6)
        for joint in (1, 2, 3)
    ]
    assert both.bone_transforms[right] == pytest.approx(left.bone_transforms[right], abs=1e-6)
    spread = [
        np.linalg.norm(points_of(made, ".R")[8] - points_of(made, ".R")[20])
        for made in (body, both)
    ]
    assert spread[1] < 0.8 * spread[0]  # index and little finger come together
    hand = _Hand(body, ".R")
    towards_the_palm = (
        points_of(both, ".R")[[8, 12, 16, 20]] - points_of(body, ".R")[[8, 12, 16, 20]]
    ) @ hand.palm
    assert towards_the_palm.min() > 0.02


def test_only_hands_move_and_the_skin_follows_its_bones(body: Body) -> None:
    bent = bend_fingers(body, blank_subject(hands=None), CAMERA)
    moved = np.linalg.norm(bent.vertices - body.vertices, axis=1)
    hands = [
        bone
        for bone, name in enumerate(body.bone_names)
        if name.startswith(("wrist", "finger", "metacarpal"))
    ]
    share = body.weights[:, hands].sum(axis=1)
    assert moved[share < 1e-6].max() < 1e-5
    tip = body.bone_names.index("finger2-3.L")
    skin = body.weights[:, tip] > 0.99
    change = bent.bone_transforms[tip] @ np.linalg.inv(body.bone_transforms[tip])
    assert bent.vertices[skin] == pytest.approx(
        body.vertices[skin] @ change[:3, :3].T + change[:3, 3], abs=1e-4
    )
    assert np.linalg.det(bent.bone_transforms[:, :3, :3]) == pytest.approx(1, abs=1e-4)


def test_another_body_keeps_its_hands(body: Body) -> None:
    other = dataclasses.replace(body, model="smpl")
    assert bend_fingers(other, blank_subject(hands=None), CAMERA) is other
