"""Views of the fast studio on real avatars: the data of a view about its person is consistent."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.geometry.colors import srgb_to_linear
from a2v.lab.studio.posing import POSED_BONES
from a2v.lab.studio.quick.bank import PoseBank
from a2v.lab.studio.studio import Studio, packed_normals
from a2v.lab.studio.variation import split_of
from a2v.lab.studio.view import View


def depth_at(view: View, points: np.ndarray, name: str) -> np.ndarray:
    """A depth map's value at the pixels of points."""
    depth = getattr(view, name).astype(np.float32)
    column, row = np.floor(view.camera.project(points) * (len(depth) / 1024)).astype(int).T
    return depth[np.clip(row, 0, len(depth) - 1), np.clip(column, 0, len(depth) - 1)]


def test_points_land_on_their_pixels(view: View) -> None:
    seen = view.surface_points[view.surface_visible]
    front, back = (
        depth_at(view, seen, "depth_front"),
        depth_at(view, view.surface_points, "depth_back"),
    )
    known = np.isfinite(front)
    assert known.mean() > 0.92  # the others are at the rim
    assert np.quantile(np.abs(front - seen[:, 2])[known], [0.5, 0.9]).tolist() < [0.002, 0.015]
    assert (view.surface_points[:, 2] >= back - 0.02)[np.isfinite(back)].mean() > 0.97
    parts = view.parts_front[tuple(np.floor(view.camera.project(seen) / 2).astype(int).T[::-1])]
    assert (parts == view.surface_parts[view.surface_visible])[parts >= 0].mean() > 0.93


def test_normals_depth_and_mask_agree(view: View) -> None:
    inside = np.isfinite(view.depth_front)
    assert (inside == np.isfinite(view.depth_back)).mean() > 0.999
    assert (inside == (view.mask[::2, ::2] > 127)).mean() > 0.99
    assert (view.depth_front >= view.depth_back)[inside & np.isfinite(view.depth_back)].all()
    assert (inside == (view.parts_front >= 0)).all()
    for name, sign in (("normals_front", 1), ("normals_back", -1)):
        normals = getattr(view, name).astype(np.float32) / 127
        assert np.abs(np.linalg.norm(normals[inside], axis=-1) - 1).max() < 0.02
        assert (sign * normals[inside][:, 2] >= 0).all()
        assert not normals[~inside].any()
    # the slope of the depth is that of the normals, where the surface is smooth
    depth = view.depth_front.astype(np.float32)
    slope = (
        np.stack([np.gradient(depth, axis=1), -np.gradient(depth, axis=0)], axis=-1)
        * view.camera.scale
        / 2
    )
    normals = view.normals_front.astype(np.float32)
    flat = inside & (np.abs(slope).max(axis=-1) < 0.7) & (normals[..., 2] > 80)
    expected = -normals[flat][:, :2] / normals[flat][:, 2:]
    assert flat.sum() > 3000
    assert np.median(np.abs(slope[flat] - expected)) < 0.1


def test_samples_are_on_their_side(view: View) -> None:
    front, back = (
        depth_at(view, view.points, "depth_front"),
        depth_at(view, view.points, "depth_back"),
    )
    distance, z = view.distance.astype(np.float32), view.points[:, 2]
    # what lies before the front, behind the back or beside the person is outside
    for outside in (z > front + 0.01, z < back - 0.01, ~np.isfinite(front)):
        assert outside.sum() > 100
        assert (
            distance[outside] > -0.008
        ).mean() > 0.98  # a wig's openings are gaps that a ray may pass
    within = (
        (z < front - 0.01) & (z > front - 0.03) & (front - back > 0.08)
    )  # just below the skin of thick parts
    assert within.sum() > 50
    assert (distance[within] < 0.002).mean() > 0.98
    assert 0.25 < (distance < 0).mean() < 0.45
    near, far = (np.abs(distance) < 0.015).mean(), (np.abs(distance) > 0.1).mean()
    assert near > 0.35
    assert 0.02 < far < 0.2
    guide = np.isfinite(depth_at(view, view.points, "guide_depth_front"))
    assert (view.guide_distance[~guide].astype(np.float32) > -0.01).all()
    assert view.guide_normals.dtype == np.int8
    assert np.abs(np.linalg.norm(view.guide_normals.astype(float) / 127, axis=1) - 1).max() < 0.02


