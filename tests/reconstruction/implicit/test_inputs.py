from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.reconstruction.implicit.inputs import (
    FRAME,
    GuideMesh,
    frame_box,
    guide_input,
    make_frame,
    mask_distance,
    photo_input,
    place_of,
)
from a2v.types import OrthographicCamera
from tests.support.ellipsoid import AXES, CAMERA, ellipsoid


@pytest.mark.parametrize(
    ("height", "width", "left", "top", "tall"),
    [(700, 500, 120, 40, 600), (90, 70, 20, 5, 80), (3000, 2000, 700, 300, 2400)],
)
def test_a_point_lands_on_its_pixel_in_the_frame(
    height: int, width: int, left: int, top: int, tall: int
) -> None:
    """A colored spot keeps its place in the world whatever the photo's size; the person fills 0.9
    of the frame."""
    wide = tall // 4
    image, mask = np.zeros((height, width, 3), np.uint8), np.zeros((height, width), np.float32)
    mask[top : top + tall, left : left + wide] = 1
    spot = (top + tall // 3, left + wide // 2)
    size = max(1, tall // 60)
    image[spot[0] - size : spot[0] + size, spot[1] - size : spot[1] + size] = 255
    camera = OrthographicCamera(scale=tall / 1.7, center_u=left + wide / 2, center_v=top + tall)
    point = camera.unproject(np.array([spot[1], spot[0]], float), 0.3)
    frame = make_frame(image, mask, camera)
    rows, columns = np.nonzero(frame.image[..., 0] > 180)
    found = np.array([columns.mean() + 0.5, rows.mean() + 0.5])
    assert np.abs(found - frame.camera.project(point)).max() < 1.0
    assert frame_box(frame.mask)[2] == pytest.approx(FRAME, rel=0.02)
    assert np.abs(place_of(point, frame.camera, frame.size) - (found / FRAME * 2 - 1)).max() < 0.002


def test_an_empty_mask_is_refused() -> None:
    with pytest.raises(InputError, match="mask is empty"):
        make_frame(np.zeros((50, 50, 3), np.uint8), np.zeros((50, 50)), CAMERA)


def test_the_guide_knows_inside_and_outside_front_and_back() -> None:
    mesh = ellipsoid()
    guide = GuideMesh(mesh.vertices, mesh.faces)
    distance, normals = guide.at(
        np.array(
            [[0, 0, 0], [0, 0, AXES[2] + 0.1], [0, 0, -AXES[2] - 0.1], [0.9, 0, 0]], np.float32
        )
    )
    assert distance == pytest.approx([-AXES[2], 0.1, 0.1, 0.9 - AXES[0]], abs=2e-3)
    assert normals[1] == pytest.approx([0, 0, 1], abs=0.05)
    assert normals[2] == pytest.approx([0, 0, -1], abs=0.05)
    maps = guide.maps(CAMERA, FRAME)
    middle = maps.depth_front.shape[0] // 2
    assert maps.depth_front[middle, middle] == pytest.approx(AXES[2], abs=2e-3)
    assert maps.depth_back[middle, middle] == pytest.approx(-AXES[2], abs=2e-3)
    inside = np.isfinite(maps.depth_front)
    assert (maps.normals_front[inside][:, 2] >= 0).all()
    assert (maps.normals_back[inside][:, 2] <= 0).all()
    right = maps.normals_front[middle, np.nonzero(inside[middle])[0][-2]]
    assert right[0] > 0.5  # the picture's right is +x
    right_behind = maps.normals_back[middle, np.nonzero(inside[middle])[0][-2]]
    assert right_behind[0] > 0.5


def test_mask_distance_is_signed_and_in_meters() -> None:
    mask = np.zeros((100, 100), np.float32)
    mask[20:80, 30:70] = 1
    distance = mask_distance(mask, 200.0)
    assert distance[50, 50] == pytest.approx(-20 / 200, abs=0.006)
    assert distance[50, 90] == pytest.approx(20 / 200, abs=0.006)
    assert (distance < 0).sum() == mask.sum()


def test_channels_leave_the_background_out() -> None:
    image = np.full((64, 64, 3), 250, np.uint8)
    mask = np.zeros((64, 64), np.float32)
    mask[16:48, 16:48] = 1
    channels = photo_input(image, mask, 64)
    assert channels.shape == (4, 64, 64)
    assert (channels[:, mask == 0] == 0).all()
    assert channels[:3, 32, 32] == pytest.approx(250 / 255 - 0.5)
    mesh = ellipsoid()
    maps = GuideMesh(mesh.vertices, mesh.faces).maps(CAMERA, FRAME)
    assert np.isfinite(guide_input(maps, np.zeros(maps.depth_front.shape, np.float32))).all()
