"""Landmarks of hands are found on their own side, in the photo's pixels, and only on hands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from a2v.kinematics.names import LANDMARK_INDEX
from a2v.perception.hands import find_hands

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"


@pytest.fixture(scope="module")
def photo() -> np.ndarray:
    with Image.open(SAMPLE) as picture:
        return np.asarray(picture.convert("RGB"))


@pytest.fixture(scope="module")
def keypoints(photo: np.ndarray) -> np.ndarray:
    from a2v.perception.detector import Detector

    with Detector() as detector:
        found = detector.one(photo)
    assert found is not None
    return found.keypoints


def test_both_hands_of_the_sample(photo: np.ndarray, keypoints: np.ndarray) -> None:
    hands = find_hands(photo, keypoints)
    assert hands is not None
    assert hands[:, :, 3].min() == 1
    for hand, side in zip(hands, ("left", "right"), strict=True):
        knuckles = keypoints[
            [LANDMARK_INDEX[f"{side}_index"], LANDMARK_INDEX[f"{side}_pinky"]], :2
        ].mean(axis=0)
        length = np.linalg.norm(hand[0, :2] - hand[12, :2])
        assert np.linalg.norm(hand[[5, 9, 13, 17], :2].mean(axis=0) - knuckles) < 0.4 * length
        assert hand[0, 2] == pytest.approx(0, abs=0.5)
    # his thumbs hang in front of his curved fingers: nearer to the trunk than these
    trunk = keypoints[[LANDMARK_INDEX["left_hip"], LANDMARK_INDEX["right_hip"]], 0].mean()
    assert (np.abs(hands[:, 4, 0] - trunk) < np.abs(hands[:, 12, 0] - trunk)).all()


def test_pixels_are_the_photos_wherever_the_person_stands(
    photo: np.ndarray, keypoints: np.ndarray
) -> None:
    shift = np.array([120, 60])
    moved = np.zeros((photo.shape[0] + 60, photo.shape[1] + 120, 3), np.uint8)
    moved[60:, 120:] = photo
    points = keypoints + np.float32([*shift, 0])
    first, second = find_hands(photo, keypoints), find_hands(moved, points)
    assert first is not None
    assert second is not None
    assert np.abs(second[..., :2] - first[..., :2] - shift).max() < 3


def test_no_hand_is_none(photo: np.ndarray, keypoints: np.ndarray) -> None:
    unseen = keypoints.copy()
    unseen[15:23, 2] = 0.1
    assert find_hands(photo, unseen) is None
    assert find_hands(np.full_like(photo, 128), keypoints) is None
    small = keypoints * np.float32([0.1, 0.1, 1])
    assert find_hands(photo, small) is None
