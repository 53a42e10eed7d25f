"""People and parts that the pose detector does not find at once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from a2v.kinematics.names import LANDMARK_INDEX, MIRRORED_BLAZEPOSE
from a2v.perception import decode_photo
from a2v.perception.detector import Detection, Detector
from a2v.perception.locate import completed, without_false
from a2v.perception.segmenter import may_lack_parts, missing_parts, probability_of_people

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"


@pytest.fixture(scope="module")
def photo() -> np.ndarray:
    """The sample photograph, (512, 512, 3)."""
    return cv2.resize(
        decode_photo(SAMPLE.read_bytes())[..., :3], (512, 512), interpolation=cv2.INTER_AREA
    )


@pytest.fixture(scope="module")
def person(photo: np.ndarray) -> Detection:
    with Detector() as detector:
        found = detector.one(photo)
    assert found is not None
    return found


def iou(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / (a | b).sum())


def test_a_mirrored_detection_is_that_of_the_mirrored_picture(
    photo: np.ndarray, person: Detection
) -> None:
    with Detector() as detector:
        other = detector.one(photo[:, ::-1])
    assert other is not None
    back = other.mirrored()
    assert iou(back.mask > 0.5, person.mask > 0.5) > 0.97
    seen = person.keypoints[:, 2] > 0.7
    assert (
        np.median(np.linalg.norm(back.keypoints[seen, :2] - person.keypoints[seen, :2], axis=1)) < 6
    )
    assert (
        np.median(
            np.linalg.norm(
                back.keypoints[seen, :2] - person.keypoints[MIRRORED_BLAZEPOSE][seen, :2], axis=1
            )
        )
        > 12
    )
    np.testing.assert_array_equal(back.mirrored().keypoints_3d, other.keypoints_3d)


def test_who_is_not_found_at_once_is_found_in_a_wider_picture(
    photo: np.ndarray, person: Detection
) -> None:
    matrix = cv2.getRotationMatrix2D((256, 256), 0, 2.0)
    large = cv2.warpAffine(photo, matrix, (512, 512), borderMode=cv2.BORDER_REPLICATE)
    truth = cv2.warpAffine(person.mask, matrix, (512, 512)) > 0.5
    with Detector() as detector:
        assert detector.one(large) is None  # this case needs the segmenter
        found = detector.people(large)
    assert len(found) == 1
    assert found[0].mask.shape == (512, 512)
    assert iou(found[0].mask > 0.5, truth) > 0.9


def test_legs_that_the_mask_lacks_are_added(photo: np.ndarray, person: Detection) -> None:
    hips = int(
        person.keypoints[[LANDMARK_INDEX["left_hip"], LANDMARK_INDEX["right_hip"]], 1].mean()
    )
    cut = person.mask.copy()
    cut[hips + 20 :] = 0
    half = replace(person, mask=cut)
    assert may_lack_parts(half)
    assert not may_lack_parts(person)
    with Detector() as detector:
        whole = completed(detector, photo, half, None)
        assert completed(detector, photo, person, None) is person
        other = np.zeros_like(cut, bool)
        other[hips:] = True
        assert completed(detector, photo, half, other) is half  # those are somebody else's legs
    assert iou(cut > 0.5, person.mask > 0.5) < 0.7
    assert iou(whole.mask > 0.5, person.mask > 0.5) > 0.93


def test_both_segmenters_see_the_person(photo: np.ndarray, person: Detection) -> None:
    probability = probability_of_people(photo)
    assert probability.shape == photo.shape[:2]
    assert iou(probability > 0.5, person.mask > 0.5) > 0.85


def test_a_doubted_detection_of_the_background_is_dropped(
    photo: np.ndarray, person: Detection
) -> None:
    def doubted(detection: Detection, confidence: float) -> Detection:
        keypoints = detection.keypoints.copy()
        keypoints[:, 2] = confidence
        return replace(detection, keypoints=keypoints)

    curtain = replace(person, mask=(person.mask < 0.01).astype(np.float32))
    false = doubted(curtain, 0.5)
    assert false.area > person.area
    assert without_false([false, person], photo) == [person]
    # each kind of evidence alone keeps a detection, and the last detection stays
    for kept in (doubted(curtain, 0.9), doubted(person, 0.5)):
        assert without_false([kept, person], photo) == [kept, person]
    assert without_false([false], photo) == [false]
    assert without_false([false, false], photo) == [false, false]


def _scene(sure: float = 1.0, *, away: int = 0, wide: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """A mask of a trunk with one leg, and probabilities of people with two legs.

    The other leg is `away` pixels farther down.
    """
    mask, probability = np.zeros((300, 200), np.float32), np.zeros((300, 200), np.float32)
    mask[40:160, 60:140] = 1
    mask[160:260, 60:90] = 1
    probability[mask > 0] = 1
    probability[160 + away : 260 + away, 140 - wide : 140] = sure
    return mask, probability


def test_only_large_near_and_sure_pieces_are_missing() -> None:
    mask, probability = _scene()
    missing = missing_parts(mask, probability, None)
    assert iou(missing, (probability > 0.5) & (mask < 0.5)) > 0.9
    assert not (missing & (mask > 0.5)).any()
    for other in (_scene(0.8), _scene(away=25), _scene(wide=14)):
        assert not missing_parts(*other, None).any()
    taken = np.zeros(mask.shape, bool)
    taken[160:, 95:] = True
    assert not missing_parts(mask, probability, taken).any()
    assert not missing_parts(np.zeros_like(mask), probability, None).any()
