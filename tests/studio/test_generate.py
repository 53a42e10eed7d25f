"""The fast studio on real avatars: what a view says about its person agrees with itself."""

from __future__ import annotations

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from a2v.body import FitSettings
from a2v.errors import InputError
from a2v.geometry.colors import srgb_to_linear
from a2v.studio.avatars import AVATAR_PARTS, Avatar, load_avatar
from a2v.studio.generate import Studio, StudioSettings, find_layers, write_views
from a2v.studio.guide import Guide, GuideErrors, disturb, fit_guide, guide_key
from a2v.studio.posing import action_poses, joint_noise, natural_pose, open_pose
from a2v.studio.variation import Build, find_clothes, rebuild, recolor, segment_of, split_of
from a2v.studio.view import View, list_views, view_path

NAMES = ("AIAN_F_1_Busi", "Asian_F_2_Busi")  # of the training and of the validation split; the first one has a wig
SETTINGS = StudioSettings(points=3000, surface_points=2000, seed=3)
EXACT = GuideErrors(**{item.name: 0.0 for item in dataclasses.fields(GuideErrors)})


@pytest.fixture(scope="module")
def data(data_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder like the data's, with two avatars."""
    folder = tmp_path_factory.mktemp("data")
    (folder / "avatars").mkdir()
    for name in NAMES:
        (folder / "avatars" / f"{name}.glb").symlink_to(data_dir / "avatars" / f"{name}.glb")
    (folder / "humanact12.zip").symlink_to(data_dir / "humanact12.zip")
    return folder


@pytest.fixture(scope="module")
def avatar(data: Path) -> Avatar:
    return load_avatar(data / "avatars" / f"{NAMES[0]}.glb")


@pytest.fixture(scope="module")
def guide(avatar: Avatar) -> Guide:
    return fit_guide(avatar, FitSettings(rounds=3, steps=8))


@pytest.fixture(scope="module")
def folder(data: Path, avatar: Avatar, guide: Guide, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set's folder, prepared with a quick guide and few poses."""
    made = tmp_path_factory.mktemp("set")
    guide.save(made / "guides" / f"{guide_key(NAMES[0])}.npz")
    action_poses(avatar, str(data), clips=4, frames=2).save(made / "poses.npz")
    return made


@pytest.fixture(scope="module")
def studio(folder: Path, data: Path) -> Studio:
    return Studio.open(folder, data, SETTINGS)


@pytest.fixture(scope="module")
def view(studio: Studio) -> View:
    return studio.view("training", 1)


def depth_at(view: View, points: np.ndarray, name: str) -> np.ndarray:
    """A depth map's value at the pixels of points."""
    depth = getattr(view, name).astype(np.float32)
    column, row = np.floor(view.camera.project(points) * (len(depth) / 1024)).astype(int).T
    return depth[np.clip(row, 0, len(depth) - 1), np.clip(column, 0, len(depth) - 1)]


def test_points_land_on_their_pixels(view: View) -> None:
    seen = view.surface_points[view.surface_visible]
    front, back = depth_at(view, seen, "depth_front"), depth_at(view, view.surface_points, "depth_back")
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
    slope = np.stack([np.gradient(depth, axis=1), -np.gradient(depth, axis=0)], axis=-1) * view.camera.scale / 2
    normals = view.normals_front.astype(np.float32)
    flat = inside & (np.abs(slope).max(axis=-1) < 0.7) & (normals[..., 2] > 80)
    expected = -normals[flat][:, :2] / normals[flat][:, 2:]
    assert flat.sum() > 3000
    assert np.median(np.abs(slope[flat] - expected)) < 0.1


def test_samples_are_on_their_side(view: View) -> None:
    front, back = depth_at(view, view.points, "depth_front"), depth_at(view, view.points, "depth_back")
    distance, z = view.distance.astype(np.float32), view.points[:, 2]
    # what lies before the front, behind the back or beside the person is outside
    for outside in (z > front + 0.01, z < back - 0.01, ~np.isfinite(front)):
        assert outside.sum() > 100
        assert (distance[outside] > -0.008).mean() > 0.98  # a wig's openings are gaps that a ray may pass
    within = (z < front - 0.01) & (z > front - 0.03) & (front - back > 0.08)  # just below the skin of thick parts
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
    low, high = view.camera.project(scene.surface.vertices).min(axis=0), view.camera.project(scene.surface.vertices).max(axis=0)
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


def test_the_same_seed_gives_the_same_view(studio: Studio, folder: Path, data: Path, view: View, tmp_path: Path) -> None:
    again = Studio.open(folder, data, SETTINGS).view("training", 1)
    first, second = view.to_arrays(), again.to_arrays()
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[name], second[name]) for name in first)
    other = studio.view("training", 2)
    assert not np.array_equal(other.image, view.image)
    view.save(tmp_path / "view.npz")
    assert (tmp_path / "view.npz").stat().st_size < 1_500_000
    loaded = View.load(tmp_path / "view.npz")
    for name in ("image", "mask", "depth_front", "normals_back", "guide_depth_back", "parts_front", "points", "guide_vertices"):
        assert np.array_equal(getattr(loaded, name), getattr(view, name), equal_nan=name.startswith(("depth", "guide_depth")))
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


