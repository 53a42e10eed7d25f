"""The photo's camera, which sees the person as the photo does."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh

from a2v.lab.studio.solid import PhotoFrame
from a2v.rendering.viewpoint import (
    DISTANCE,
    HEIGHT,
    Viewpoint,
    as_seen,
    find_viewpoint,
    perspective_camera,
    soles_slope,
    told_distance,
)
from a2v.types import BoolArray, FloatArray, OrthographicCamera, Subject, Surface

CAMERA = OrthographicCamera(scale=100.0, center_u=90.0, center_v=230.0)
OFFSET = np.array([0.3, 0.1, -0.4])


def subject(crop=(-20, 40, 160, 300), photo_size=(400, 360)) -> Subject:
    height, width = crop[3] - crop[1], crop[2] - crop[0]
    return Subject(
        image=np.zeros((height, width, 3), np.uint8),
        mask=np.zeros((height, width), np.float32),
        keypoints=np.zeros((33, 3), np.float32),
        keypoints_3d=np.full((33, 3), np.nan, np.float32),
        crop=crop,
        photo_size=photo_size,
    )


def standing() -> tuple[Surface, tuple[BoolArray, BoolArray]]:
    """A body on two shoes of 26 cm, one in front of the other, and the shoes' vertices."""
    shoes = [
        trimesh.creation.box((0.1, 0.08, 0.26)).subdivide().subdivide().subdivide()
        for _ in range(2)
    ]
    for shoe, side in zip(shoes, (-1, 1), strict=True):
        shoe.apply_translation((0.15 * side, 0.04, 0.05 + 0.1 * side))
    body = trimesh.creation.box((0.5, 1.6, 0.3))
    body.apply_translation((0, 0.9, 0))
    whole = trimesh.util.concatenate([*shoes, body])
    count = len(shoes[0].vertices)
    index = np.arange(len(whole.vertices))
    surface = Surface(
        vertices=whole.vertices.astype(np.float32),
        faces=whole.faces.astype(np.int32),
        colors=np.zeros((len(index), 3), np.float32),
    )
    return surface, (index < count, (index >= count) & (index < 2 * count))


@pytest.mark.parametrize(("height", "distance"), [(1.7, 3.0), (1.2, 4.0), (0.9, 9.0)])
def test_soles_tell_how_steeply_the_camera_sees_the_ground(height: float, distance: float) -> None:
    surface, feet = standing()
    frame = PhotoFrame.looking(np.array([0, 0.85, 0]), distance=distance, height=height)
    assert frame.height == pytest.approx(height)
    assert frame.over_floor == pytest.approx(distance)
    warped = dataclasses.replace(surface, vertices=frame.warp(surface.vertices).astype(np.float32))
    slope = soles_slope(warped, feet)
    assert slope is not None
    assert slope == pytest.approx(
        height / distance, abs=0.1
    )  # its meters are those of the person's middle
    assert soles_slope(surface, feet) == pytest.approx(
        0, abs=1e-6
    )  # flat on the ground of its own frame: seen from the side


def test_soles_that_are_no_soles_say_nothing() -> None:
    surface, feet = standing()
    nobody = np.zeros(len(surface.vertices), bool)
    assert soles_slope(surface, (nobody, nobody)) is None
    raised = surface.vertices.copy()
    raised[feet[1], 1] += (
        0.5 + 2 * raised[feet[1], 2]
    )  # a leg in the air: the other foot alone counts
    assert soles_slope(dataclasses.replace(surface, vertices=raised), feet) == pytest.approx(
        0, abs=1e-6
    )


def test_the_viewpoint_weighs_what_is_usual_and_what_is_seen() -> None:
    usual = find_viewpoint(None)
    assert usual.height == pytest.approx(HEIGHT[0], rel=0.02)
    assert usual.distance == pytest.approx(DISTANCE[0], rel=0.02)
    steep, flat = find_viewpoint(0.6), find_viewpoint(0.1)
    assert flat.slope < usual.slope < steep.slope < 0.6
    assert steep.distance < usual.distance < flat.distance
    assert find_viewpoint(None, told=8.0).distance == pytest.approx(8, rel=0.1)
    # 50 mm film sees 43 mm of diagonal: from as far as the photo's diagonal is long, times 50 / 43
    told = told_distance(50, subject(), CAMERA)
    assert told == pytest.approx(50 / 43.27 * np.hypot(400, 360) / 100, rel=1e-4)


