"""The bank of poses, similar poses, and fits that look wrong."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body import load_body_model
from a2v.body.confidence import DOUBTFUL, doubts, limb_errors, looks_wrong
from a2v.body.evidence import Evidence
from a2v.body.pose_bank import COMPARED, PoseBank, alike, alike_outline, load_pose_bank
from a2v.body.pose_space import pose_space
from a2v.body.silhouette import mask_field
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import FloatArray

SCALE = 300.0


@pytest.fixture(scope="module")
def bank() -> PoseBank:
    return load_pose_bank(load_body_model())


def turned(points: FloatArray, yaw: float) -> FloatArray:
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    return points @ turn.T


def evidence_of(points: FloatArray, *, depth: bool = True) -> Evidence:
    """Return a photo of landmarks `COMPARED` (C, 3)."""
    index = [LANDMARK_INDEX[name] for name in COMPARED]
    pixels, confidence, told = np.zeros((33, 2)), np.zeros(33), np.full((33, 3), np.nan)
    pixels[index] = 500 + SCALE * points[:, :2] * [1, -1]
    confidence[index] = 1.0
    if depth:
        told[index] = points
    return Evidence.build(pixels=pixels, confidence=confidence, points=told, mask=None)


def test_the_bank_is_within_limits_and_mirrored(bank: PoseBank) -> None:
    space = pose_space(load_body_model())
    half = len(bank.angles) // 2
    assert half > 2000
    beyond = np.maximum(space.limits[:, 0] - bank.angles, bank.angles - space.limits[:, 1])
    assert beyond.max() < 1e-5
    swap = [
        COMPARED.index(name.replace("left", "?").replace("right", "left").replace("?", "right"))
        for name in COMPARED
    ]
    assert np.abs(bank.points[half:, swap] * [-1, 1, 1] - bank.points[:half]).mean() < 0.01
    assert np.allclose(bank.roots @ bank.roots.transpose(0, 2, 1), np.eye(3), atol=1e-5)


@pytest.mark.parametrize("number", [11, 1234, 3999])
def test_a_pose_of_the_bank_is_found_again_by_its_landmarks(bank: PoseBank, number: int) -> None:
    points = turned(bank.points[number], np.radians(30))
    found = alike(bank, evidence_of(points), count=3)
    assert len(found) == 3
    assert found[0].misfit <= found[1].misfit <= found[2].misfit
    near = np.linalg.norm(bank.points[found[0].number] - bank.points[number], axis=1).mean()
    assert near < 0.12
    flat = alike(bank, evidence_of(points, depth=False), count=1)
    assert flat[0].misfit < 0.01


def test_a_pose_of_the_bank_is_found_again_by_its_outline(bank: PoseBank) -> None:
    import cv2

    number = int(
        np.argmax(
            bank.points[:, COMPARED.index("left_wrist"), 1]
            + bank.points[:, COMPARED.index("right_wrist"), 1]
        )
    )  # arms raised
    canvas = np.zeros((640, 640), np.float32)
    pixels = 320 + SCALE * turned(bank.points[number], np.radians(15))[:, :2] * [1, -1]
    place = {
        name: tuple(int(value) for value in pixel)
        for name, pixel in zip(COMPARED, pixels, strict=True)
    }
    for side in ("left", "right"):
        for first, last in (
            ("shoulder", "elbow"),
            ("elbow", "wrist"),
            ("hip", "knee"),
            ("knee", "ankle"),
            ("shoulder", "hip"),
        ):
            cv2.line(canvas, place[f"{side}_{first}"], place[f"{side}_{last}"], 1, 40)
    cv2.circle(canvas, place["nose"], 35, 1, -1)
    found = alike_outline(bank, mask_field(canvas, (0, 0, 640, 640)), count=4)
    assert len(found) == 4
    best = found[0]
    assert best.camera.scale == pytest.approx(SCALE, rel=0.2)
    wrists = [COMPARED.index("left_wrist"), COMPARED.index("right_wrist")]
    shoulders = [COMPARED.index("left_shoulder"), COMPARED.index("right_shoulder")]
    assert (
        bank.points[best.number, wrists, 1].mean() > bank.points[best.number, shoulders, 1].mean()
    )  # arms raised


def test_landmarks_that_are_doubted_hardly_count(bank: PoseBank) -> None:
    evidence = evidence_of(bank.points[5])
    doubted = evidence.doubted(510.0)
    assert doubted.weights.max() < 0.05 * evidence.weights.max()
    assert not doubted.has_depth
    assert doubted.height == 510.0
    assert np.array_equal(doubted.pixels, evidence.pixels)
    assert dataclasses.replace(doubted, trust=1.0).weights.max() == evidence.weights.max()


def test_fits_that_look_wrong() -> None:
    good = {"keypoint_mean": 0.01, "keypoint_max": 0.03, "silhouette_iou": 0.8}
    assert not looks_wrong(good)
    assert not looks_wrong(
        {name: value for name, value in good.items() if name != "silhouette_iou"}
    )  # no mask
    for name, value in (("keypoint_mean", 0.05), ("keypoint_max", 0.2), ("silhouette_iou", 0.5)):
        assert looks_wrong({**good, name: value})
    # Landmarks and outline that are both slightly off show together an error that neither shows
    # alone.
    assert looks_wrong({**good, "keypoint_mean": 0.018, "silhouette_iou": 0.74})
    assert not looks_wrong({**good, "keypoint_mean": 0.018})
    assert not looks_wrong({**good, "silhouette_iou": 0.74})


def test_the_user_reads_one_sentence_or_none() -> None:
    good = {
        "keypoint_mean": 0.01,
        "keypoint_max": 0.03,
        "silhouette_iou": 0.8,
        "keypoints": {"nose": 0.01, "left_wrist": 0.03},
    }
    assert doubts(good) == []
    (text,) = doubts({**good, "keypoint_max": 0.3})
    assert "left wrist is 30 % of the height off" in text
    assert "--keypoints" in text
    unsure = dict.fromkeys(("left_arm", "left_leg", "right_leg"), 2 * DOUBTFUL)
    (text,) = doubts({**good, "limb_errors": {**unsure, "head": 0.02}})
    assert "the depth of the left arm, left leg and right leg is uncertain" in text
    assert "from their left" in text
    (text,) = doubts({**good, "limb_errors": unsure, "second_photo": "back"})
    assert "from behind" in text


def test_a_limb_that_reaches_far_is_expected_to_be_off_more(bank: PoseBank) -> None:
    landmarks = np.zeros((33, 3))
    landmarks[[LANDMARK_INDEX[name] for name in COMPARED]] = bank.points[5] * [1, 1, 0]
    evidence = evidence_of(bank.points[5] * [1, 1, 0])
    flat = limb_errors(landmarks, evidence, SCALE, 0.8)
    reaching = landmarks.copy()
    reaching[LANDMARK_INDEX["left_wrist"], 2] = 0.4
    found = limb_errors(reaching, evidence, SCALE, 0.8)
    assert found["left_arm"] > 1.3 * flat["left_arm"]
    assert found["right_leg"] == pytest.approx(flat["right_leg"])
    assert limb_errors(landmarks, evidence, SCALE, 0.4)["head"] > flat["head"]
