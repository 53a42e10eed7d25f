"""Cameras of photos: the flat frame and the way back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.rendering.camera import ViewCamera
from a2v.types import OrthographicCamera, PhotoCamera

FLAT = OrthographicCamera(scale=400.0, center_u=300.0, center_v=700.0)


def camera(distance: float = 2.0, pitch: float = 0.25) -> PhotoCamera:
    return PhotoCamera(
        flat=FLAT, aim=(0.1, 0.9, 0.05), distance=distance, pitch=pitch, source="test"
    )


def person(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform((-0.6, 0, -0.4), (0.6, 1.8, 0.6), (500, 3))


def test_the_way_back_undoes_the_way_there() -> None:
    points = person()
    np.testing.assert_allclose(camera().raised(camera().flatten(points)), points, atol=1e-9)
    np.testing.assert_allclose(
        camera().flatten(points)[:, 2], points[:, 2]
    )  # depth stays depth over the floor


def test_it_sees_what_a_renderers_camera_sees() -> None:
    own, points, size = camera(), person(1), 800
    origin = (own.aim[0], own.height, own.aim[2] + own.distance)
    away = own.distance / np.cos(own.pitch)
    view = ViewCamera(
        origin=origin,
        target=own.aim,
        fov=float(np.degrees(2 * np.arctan(size / 2 / (own.scale * away)))),
    )
    axis = own.project(np.array(own.aim))
    np.testing.assert_allclose(
        own.project(points) - axis, view.project(points, size) - size / 2, atol=1e-2
    )


def test_what_is_seen_first_in_the_flat_frame_is_nearer_to_the_camera() -> None:
    own = camera(1.5, 0.4)
    eye = np.array([own.aim[0], own.height, own.aim[2] + own.distance])
    near = person(2)
    far = eye + (near - eye) * 1.1  # on the same rays
    flat_near, flat_far = own.flatten(near), own.flatten(far)
    np.testing.assert_allclose(flat_near[:, :2], flat_far[:, :2], atol=1e-9)
    assert (flat_near[:, 2] > flat_far[:, 2]).all()


def test_a_distance_of_0_is_orthographic_and_so_is_a_very_large_one() -> None:
    points = person(3)
    np.testing.assert_array_equal(camera(0.0, 0.0).project(points), FLAT.project(points))
    far = camera(1e5, 0.0)
    np.testing.assert_allclose(far.project(points), FLAT.project(points), atol=0.02)


def test_moving_the_world_and_the_camera_changes_no_pixel() -> None:
    points, shift = person(4), np.array([0.3, -0.2, 0.5])
    np.testing.assert_allclose(
        camera().moved(shift).project(points + shift), camera().project(points), atol=1e-9
    )


def test_it_looks_down_by_its_pitch_along_its_axis_and_less_at_heads() -> None:
    own = camera()
    assert own.looks_down(np.array(own.aim)) == pytest.approx(own.pitch)
    assert own.looks_down(np.array([0.1, own.height, 0.0])) == pytest.approx(0.0)
    assert camera(0.0, 0.0).looks_down(np.array(own.aim)) == FLAT.looks_down(np.array(own.aim)) == 0


def test_what_lies_behind_the_camera_stays_finite() -> None:
    assert np.isfinite(camera().project(np.array([[0.0, 1.0, 50.0]]))).all()


def test_it_is_kept_in_a_file(tmp_path: Path) -> None:
    camera().save(tmp_path / "camera.npz")
    assert PhotoCamera.load(tmp_path / "camera.npz") == camera()


@pytest.mark.parametrize(
    "wrong", [{"distance": -1.0}, {"distance": np.inf}, {"pitch": 2.0}, {"aim": (0.0, 1.0)}]
)
def test_impossible_cameras_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError):
        PhotoCamera(flat=FLAT, **wrong)  # type: ignore[arg-type]
