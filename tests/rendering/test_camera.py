from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.rendering import (
    CameraPath,
    Framing,
    ViewCamera,
    extreme_points,
    follow_cameras,
    read_cameras,
)
from a2v.types import VIEWS, RenderSettings


def walker(frames: int = 40) -> np.ndarray:
    """A cloud of points, 1.8 m high, that walks along +z, jumps, and stretches its arms."""
    generator = np.random.default_rng(0)
    cloud = generator.uniform([-0.3, 0, -0.2], [0.3, 1.8, 0.2], (200, 3))
    cloud[0], cloud[1] = (0, 0, 0), (0, 1.8, 0)
    track = np.repeat(cloud[None], frames, axis=0)
    track[..., 2] += np.linspace(0, 3, frames)[:, None]
    track[:, :, 0] += 0.02 * generator.standard_normal((frames, 1))
    track[20, :, 1] += 0.6
    track[30, 2] += (0.9, 0.5, 0)
    return track


def test_whole_body_stays_in_every_picture() -> None:
    track, settings = walker(), RenderSettings(size=512)
    cameras = follow_cameras(track, settings, framing=Framing(margin=0.05, share=1.0))
    worst = 0.0
    for view in VIEWS:
        for frame, camera in enumerate(cameras[view]):
            pixels = camera.project(track[frame], 512)
            assert pixels.min() >= 0.05 * 512 - 1e-6
            assert pixels.max() <= 0.95 * 512 + 1e-6
            worst = max(worst, np.abs(pixels - 256).max())
    assert worst == pytest.approx(0.45 * 512, abs=1e-3)  # and no farther away than needed


def test_bounds_contain_what_vertices_need() -> None:
    track = walker()
    boxes = np.stack([track.min(axis=1), track.max(axis=1)], axis=1)
    for view, path in follow_cameras(boxes).items():
        for frame, camera in enumerate(path):
            pixels = camera.project(track[frame], 512)
            assert pixels.min() >= 0, view
            assert pixels.max() <= 512, view


def test_extreme_points_need_less_room_than_boxes_and_keep_the_body_in_the_picture() -> None:
    track = walker()
    track[:, 5] += (0.7, 0.3, 0.7)  # an arm, diagonal in the box
    track[:, 6] -= (0.7, -0.3, 0.7)
    settings = RenderSettings(size=512, aspect="9:16")
    facing = np.full(len(track), np.pi / 4)  # stretched towards the front camera
    points = np.stack([extreme_points(cloud) for cloud in track])
    boxes = np.stack([track.min(axis=1), track.max(axis=1)], axis=1)
    near = follow_cameras(points, settings, facing=facing)
    far = follow_cameras(boxes, settings, facing=facing)
    exact = follow_cameras(track, settings, facing=facing)
    for view, path in near.items():
        assert distances_of(path).mean() < 0.9 * distances_of(far[view]).mean()
        np.testing.assert_allclose(distances_of(path), distances_of(exact[view]), rtol=0.01)
        for frame, camera in enumerate(path):
            u, v = camera.project(track[frame], 512).T
            assert 112 <= u.min() <= u.max() <= 400  # of 288 pixels in the middle
            assert 0 <= v.min() <= v.max() <= 512


def distances_of(path: tuple[ViewCamera, ...]) -> np.ndarray:
    return np.array([np.linalg.norm(np.subtract(camera.origin, camera.target)) for camera in path])


def test_cameras_stand_at_half_height_at_one_distance_and_follow_smoothly() -> None:
    track = walker()
    track[20, :, 1] -= 0.6  # no jump
    cameras = follow_cameras(track, framing=Framing(height=1.8))
    shared = distances_of(cameras["front"])
    for path in cameras.values():
        np.testing.assert_allclose(distances_of(path), shared, atol=1e-9)
        origins = np.array([camera.origin for camera in path])
        np.testing.assert_allclose(origins[:, 1], 0.9, atol=1e-9)
        jitter = np.abs(np.diff(origins, 3, axis=0)).max()
        assert jitter < 0.1 * np.abs(np.diff(track.mean(axis=1)[:, [0, 2]], 3, axis=0)).max()
    travelled = cameras["front"][-1].target[2] - cameras["front"][0].target[2]
    assert travelled > 1.8  # of 3 m: it follows