def test_the_truth_is_the_same_person(studio: Studio, view: View) -> None:
    scene = studio.scene("training", 1)
    assert np.array_equal(scene.surface.vertices, studio.truth("training", 1).vertices)
    assert np.abs(scene.solid().signed_distance(view.surface_points)).max() < 1e-4
    assert np.array_equal(scene.guide, view.guide_vertices)
    assert abs(float(view.guide_vertices[:, 2].mean())) < 1e-4
    low, high = (
        view.camera.project(scene.surface.vertices).min(axis=0),
        view.camera.project(scene.surface.vertices).max(axis=0),
    )
    assert (high - low).max() == pytest.approx(0.9 * 1024, abs=0.1)
    assert np.allclose((low + high) / 2, 512, atol=0.1)


def test_colors_are_what_the_photo_shows_on_average(view: View) -> None:
    seen = view.surface_visible & (np.abs(view.surface_normals[:, 2].astype(int)) > 60)
    column, row = np.floor(view.camera.project(view.surface_points[seen])).astype(int).T
    photo = srgb_to_linear(view.image[row, column] / 255)
    said = srgb_to_linear(view.surface_colors[seen] / 255)
    bright = said.mean(axis=1) > 0.02
    assert 0.75 < np.median(photo[bright].mean(axis=1) / said[bright].mean(axis=1)) < 1.35
    assert np.corrcoef(photo.mean(axis=1), said.mean(axis=1))[0, 1] > 0.6


def test_a_shot_has_the_photo_and_the_surface_of_the_view(studio: Studio, view: View) -> None:
    shot = studio.shot("training", 1, studio.scene("training", 1))
    assert np.array_equal(shot.image, view.image)
    assert np.array_equal(shot.photo.mask, view.mask)
    assert np.array_equal(shot.samples.points, view.surface_points)
    assert np.array_equal(packed_normals(shot.samples.normals), view.surface_normals)


def test_the_same_seed_gives_the_same_view(
    studio: Studio, folder: Path, data: Path, view: View, tmp_path: Path
) -> None:
    again = Studio.open(folder, data, studio.settings).view("training", 1)
    first, second = view.to_arrays(), again.to_arrays()
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[name], second[name]) for name in first)
    other = studio.view("training", 2)
    assert not np.array_equal(other.image, view.image)
    view.save(tmp_path / "view.npz")
    assert (tmp_path / "view.npz").stat().st_size < 1_500_000
    loaded = View.load(tmp_path / "view.npz")
    for name in (
        "image",
        "mask",
        "depth_front",
        "normals_back",
        "guide_depth_back",
        "parts_front",
        "points",
        "guide_vertices",
    ):
        assert np.array_equal(
            getattr(loaded, name),
            getattr(view, name),
            equal_nan=name.startswith(("depth", "guide_depth")),
        )
    assert loaded.camera == view.camera
    broken = {**first, "encoded.mask": first["encoded.mask"][:40]}
    with pytest.raises(InputError, match="'mask' is damaged"):
        _ = View.from_arrays(broken).mask
    with pytest.raises(InputError, match="no picture 'mask'"):
        View.from_arrays({name: value for name, value in first.items() if name != "encoded.mask"})


def test_splits_never_mix(studio: Studio) -> None:
    assert split_of("Asian_F_2_Busi") == split_of("White_F_1_Medi") == "validation"
    assert split_of("White_F_1_Util") == split_of("Asian_F_1_Casual") == "training"
    assert {path.stem for path in studio.paths["training"]} == {"AIAN_F_1_Busi"}
    assert studio.scene("validation", 0).avatar == "Asian_F_2_Busi"


def test_varied_poses_come_from_the_bank(
    studio: Studio, folder: Path, data: Path, tmp_path: Path
) -> None:
    rotations = np.zeros((2, len(POSED_BONES), 3), np.float16)
    rotations[:, POSED_BONES.index("LeftUpLeg"), 0] = -1.5  # a raised leg
    none = np.zeros(2, np.int8)
    for name in ("poses.npz", "guide.npz"):
        (tmp_path / name).symlink_to(folder / name)
    PoseBank(rotations=rotations, sets=none, splits=none, kinds=none.astype(np.int16)).save(
        tmp_path / "bank.npz"
    )
    settings = dataclasses.replace(studio.settings, varied=0.5)
    mixed = Studio.open(tmp_path, data, settings)
    poses = [mixed.scene("training", index).pose for index in range(12)]
    assert 2 <= poses.count("varied") <= 10
    scene = mixed.scene("training", poses.index("varied"))
    assert np.isfinite(scene.surface.vertices).all()
    with pytest.raises(InputError, match="from 0 to 1"):
        dataclasses.replace(studio.settings, varied=1.5)
