"""Corrections: what a file may contain and what it changes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from a2v.body import FitResult, FitSettings, fit_body, load_body_model
from a2v.errors import InputError
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.perception import Corrections, corrected, decode_photo, find_person, read_corrections
from a2v.perception.apply_corrections import correct_landmarks, draw_strokes
from a2v.types import FloatArray, Subject

QUICK = FitSettings(rounds=2)
SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"
WRIST, ELBOW = LANDMARK_INDEX["left_wrist"], LANDMARK_INDEX["left_elbow"]
FULL = """
units: fractions
person: [0.1, 0, 0.9, 1]
landmarks: {left_wrist: [0.25, 0.5], nose: [0.5, 0.125]}
limbs: {left_lower_arm: back, right_upper_leg: front}
mask:
- {add: [[0.5, 0.5], [0.5, 0.25]], radius: 0.01}
- {remove: [[0.75, 0.5]], radius: 0.02}
"""


@pytest.fixture(scope="module")
def photo() -> np.ndarray:
    """The sample photo at half size."""
    full = decode_photo(SAMPLE.read_bytes(), "sample")
    return cv2.resize(full, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)


@pytest.fixture(scope="module")
def subject(photo: np.ndarray) -> Subject:
    return find_person(photo)


@pytest.fixture(scope="module")
def fitted(subject: Subject) -> FitResult:
    return fit_body(subject, settings=QUICK)


def landmarks(result: FitResult) -> FloatArray:
    import torch

    model = load_body_model()
    with torch.no_grad():
        state = model.forward(
            *(
                torch.from_numpy(result.body.parameters[key])
                for key in ("rotations", "shape", "translation")
            )
        )
        found: FloatArray = model.landmarks(state).numpy()
    return found


def in_photo(subject: Subject, point: FloatArray) -> list[float]:
    left, top, right, _ = subject.crop
    scale = (right - left) / subject.image.shape[1]
    return [float(left + point[0] * scale), float(top + point[1] * scale)]


def test_a_file_goes_round_and_fractions_are_pixels_of_the_photo() -> None:
    found = read_corrections(FULL.encode(), "me.yaml")
    assert read_corrections(found.to_yaml().encode(), "again") == found
    assert Corrections.of(found.said()) == found
    own = found.in_pixels(400, 800)
    assert own.landmarks == (("left_wrist", 100.0, 400.0), ("nose", 200.0, 100.0))
    assert own.person == (40.0, 0.0, 360.0, 800.0)
    assert [one.radius for one in own.strokes] == [8.0, 16.0]  # of the longer side
    assert bool(found)
    assert not Corrections()
    assert read_corrections(b"", "empty") == Corrections()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("- 1", "not a mapping"),
        ("landmark: {}", "unknown part 'landmark'"),
        ("landmarks: {left_wirst: [1, 2]}", "unknown landmark 'left_wirst'"),
        ("landmarks: {nose: [1]}", "nose is at"),
        ("landmarks: {nose: [.nan, 2]}", "nose is at"),
        ("units: fractions\nlandmarks: {nose: [400, 300]}", "at most 2"),
        ("units: meters", "units are 'meters'; expected pixels or fractions"),
        ("limbs: {left_arm: front}", "unknown limb 'left_arm'"),
        ("limbs: {left_lower_arm: left}", "expected front or back"),
        ("person: 0", "person is 0"),
        ("person: [5, 5, 5, 9]", "a box"),
        ("mask: [{add: [[1, 1]]}]", "radius None"),
        ("mask: [{add: [[1, 1]], remove: [[1, 1]], radius: 2}]", "expected add or remove"),
        ("mask: [{add: [], radius: 2}]", "has the points"),
        ("a: [1", "me.yaml"),
    ],
)
def test_what_cannot_be_is_told_in_one_sentence(text: str, told: str) -> None:
    with pytest.raises(InputError) as found:
        read_corrections(text.encode(), "me.yaml")
    assert told in str(found.value)
    assert "me.yaml" in str(found.value)
    assert "\n" not in str(found.value)


def test_a_landmark_of_another_photo_is_refused(photo: np.ndarray) -> None:
    with pytest.raises(InputError, match="far outside"):
        find_person(photo, corrections=Corrections.of({"landmarks": {"nose": [90_000, 10]}}))


def test_strokes_are_drawn_as_wide_as_they_are() -> None:
    mask = np.zeros((60, 80), np.float32)
    drawn = draw_strokes(
        mask, Corrections.of({"mask": [{"add": [[20, 30], [60, 30]], "radius": 6}]}).strokes
    )
    assert drawn[30, 20:60].all()
    assert drawn[25:35, 40].all()
    assert not drawn[:22].any()
    assert not drawn[:, 70:].any()
    assert not mask.any()
    taken = draw_strokes(
        drawn, Corrections.of({"mask": [{"remove": [[40, 30]], "radius": 4}]}).strokes
    )
    assert taken[30, 40] == 0
    assert taken[30, 25] == 1


def test_a_moved_landmark_is_certain_and_takes_the_hand_along(subject: Subject) -> None:
    u, v = (float(value) for value in subject.keypoints[WRIST, :2])
    wanted = Corrections.of({"landmarks": {"left_wrist": [u + 20, v]}})
    points, space = correct_landmarks(subject.keypoints, subject.keypoints_3d, wanted)
    assert points[WRIST].tolist() == [u + 20, v, 1.0]
    index = LANDMARK_INDEX["left_index"]
    assert points[index, 0] - subject.keypoints[index, 0] == pytest.approx(20, abs=1e-3)
    assert space[WRIST, 0] > subject.keypoints_3d[WRIST, 0]
    assert space[WRIST, 2] == subject.keypoints_3d[WRIST, 2]
    _, space = correct_landmarks(
        subject.keypoints,
        subject.keypoints_3d,
        Corrections.of({"landmarks": {"left_wrist": [u + 300, v]}}),
    )
    assert np.isnan(space[WRIST]).all()  # the detector saw something else there


@pytest.mark.slow
def test_nothing_corrected_changes_nothing(photo: np.ndarray, subject: Subject) -> None:
    assert find_person(photo, corrections=Corrections()).to_bytes() == subject.to_bytes()


@pytest.mark.slow
def test_the_fitted_wrist_goes_where_the_landmark_is_put(
    photo: np.ndarray, subject: Subject, fitted: FitResult
) -> None:
    before = fitted.camera.project(landmarks(fitted))[WRIST]
    height = 0.06 * subject.image.shape[0]
    target = subject.keypoints[WRIST, :2] + np.array([height, -height])
    found = find_person(
        photo, corrections=Corrections.of({"landmarks": {"left_wrist": in_photo(subject, target)}})
    )
    after = fit_body(found, settings=QUICK)
    asked = found.keypoints[WRIST, :2]
    gap = np.linalg.norm(after.camera.project(landmarks(after))[WRIST] - asked)
    assert gap < 0.015 * subject.image.shape[0]
    assert gap < 0.2 * np.linalg.norm(
        before - subject.keypoints[WRIST, :2] - (asked - subject.keypoints[WRIST, :2])
    )
    at_once = corrected(
        subject, Corrections.of({"landmarks": {"left_wrist": in_photo(subject, target)}})
    )
    assert in_photo(at_once, at_once.keypoints[WRIST]) == pytest.approx(
        in_photo(found, asked), abs=0.01
    )
    assert np.array_equal(at_once.given, found.given)
    asked = at_once.keypoints[WRIST, :2]
    quick = fit_body(
        at_once, settings=FitSettings(rounds=1), initial=fitted
    )  # the page draws this a second later
    assert (
        np.linalg.norm(quick.camera.project(landmarks(quick))[WRIST] - asked)
        < 0.015 * subject.image.shape[0]
    )


@pytest.mark.slow
def test_a_limb_goes_to_the_said_side(photo: np.ndarray, fitted: FitResult) -> None:
    before = landmarks(fitted)
    was_front = before[WRIST, 2] > before[ELBOW, 2]
    wanted = Corrections.of({"limbs": {"left_lower_arm": "back" if was_front else "front"}})
    after = landmarks(fit_body(find_person(photo, corrections=wanted), settings=QUICK))
    assert (after[WRIST, 2] > after[ELBOW, 2]) != was_front
    assert abs(after[WRIST, 2] - after[ELBOW, 2]) > 0.02


@pytest.mark.slow
def test_strokes_change_the_mask_there_and_nowhere_else(
    photo: np.ndarray, subject: Subject
) -> None:
    rows, columns = np.nonzero(subject.mask > 0.5)
    middle = np.array([columns.mean(), rows.mean()])
    radius = 0.03 * subject.image.shape[0]
    hole = Corrections.of({"mask": [{"remove": [in_photo(subject, middle)], "radius": radius}]})
    found = find_person(photo, corrections=hole)
    assert found.crop == subject.crop
    u, v = (round(float(value)) for value in middle)
    assert subject.mask[v, u] == 1
    assert found.mask[v, u] == 0
    distance = np.hypot(*(np.indices(subject.mask.shape)[::-1] - middle[:, None, None]))
    assert np.abs(found.mask - subject.mask)[distance > 6 * radius].mean() < 0.002


@pytest.mark.slow
def test_who_of_two_is_meant(photo: np.ndarray, subject: Subject) -> None:
    height, width = photo.shape[:2]
    small = cv2.resize(photo[..., :3], None, fx=0.7, fy=0.7, interpolation=cv2.INTER_AREA)
    scene = np.full(
        (height, width + small.shape[1], 3),
        photo[:5, :5, :3].mean(axis=(0, 1)).astype(np.uint8),
        np.uint8,
    )
    scene[:, :width] = photo[..., :3]
    scene[height - small.shape[0] :, width:] = small
    first = find_person(scene)
    assert first.people is not None
    assert len(first.people) == 2
    assert first.crop[2] <= width * 1.1
    box = [float(value) for value in first.people[1]]
    for who in (2, box):
        other = find_person(scene, corrections=Corrections.of({"person": who}))
        assert other.crop[0] >= width * 0.9
    with pytest.raises(InputError, match="select person 3, but only 2"):
        find_person(scene, corrections=Corrections.of({"person": 3}))
    with pytest.raises(InputError, match="no person is found in the box"):
        find_person(scene, corrections=Corrections.of({"person": [0, 0, 9, 9]}))