def test_who_stands_takes_the_share_that_is_asked_for() -> None:
    track = np.repeat(walker()[:1], 5, axis=0)
    for share in (0.4, 0.7):
        camera = follow_cameras(track, framing=Framing(share=share))["front"][0]
        middle = track[0].mean(axis=0) * (0, 0, 1) + camera.target * np.array([1, 0, 0])
        low, high = camera.project(np.array([middle, middle + np.array([0, 1.8, 0])]), 1)[:, 1]
        assert low - high == pytest.approx(share, abs=0.01)


def test_cameras_ease_back_before_a_frame_that_needs_room_and_return() -> None:
    track = np.repeat(walker()[:1], 200, axis=0)
    track[100, 2] += (1.6, 0.5, 0)
    distances = distances_of(follow_cameras(track)["front"])
    usual = distances_of(follow_cameras(track[:5])["front"])[0]
    assert distances[[0, -1]] == pytest.approx([usual, usual])
    assert distances.argmax() == pytest.approx(100, abs=1)
    assert distances.max() > 1.2 * usual
    assert np.abs(np.diff(distances)).max() < 0.1 * (distances.max() - usual)  # in many small steps


def test_cameras_rise_with_who_is_in_the_air_but_not_with_steps() -> None:
    track = np.repeat(walker()[:1], 120, axis=0)
    track[:, :, 1] += 0.05 * np.sin(np.arange(120) / 5)[:, None] ** 2
    assert [camera.target[1] for camera in follow_cameras(track)["front"]] == pytest.approx(
        [0.9] * 120, abs=1e-6
    )
    track[30:, :, 1] += 1.5  # a ladder
    targets = [camera.target[1] for camera in follow_cameras(track)["front"]]
    assert targets[0] == pytest.approx(0.9, abs=1e-6)
    assert targets[-1] == pytest.approx(0.9 + 1.5 - 0.1 + 0.03, abs=0.05)


def test_the_front_view_stands_where_the_person_mostly_faces() -> None:
    facing = np.radians(np.concatenate([np.full(30, 170.0), np.full(10, -150.0)]))
    cameras = follow_cameras(walker(), facing=facing)
    for view, turn in (("front", 0), ("left", 90), ("back", 180), ("right", -90)):
        toward = cameras[view][0].axes[2]  # type: ignore[index]
        angle = np.degrees(np.arctan2(toward[0], toward[2]))
        assert np.cos(np.radians(angle - 179.7 - turn)) == pytest.approx(1, abs=1e-4)
    with pytest.raises(InputError, match="one finite angle for each of 40 frames"):
        follow_cameras(walker(), facing=facing[:3])


def test_four_cameras_that_stand_still_see_the_whole_path() -> None:
    track = walker()
    for path in follow_cameras(track, RenderSettings(follow=False)).values():
        assert len(set(path)) == 1
        pixels = path[0].project(track, 512)
        assert 0 <= pixels.min() <= pixels.max() <= 512


def test_unusable_framing_is_named() -> None:
    for odd in ({"share": 0.0}, {"margin": 0.5}, {"ease": -1.0}, {"height": 0.0}, {"fov": 180.0}):
        with pytest.raises(InputError, match="expected"):
            Framing(**odd)


@pytest.mark.parametrize(
    ("view", "axis", "sign"),
    [("front", 2, 1), ("back", 2, -1), ("left", 0, 1), ("right", 0, -1)],
    ids=lambda value: str(value),
)
def test_each_view_stands_on_its_side(view: str, axis: int, sign: int) -> None:
    camera = follow_cameras(walker())[view][0]  # type: ignore[index]
    offset = np.subtract(camera.origin, camera.target)
    assert sign * offset[axis] > 1
    assert np.abs(np.delete(offset, axis)).max() < 1e-9