@pytest.mark.parametrize(
    "viewpoint", [Viewpoint(slope=0.05, distance=12.0), Viewpoint(slope=0.4, distance=3.5)]
)
def test_the_camera_sees_every_vertex_where_the_photo_does(viewpoint: Viewpoint) -> None:
    points = np.random.default_rng(0).uniform((-0.4, 0, -0.3), (0.4, 1.8, 0.4), (200, 3))
    camera, moved = perspective_camera(subject(), CAMERA, points, OFFSET, viewpoint)
    in_square = CAMERA.project(points) + np.array(
        [-20, 40 + 20]
    )  # the photo lies in the middle of a square of 400
    np.testing.assert_allclose(camera.project(points + OFFSET + moved, 400), in_square, atol=0.02)
    assert np.abs(moved[:, 2]).max() == 0
    assert (points + OFFSET + moved)[:, 1].min() == pytest.approx(0, abs=1e-5)
    nearer = camera.project(points + OFFSET + moved + np.array([0, 0, 0.5]), 400)
    assert (
        np.ptp(nearer, axis=0).min() > np.ptp(in_square, axis=0).min()
    )  # it grows when it comes nearer


def test_who_reaches_for_the_camera_does_not_reach_it() -> None:
    points = np.array([[0, 0, 0], [0, 1.7, 0], [0.2, 1.0, 2.5]])
    camera, moved = perspective_camera(
        subject(), CAMERA, points, np.zeros(3), Viewpoint(slope=0.3, distance=2.0)
    )
    assert np.isfinite(camera.project(points + moved, 400)).all()


def test_a_crop_that_was_reduced_counts_in_the_photos_pixels() -> None:
    whole, points = subject(), np.array([[0, 0, 0], [0.2, 1.7, 0.1]])
    half = dataclasses.replace(whole, image=whole.image[::2, ::2], mask=whole.mask[::2, ::2])
    reduced = OrthographicCamera(scale=50.0, center_u=45.0, center_v=115.0)
    cameras = [
        perspective_camera(one, of, points, OFFSET, find_viewpoint(None))[0]
        for one, of in ((half, reduced), (whole, CAMERA))
    ]
    np.testing.assert_allclose(cameras[0].origin, cameras[1].origin)
    assert cameras[0].fov == pytest.approx(cameras[1].fov)


def test_a_known_camera_is_found_again() -> None:
    """The ground and the height of a person photographed by a pitched camera are recovered."""
    surface, _ = standing()
    frame = PhotoFrame.looking(np.array([0, 0.85, 0]), distance=4.0, height=1.6)
    seen = frame.warp(surface.vertices)
    scale = 150.0
    flat = OrthographicCamera(
        scale=scale, center_u=200.0, center_v=200.0
    )  # it aims at the person's middle, the photo's
    photo = subject(crop=(0, 0, 400, 400), photo_size=(400, 400))
    camera, moved = perspective_camera(
        photo, flat, seen, np.zeros(3), Viewpoint(slope=0.4, distance=4.0)
    )
    back = seen + moved
    soles = surface.vertices[:, 1] < 1e-6
    assert np.abs(back[soles, 1]).max() < 0.03
    assert np.ptp(back[:, 1]) == pytest.approx(1.7, abs=0.06)
    assert camera.origin[1] == pytest.approx(1.6, abs=0.06)
    down = np.degrees(np.arcsin(camera.axes[2, 1]))
    assert down == pytest.approx(np.degrees(np.arcsin(frame.axes[2, 1])), abs=1.5)


def test_frames_near_the_photo_are_the_photos_and_later_ones_their_own() -> None:
    start: FloatArray = np.zeros((5, 3))
    moved = np.full((5, 3), 0.1)
    np.testing.assert_allclose(as_seen(start, start, moved), moved, atol=1e-7)
    far = start + np.array([0, 0, 1.5])
    np.testing.assert_allclose(as_seen(far, start, moved), far, atol=1e-6)
    way = [
        float(np.abs(as_seen(start + np.array([x, 0, 0]), start, moved)[0, 1]))
        for x in np.linspace(0, 1, 11)
    ]
    assert (np.diff(way) < 0).all()
