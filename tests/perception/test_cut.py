"""People whose legs the photo's lower edge cuts off stand."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.kinematics.names import LANDMARK_INDEX
from a2v.perception.cut import complete_standing
from a2v.samples.ready import load_ready_person
from a2v.types import FloatArray

HIPS, KNEES, ANKLES, SHOULDERS, ELBOWS = (
    [LANDMARK_INDEX[f"{side}_{joint}"] for side in ("left", "right")]
    for joint in ("hip", "knee", "ankle", "shoulder", "elbow")
)


@pytest.fixture
def landmarks() -> tuple[FloatArray, FloatArray]:
    """Those of the sample's standing person."""
    subject = load_ready_person().subject
    return subject.keypoints.astype(np.float64), subject.keypoints_3d.astype(np.float64)


def sitting(
    points: FloatArray, points_3d: FloatArray, *unseen: list[int]
) -> tuple[FloatArray, FloatArray]:
    """The same landmarks with legs drawn up, as detectors guess what the picture does not show."""
    points, points_3d = points.copy(), points_3d.copy()
    for joints in unseen:
        points[joints, 2] = 0.02
    below = [*KNEES, *ANKLES, *range(29, 33)]
    points[below, 2] = 0.02
    points[below, 1] = points[HIPS, 1].mean()
    points_3d[below, 1], points_3d[below, 2] = points_3d[HIPS, 1].mean(), 0.4
    return points, points_3d


def test_legs_below_the_picture_are_straight(landmarks: tuple[FloatArray, FloatArray]) -> None:
    true, true_3d = landmarks
    height = int(true[HIPS, 1].max()) + 20
    made, made_3d = complete_standing(*sitting(true, true_3d), height)
    trunk = np.linalg.norm(true_3d[SHOULDERS].mean(axis=0) - true_3d[HIPS].mean(axis=0))
    for joints in (KNEES, ANKLES):
        assert np.abs(made_3d[joints] - true_3d[joints]).max() < 0.35 * trunk
        assert (made[joints, 1] > height).all()
    legs = made_3d[ANKLES] - made_3d[HIPS]
    assert (legs[:, 1] < -0.95 * np.linalg.norm(legs, axis=1)).all()
    assert (made[KNEES, 2] > 0.5).all()  # the fit shall follow them
    kept = [*SHOULDERS, *HIPS, *ELBOWS]
    assert np.array_equal(made[kept], true[kept])


def test_what_the_picture_shows_stays(landmarks: tuple[FloatArray, FloatArray]) -> None:
    true, true_3d = landmarks
    made, made_3d = complete_standing(true, true_3d, 10**6)
    assert np.array_equal(made, true)
    assert np.array_equal(made_3d, true_3d)
    height = int(true[KNEES, 1].max()) + 20  # the shins are cut off, the knees visible
    cut = true.copy()
    cut[[*ANKLES, *range(29, 33)], 2] = 0.02
    made, _ = complete_standing(cut, true_3d, height)
    assert np.array_equal(made[KNEES], true[KNEES])
    assert (made[ANKLES, 1] > height).all()


def test_below_a_chest_the_person_stands_upright(landmarks: tuple[FloatArray, FloatArray]) -> None:
    """Detectors fold trunk, arms and legs of somebody whose hips are not in the picture."""
    true, true_3d = landmarks
    given, given_3d = sitting(true, true_3d, HIPS, ELBOWS, SHOULDERS)
    given[HIPS, 1] = given[SHOULDERS, 1] + 5
    given_3d[HIPS] = given_3d[SHOULDERS] - [0.0, 0.05, 0.0]
    height = int(true[SHOULDERS, 1].max() + 40)
    made, made_3d = complete_standing(given, given_3d, height)
    trunk = made_3d[SHOULDERS].mean(axis=0) - made_3d[HIPS].mean(axis=0)
    assert 0.4 < trunk[1] < 0.6
    assert np.abs(trunk[[0, 2]]).max() < 0.03
    assert (made_3d[ELBOWS, 1] < made_3d[SHOULDERS, 1] - 0.2).all()
    assert (made_3d[ANKLES, 1] < -0.7).all()
    assert np.isfinite(made).all()
    assert np.allclose(made[0, :2], true[0, :2])  # the face stays


def test_somebody_seen_along_the_trunk_is_left_alone(
    landmarks: tuple[FloatArray, FloatArray],
) -> None:
    true, true_3d = landmarks
    true_3d[SHOULDERS] = true_3d[HIPS] + [0.0, 0.01, 0.5]
    made, made_3d = complete_standing(true, true_3d, 10)
    assert np.array_equal(made, true)
    assert np.array_equal(made_3d, true_3d)