def test_projection_of_the_target_is_the_middle_and_right_is_right() -> None:
    camera = ViewCamera(origin=(0, 1, 4), target=(0, 1, 0), fov=40)
    np.testing.assert_allclose(camera.project(np.array([0.0, 1, 0]), 100), [50, 50])
    u, v = camera.project(np.array([0.5, 1.5, 0]), 100)
    assert u > 50 > v  # +x lies to the right in the front view, +y upwards
    edge = 4 * np.tan(np.radians(20))
    np.testing.assert_allclose(camera.project(np.array([edge, 1 - edge, 0]), 100), [100, 100])
    assert np.isnan(camera.project(np.array([0.0, 1, 5]), 100)).all()


@pytest.mark.parametrize(
    "track", [np.zeros((0, 2, 3)), np.zeros((3, 2)), np.full((2, 2, 3), np.nan)]
)
def test_unusable_tracks_are_named(track: np.ndarray) -> None:
    with pytest.raises(InputError, match="track"):
        follow_cameras(track)


def test_unusable_cameras_are_named() -> None:
    with pytest.raises(InputError, match="up direction"):
        ViewCamera(origin=(0, 1, 0), target=(0, 0, 0))
    with pytest.raises(InputError, match="fov"):
        ViewCamera(origin=(0, 1, 1), target=(0, 0, 0), fov=180)


def test_camera_round_trip(tmp_path) -> None:  # type: ignore[no-untyped-def]
    camera = ViewCamera(origin=(0.1, 1, 4), target=(0, 1, 0), fov=33)
    camera.save(tmp_path / "camera.npz")
    assert ViewCamera.load(tmp_path / "camera.npz") == camera


# ---- custom cameras


def turned(path: CameraPath, **more: object) -> tuple[ViewCamera, ...]:
    settings = RenderSettings(views=(path.name,))
    return follow_cameras(walker(), settings, cameras=(path,), **more)[path.name]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "path",
    [
        CameraPath(name="high", azimuth=30, elevation=50, fov=20),
        CameraPath(name="dolly", turn=360, elevation=-8, fov=60),
    ],
)
def test_a_camera_of_ones_own_sees_the_whole_body_from_its_side(path: CameraPath) -> None:
    cameras, track = turned(path, framing=Framing(margin=0.05)), walker()
    worst = 0.0
    for frame, camera in enumerate(cameras):
        worst = max(worst, float(np.abs(camera.project(track[frame], 512) - 256).max()))
        toward = camera.axes[2]
        angle = np.degrees(np.arctan2(toward[0], toward[2]))
        assert np.cos(
            np.radians(angle - path.azimuth - path.turn * frame / len(cameras))
        ) == pytest.approx(1, abs=1e-9)
        assert np.degrees(np.arcsin(toward[1])) == pytest.approx(path.elevation, abs=1e-6)
    assert worst == pytest.approx(0.45 * 512, abs=1e-3)
    assert (
        len({round(float(np.linalg.norm(np.subtract(c.origin, c.target))), 9) for c in cameras})
        == 1
    )


def test_a_turntable_goes_around_once_and_closes() -> None:
    still = np.repeat(walker()[:1], 12, axis=0)
    cameras = follow_cameras(still, RenderSettings(views=("turntable",)))["turntable"]
    around = np.unwrap([np.arctan2(camera.axes[2, 0], camera.axes[2, 2]) for camera in cameras])
    np.testing.assert_allclose(
        np.diff(around), 2 * np.pi / 12, atol=1e-9
    )  # the thirteenth would be the first
    assert {camera.target for camera in cameras} == {cameras[0].target}