def test_a_data_set_is_resumed_and_never_mixed(folder: Path, data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from pipelines.cli import main

    command = ["studio", "--data", str(data), "--out", str(folder), "--points", "500", "--surface_points", "300", "--validation", "1"]
    assert main([*command, "--training", "1"]) == 0
    first = view_path(folder, "training", 0)
    before = first.stat().st_mtime_ns
    assert main([*command, "--training", "3", "--workers", "2"]) == 0
    assert "3 training and 1 validation views" in capsys.readouterr().out
    assert first.stat().st_mtime_ns == before
    assert [path.name for path in list_views(folder, "training")] == ["000000.npz", "000001.npz", "000002.npz"]
    assert len(View.load(first).points) == 500
    assert json.loads((folder / "index.json").read_text())["settings"]["points"] == 500
    assert main([*command, "--training", "3", "--seed", "9"]) == 2
    assert "other settings" in capsys.readouterr().err
    with pytest.raises(InputError, match="no views of the split 'validation'"):
        list_views(data, "validation")
    with pytest.raises(InputError, match="unknown split 'test'"):
        write_views(folder, data, {"test": 1})
    shutil.rmtree(folder / "views")
    (folder / "index.json").unlink()


@pytest.mark.parametrize(
    "bad", [{"actions": 0.8, "open": 0.4}, {"near_share": 0.9}, {"distance": (5.0, 2.0)}, {"fill": 1.5}, {"points": 0}, {"facing": -0.1}]
)
def test_bad_settings_are_refused(bad: dict) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError):
        StudioSettings(**bad)


def test_guide_follows_the_avatar(avatar: Avatar, guide: Guide) -> None:
    from a2v.geometry.rays import RayScene

    gap = RayScene(avatar.skin(avatar.rest_transforms), avatar.faces).closest(guide.vertices).distance
    assert np.median(gap) < 0.012
    pose = natural_pose(np.random.default_rng(4))
    build = Build(height=1.05, girth={"thigh": 1.1})
    built = rebuild(avatar, build)
    transforms = built.bone_transforms(pose)
    posed = guide.posed(avatar, build, transforms)
    person = built.skin(transforms)
    gap = RayScene(person, avatar.faces).closest(posed).distance
    assert np.median(gap) < 0.013  # scaled, bent and thickened alike
    assert np.allclose(disturb(built, transforms, np.array([0, 0, 1.0]), EXACT, np.random.default_rng(0)), transforms, atol=1e-6)


def test_fits_err_in_depth_more_than_in_the_photo(avatar: Avatar) -> None:
    generator, view = np.random.default_rng(0), np.array([0, 0.1, 0.995])
    view = view / np.linalg.norm(view)
    wrists = [avatar.bone_names.index(f"{side}Hand") for side in ("Left", "Right")]
    shifts = []
    for _ in range(60):
        true = avatar.bone_transforms(natural_pose(generator))
        wrong = disturb(avatar, true, view, GuideErrors(), generator)
        assert np.allclose(np.linalg.det(wrong[:, :3, :3]), 1)
        bones = np.linalg.norm(wrong[1:, :3, 3] - wrong[avatar.bone_parents[1:], :3, 3], axis=1)
        assert np.allclose(bones, np.linalg.norm(true[1:, :3, 3] - true[avatar.bone_parents[1:], :3, 3], axis=1), atol=1e-5)
        shifts.append((wrong - true)[wrists, :3, 3])
    shift = np.concatenate(shifts)
    depth = shift @ view
    beside = np.linalg.norm(shift - depth[:, None] * view, axis=1)
    assert 0.04 < depth.std() < 0.16
    assert np.sqrt((beside**2).mean() / 2) < 0.5 * depth.std()


