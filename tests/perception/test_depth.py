from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.perception.depth import (
    HIPS,
    DepthCorrection,
    detector_features,
    load_depth_correction,
    picture_plane,
    put_upright,
)

ZERO = DepthCorrection(
    mean=np.zeros(198, np.float32),
    scale=np.ones(198, np.float32),
    weights=np.zeros((198, 33), np.float32),
    offset=np.zeros(33, np.float32),
)


@pytest.fixture
def person() -> tuple[np.ndarray, np.ndarray]:
    """A made-up detection: keypoints (33, 3) at 200 pixels a meter, and their 3D positions."""
    random = np.random.default_rng(0)
    points = random.normal(0, 0.4, (33, 3)).astype(np.float32)
    points -= points[HIPS].mean(axis=0)
    pixels = points[:, :2] * [200, -200] + [300, 400]
    return np.c_[pixels, np.full(33, 0.9)].astype(np.float32), points


def test_the_picture_plane_is_in_meters_from_the_hips(person) -> None:
    plane, scale = picture_plane(*person)
    assert scale == pytest.approx(200, rel=1e-5)
    np.testing.assert_allclose(plane, person[1][:, :2], atol=1e-5)


def test_features_know_neither_place_nor_size(person) -> None:
    keypoints, points = person
    moved = keypoints * np.array([1.7, 1.7, 1], np.float32) + np.array([31, -8, 0], np.float32)
    np.testing.assert_allclose(
        detector_features(moved, points + 3), detector_features(keypoints, points), atol=1e-5
    )


def test_without_a_correction_only_the_frame_changes(person) -> None:
    keypoints, points = person
    np.testing.assert_allclose(put_upright(keypoints, points + 1, ZERO), points, atol=1e-5)


def test_the_map_is_added_to_the_depths(person) -> None:
    keypoints, points = person
    weights = np.zeros((198, 33), np.float32)
    weights[197, 0] = 0.5  # the nose by the last confidence
    put = put_upright(
        keypoints,
        points,
        DepthCorrection(
            mean=ZERO.mean, scale=ZERO.scale, weights=weights, offset=np.full(33, 0.1, np.float32)
        ),
    )
    np.testing.assert_allclose(put[1:, 2], points[1:, 2] + 0.1, atol=1e-5)
    assert put[0, 2] == pytest.approx(points[0, 2] + 0.1 + 0.45, abs=1e-5)


def test_unknown_points_stay_unknown(person) -> None:
    keypoints, points = person
    unknown = np.full_like(points, np.nan)
    assert np.isnan(put_upright(keypoints, unknown)).all()
    upside_down = keypoints * np.array([1, -1, 1], np.float32) * [-1, 1, 1]
    np.testing.assert_array_equal(
        put_upright(upside_down, points), points
    )  # points and picture do not belong together


def test_a_file_of_another_size_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="weights"):
        DepthCorrection(
            mean=ZERO.mean, scale=ZERO.scale, weights=ZERO.weights[:, :5], offset=ZERO.offset
        )
    assert load_depth_correction().weights.shape == (198, 33)