def test_cameras_that_stand_still() -> None:
    fixed = turned(CameraPath(name="tripod", origin=(2, 1.5, 3), target=(0, 1, 0), fov=40))
    assert set(fixed) == {ViewCamera(origin=(2, 1.5, 3), target=(0, 1, 0), fov=40)}
    panning = turned(CameraPath(name="pan", origin=(2, 1.5, 3)))
    assert {camera.origin for camera in panning} == {(2, 1.5, 3)}
    assert panning[-1].target[2] - panning[0].target[2] > 1.8
    wide = turned(CameraPath(name="wide", follow=False))
    assert len(set(wide)) == 1
    track = walker()
    pixels = wide[0].project(track, 512)
    assert pixels.min() >= 0
    assert pixels.max() <= 512
    near = turned(CameraPath(name="near", distance=2.5))[5]
    assert np.linalg.norm(np.subtract(near.origin, near.target)) == pytest.approx(2.5)


def test_a_camera_beside_the_four_leaves_them_alone() -> None:
    path = CameraPath(name="hero", azimuth=30, fov=20)
    with_hero = follow_cameras(walker(), RenderSettings(views=("left", "hero")), cameras=(path,))
    assert list(with_hero) == ["left", "hero"]
    assert with_hero["left"] == follow_cameras(walker(), RenderSettings(views=("left",)))["left"]


def test_camera_files_read(tmp_path: Path) -> None:
    file = tmp_path / "cameras.yaml"
    file.write_text(
        "hero: {azimuth: 30, elevation: 12.5}\nwide: {follow: false}\ntripod: {origin: [2, 1.5, "
        "3], target: [0, 0.9, 0], fov: 40}\nplain:\n"
    )
    assert read_cameras(file) == (
        CameraPath(name="hero", azimuth=30, elevation=12.5),
        CameraPath(name="wide", follow=False),
        CameraPath(name="tripod", origin=(2, 1.5, 3), target=(0, 0.9, 0), fov=40),
        CameraPath(name="plain"),
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no cameras"),
        ("- a\n- b\n", "no cameras"),
        ("hero: [1, 2]\n", "camera 'hero' is not a mapping"),
        ("hero: {azimut: 3}\n", "did you mean azimuth"),
        ("hero: {azimuth: left}\n", "azimuth of camera 'hero' is 'left'; expected a number"),
        ("hero: {azimuth: .nan}\n", "not finite"),
        ("hero: {follow: 1}\n", "true or false"),
        ("hero: {origin: [1, 2]}\n", "three numbers"),
        ("hero: {target: [1, 2, 3]}\n", "no origin"),
        ("hero: {origin: [1, 2, 3], azimuth: 3}\n", "leave out azimuth"),
        ("hero: {elevation: 90}\n", "elevation"),
        ("hero: {distance: 0}\n", "distance 0"),
        ("front: {azimuth: 3}\n", "is taken"),
        ("video: {azimuth: 3}\n", "is taken"),
        ("'../up': {azimuth: 3}\n", "cannot be the name of a camera"),
        ("hero: !!python/object/apply:os.system [true]\n", "not a YAML"),
        ("hero: {azimuth: 3\n", "not a YAML"),
        ("x" * 70000, "larger than 64 kB"),
    ],
)
def test_bad_camera_files_are_explained(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "cameras.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_cameras(file)
    assert str(file) in str(caught.value)
    with pytest.raises(InputError, match=r"missing\.yaml"):
        read_cameras(tmp_path / "missing.yaml")


def test_views_that_nothing_defines_are_named() -> None:
    with pytest.raises(
        InputError, match=r"unknown view 'top'; choose from front, .*turntable, hero"
    ):
        follow_cameras(walker(), RenderSettings(views=("top",)), cameras=(CameraPath(name="hero"),))
    for views, words in (
        ((), "no view"),
        (("a b",), "cannot be the name of a view"),
        (("front", "front"), "twice"),
    ):
        with pytest.raises(InputError, match=words):
            RenderSettings(views=views)
