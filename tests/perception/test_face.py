"""Landmarks of a face from many crops agree better than those from two."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from a2v.perception import face as module
from a2v.perception.face import GLANCES, LEAST_FACE, find_face, look_closely

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"
SHIFTS = ((0.0, 0.0, 1.0), (0.03, -0.02, 1.0), (-0.04, 0.03, 1.05), (0.02, 0.05, 0.94))


@pytest.fixture(scope="module")
def photo() -> np.ndarray:
    with Image.open(SAMPLE) as picture:
        return np.asarray(picture.convert("RGB"))


@pytest.fixture(scope="module")
def square(photo: np.ndarray) -> tuple[np.ndarray, float]:
    """Around the face: the head is the top eighth of the person."""
    from a2v.perception.detector import Detector

    with Detector() as detector:
        found = detector.one(photo)
    assert found is not None
    points = found.keypoints[:, :2]
    middle = points[:11].mean(axis=0)
    return middle, 1.6 * float(np.ptp(points[:11], axis=0).max())


def spread(photo: np.ndarray, square: tuple[np.ndarray, float]) -> float:
    """Mean distance of landmarks between several squares, pixels of a face of 512."""
    middle, half = square
    seen = [
        look_closely(photo, middle + half * np.array(shift), half * size) for *shift, size in SHIFTS
    ]
    assert all(points is not None for points in seen)
    places = np.array(seen)[..., :2]  # type: ignore[index]
    return float(
        np.linalg.norm(places - places.mean(axis=0), axis=-1).mean() * 512 / np.ptp(places[0, :, 1])
    )


def test_many_glances_agree_better_than_one(
    photo: np.ndarray, square: tuple[np.ndarray, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    many = spread(photo, square)
    monkeypatch.setattr(module, "GLANCES", GLANCES[:1])
    one = spread(photo, square)
    assert many < 1.0
    assert many < 0.7 * one


def test_where_there_is_no_face_none_is_found(photo: np.ndarray) -> None:
    blank = np.full_like(photo, 127)
    assert look_closely(blank, np.array(blank.shape[1::-1]) / 2, 100.0) is None
    keypoints = np.ones((33, 3), np.float32)
    keypoints[2:6, 0] = [0, 0, 0, LEAST_FACE / 2 - 1]
    assert find_face(photo, keypoints) is None


def test_a_face_in_profile_is_found(data_dir: Path) -> None:
    from a2v.perception.detector import Detector

    path = data_dir / "photos" / "tfjs_pose.jpg"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    with Image.open(path) as picture:
        image = np.asarray(picture.convert("RGB"))
    with Detector() as detector:
        found = detector.one(image)
    assert found is not None
    face = find_face(image, found.keypoints)
    assert face is not None
    eyes = face[33] - face[263]
    assert np.linalg.norm(eyes[:2]) < LEAST_FACE < np.linalg.norm(eyes)
    assert face[1, 0] < face[263, 0] < face[454, 0]  # nose, left eye, left ear