def test_poses_are_human(avatar: Avatar, studio: Studio) -> None:
    generator = np.random.default_rng(0)
    bone = avatar.bone_names.index
    for make in (natural_pose, open_pose, lambda g: studio.library.pose(int(g.integers(len(studio.library.actions))))):
        for _ in range(25):
            placed = avatar.bone_transforms(joint_noise(make(generator), generator))[:, :3, 3]
            for side in ("Left", "Right"):
                hip, knee, ankle = (placed[bone(f"{side}{name}")] for name in ("UpLeg", "Leg", "Foot"))
                if make is not natural_pose and make is not open_pose:
                    continue
                assert knee[1] < hip[1] - 0.25  # standing
                assert ankle[1] < knee[1] - 0.25
            span = placed[bone("LeftArm")] - placed[bone("RightArm")]
            assert np.hypot(span[0], span[2]) > 0.1
    elbows = [avatar.bone_transforms(natural_pose(generator)) for _ in range(20)]
    for transforms in elbows:
        shoulder, elbow, wrist = (transforms[bone(f"Left{name}"), :3, 3] for name in ("Arm", "ForeArm", "Hand"))
        reach = np.linalg.norm(wrist - shoulder) / (np.linalg.norm(elbow - shoulder) + np.linalg.norm(wrist - elbow))
        assert reach > 0.25  # no forearm folded through the upper arm


def test_builds_scale_segments(avatar: Avatar) -> None:
    assert np.allclose(rebuild(avatar, Build()).skin(avatar.rest_transforms), avatar.skin(avatar.rest_transforms), atol=1e-5)
    tall = rebuild(avatar, Build(height=1.07))
    rest = avatar.skin(avatar.rest_transforms)
    assert np.allclose(tall.skin(tall.rest_transforms), 1.07 * rest, atol=1e-4)
    long = rebuild(avatar, Build(length={"thigh": 1.1}))
    names = list(avatar.bone_names)

    def length(who: Avatar, a: str, b: str) -> float:
        return float(np.linalg.norm(who.rest_transforms[names.index(a), :3, 3] - who.rest_transforms[names.index(b), :3, 3]))

    assert length(long, "LeftUpLeg", "LeftLeg") == pytest.approx(1.1 * length(avatar, "LeftUpLeg", "LeftLeg"), rel=1e-4)
    assert length(long, "LeftLeg", "LeftFoot") == pytest.approx(length(avatar, "LeftLeg", "LeftFoot"), rel=1e-4)
    thick = rebuild(avatar, Build(girth={"lower_arm": 1.2}))
    assert length(thick, "LeftForeArm", "LeftHand") == pytest.approx(length(avatar, "LeftForeArm", "LeftHand"), rel=1e-4)
    assert segment_of("LeftHandIndex2") == "hand"
    assert segment_of("Spine1") == "torso"


def test_other_clothes_on_the_same_skin(avatar: Avatar) -> None:
    clothes = find_clothes(avatar)
    worn = np.zeros(avatar.texture.shape[:2], bool)
    worn[clothes.rows, clothes.columns] = True
    head = avatar.parts[avatar.faces[:, 0]] == AVATAR_PARTS.index("head")
    height, width = worn.shape
    corners = avatar.uv[head].mean(axis=1)
    assert worn[((1 - corners[:, 1]) * height).astype(int), (corners[:, 0] * width).astype(int)].mean() < 0.02
    body = np.isin(avatar.parts[avatar.faces[:, 0]], [AVATAR_PARTS.index("torso"), AVATAR_PARTS.index("left_thigh")])
    corners = avatar.uv[body].mean(axis=1)
    assert worn[((1 - corners[:, 1]) * height).astype(int), (corners[:, 0] * width).astype(int)].mean() > 0.8
    changed = [recolor(avatar.texture, clothes, np.random.default_rng(seed)) for seed in range(6)]
    assert all(np.array_equal(texture[~worn], avatar.texture[~worn]) for texture in changed)
    means = np.array([texture[worn].mean(axis=0) for texture in changed])
    assert means.std(axis=0).min() > 10


def test_the_mouth_is_no_surface(avatar: Avatar) -> None:
    layers = find_layers(avatar)
    assert layers.shell.sum() == (avatar.mesh_ids == avatar.mesh_names.index("h_wig")).sum()
    assert 0.6 < layers.outer.mean() < 1
    rest = avatar.skin(avatar.rest_transforms)
    middle = rest[avatar.faces].mean(axis=1)
    head = (avatar.parts[avatar.faces[:, 0]] == AVATAR_PARTS.index("head")) & (avatar.mesh_ids == 0)
    lips = middle[head & (np.abs(middle[:, 0]) < 0.01) & (middle[:, 1] > 1.5) & (middle[:, 1] < 1.54)][:, 2].max()
    pocket = head & (np.abs(middle - np.array([0, 1.52, lips - 0.035])) < [0.02, 0.02, 0.015]).all(axis=1)
    assert pocket.sum() > 50
    assert layers.outer[pocket].mean() < 0.1
    assert layers.wall[pocket].mean() < 0.2
