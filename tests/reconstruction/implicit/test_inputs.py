from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.reconstruction.implicit.batches import ViewReader, align_example, make_example
from a2v.reconstruction.implicit.inputs import FRAME, GuideMesh, frame_box, guide_input, make_frame, mask_distance, photo_input, place_of
from a2v.studio.view import View, view_path
from a2v.types import OrthographicCamera
from tests.support.ellipsoid import AXES, CAMERA, RED, ellipsoid


@pytest.mark.parametrize(
    ("height", "width", "left", "top", "tall"), [(700, 500, 120, 40, 600), (90, 70, 20, 5, 80), (3000, 2000, 700, 300, 2400)]
)
def test_a_point_lands_on_its_pixel_in_the_frame(height: int, width: int, left: int, top: int, tall: int) -> None:
    """A coloured spot keeps its place in the world whatever the photo's size; the person fills 0.9 of the frame."""
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
    distance, normals = guide.at(np.array([[0, 0, 0], [0, 0, AXES[2] + 0.1], [0, 0, -AXES[2] - 0.1], [0.9, 0, 0]], np.float32))
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


def test_mask_distance_is_signed_and_in_metres() -> None:
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


def test_mirroring_is_a_symmetry_of_the_example(view: View, studio) -> None:
    """The mirrored example of a mirrored world is consistent: points with negative distances stay inside of the mask."""
    prepared = ViewReader()(view_path(studio, "training", 0))
    seen = {True: 0, False: 0}
    for seed in range(12):
        example = make_example(prepared, np.random.default_rng(seed), 512)
        inside = example.points["distance"] < -0.02
        pixels = np.floor((example.points["place"] + 1) / 2 * 512).astype(int)
        assert (example.photo[3, pixels[inside, 1], pixels[inside, 0]] > 0.5).all()
        there = example.guide[8] > 0
        columns = np.broadcast_to(np.arange(256), (256, 256))[there]
        slope = np.corrcoef(columns, example.guide[0][there])[0, 1]
        assert slope > 0.5  # normals still point to the right on the right
        seen[bool(example.mirrored)] += 1
        color = example.photo[:3, 256, 256] + 0.5
        assert color[0] > color[1]
        assert np.abs(color * 255 / RED).max() < 1.3
    assert min(seen.values()) > 0


@pytest.mark.parametrize("seed", range(6))
def test_points_follow_the_predicted_depth(studio, seed: int) -> None:
    """Where the maps have a person 7 cm nearer than it is, its points are asked about 7 cm nearer; mirrored or not."""
    prepared = ViewReader()(view_path(studio, "training", 0))
    example = make_example(prepared, np.random.default_rng(seed), 256)
    rows, columns = prepared.nearest.astype(int)
    true = prepared.depth.astype(np.float32)[:, rows, columns]
    there = example.points["position"][:, 2]
    stay = align_example(prepared, example, true[..., ::-1] if example.mirrored else true)
    assert np.abs(stay["depth"] - there).max() < 5e-3
    moved = align_example(prepared, example, (true[..., ::-1] if example.mirrored else true) + np.float32(0.07))
    assert np.abs(moved["depth"] - there - 0.07).max() < 5e-3
    front = there > 0.2
    assert (moved["guide_distance"][front] > stay["guide_distance"][front] + 0.03).all()
    right = example.points["place"][:, 0] > 0.15
    assert (stay["guide_normals"][right][:, 0] > 0).mean() > 0.95


def test_parts_of_the_frame_hold_their_pixels(studio) -> None:
    prepared = ViewReader()(view_path(studio, "training", 1))
    example = make_example(prepared, np.random.default_rng(3), 64, crop=256)
    left, top = example.part["corner"].astype(int)
    assert example.part["photo"].shape == (4, 256, 256)
    assert example.part["normals"].shape == (6, 128, 128)
    half = example.photo[3, top // 2 : (top + 256) // 2, left // 2 : (left + 256) // 2]
    assert np.abs(example.part["photo"][3, ::2, ::2] - half).mean() < 0.02
