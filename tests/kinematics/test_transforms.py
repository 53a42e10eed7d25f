"""Forward and inverse kinematics: inverses of each other, constant bones, the chain convention."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.kinematics import (
    SKELETONS,
    Skeleton,
    best_scale,
    bone_lengths,
    forward_kinematics,
    inverse_kinematics,
    rotvec_to_rotmat,
    skeleton_from_parents,
)

SKELETON_LIST = list(SKELETONS.values())


def random_pose(skeleton, rng, shape=(7,)):
    rotations = rng.normal(size=(*shape, skeleton.n_joints, 3)) * 0.8
    rotations[..., 0, :] = 0
    lengths = rng.uniform(0.1, 0.5, size=skeleton.n_joints)
    lengths[0] = 0
    return rotations, rng.normal(size=(*shape, 3)), lengths


@pytest.mark.parametrize("skeleton", SKELETON_LIST, ids=lambda s: s.name)
def test_forward_agrees_with_the_plain_loop_of_equation_6(skeleton):
    rotations, root, lengths = random_pose(skeleton, np.random.default_rng(0), ())
    expected = np.zeros((skeleton.n_joints, 3))
    expected[0] = root
    for chain in skeleton.chains:
        turned = np.eye(3)
        for parent, joint in pairwise(chain):
            turned = turned @ rotvec_to_rotmat(rotations[joint])
            expected[joint] = expected[parent] + turned @ (
                skeleton.rest_directions[joint] * lengths[joint]
            )
    assert np.allclose(forward_kinematics(rotations, root, lengths, skeleton), expected, atol=1e-12)


@pytest.mark.parametrize("skeleton", SKELETON_LIST, ids=lambda s: s.name)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_inverse_then_forward_returns_the_joints(skeleton, dtype):
    rng = np.random.default_rng(1)
    joints = forward_kinematics(*random_pose(skeleton, rng), skeleton).astype(dtype)
    rotations = inverse_kinematics(joints, skeleton)
    again = forward_kinematics(
        rotations, joints[..., 0, :], bone_lengths(joints, skeleton), skeleton
    )
    assert rotations.dtype == again.dtype == np.dtype(dtype)
    assert np.abs(again - joints).max() < {"float32": 5e-6, "float64": 1e-12}[dtype]


@pytest.mark.parametrize(
    "angle", [0.0, 1e-9, 1e-5, 1e-3, 1.0, np.pi - 1e-2, np.pi - 1e-5, np.pi - 1e-9, np.pi]
)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_bones_that_are_turned_right_back_still_point_where_they_did(angle, dtype):
    """From nothing at all to half a turn: axes are lost at both ends."""
    skeleton = SKELETONS["humanact12"]
    rng = np.random.default_rng(5)
    sideways = rng.normal(size=(100, skeleton.n_joints, 3))
    rest = skeleton.rest_directions
    sideways -= (sideways * rest).sum(-1, keepdims=True) * rest
    axes = np.cross(rest, sideways)
    axes /= np.maximum(np.linalg.norm(axes, axis=-1, keepdims=True), 1e-12)
    joints = forward_kinematics(
        angle * axes, np.zeros((100, 3)), np.full(skeleton.n_joints, 0.3), skeleton
    ).astype(dtype)
    for rotations in (
        inverse_kinematics(joints, skeleton),
        inverse_kinematics(torch.from_numpy(joints), skeleton).numpy(),
    ):
        assert np.linalg.norm(rotations, axis=-1).max() < np.pi + 1e-6
        again = forward_kinematics(
            rotations, joints[..., 0, :], bone_lengths(joints, skeleton), skeleton
        )
        # the axis of a bone that is almost turned back is known to the square root of the precision
        assert np.abs(again - joints).max() < {"float32": 5e-4, "float64": 3e-8}[dtype]


@pytest.mark.parametrize("skeleton", SKELETON_LIST, ids=lambda s: s.name)
def test_bone_lengths_do_not_change_with_the_pose(skeleton):
    rotations, root, lengths = random_pose(skeleton, np.random.default_rng(2), (3, 50))
    measured = bone_lengths(forward_kinematics(rotations, root, lengths, skeleton), skeleton)
    assert np.abs(measured - lengths).max() < 1e-12


def test_torch_equals_numpy_and_has_exact_gradients():
    skeleton = SKELETONS["cmu"]
    rotations, root, lengths = random_pose(skeleton, np.random.default_rng(3), (2,))
    expected = forward_kinematics(rotations, root, lengths, skeleton)
    tensors = [torch.tensor(x, requires_grad=True) for x in (rotations, root, lengths)]
    assert np.allclose(
        forward_kinematics(*tensors, skeleton).detach().numpy(), expected, atol=1e-12
    )
    assert torch.autograd.gradcheck(
        lambda r, o, b: forward_kinematics(r, o, b, skeleton), tuple(tensors)
    )


def test_zero_rotations_are_the_t_pose_facing_forward():
    skeleton = SKELETONS["humanact12"]
    pose = forward_kinematics(np.zeros((24, 3)), np.zeros(3), np.full(24, 0.2), skeleton)
    assert (
        pose[skeleton.index("left_wrist"), 0] > 0.5 > -0.5 > pose[skeleton.index("right_wrist"), 0]
    )
    assert pose[skeleton.index("head"), 1] > 0 > pose[skeleton.index("left_ankle"), 1]
    assert pose[skeleton.index("left_foot"), 2] > pose[skeleton.index("left_ankle"), 2]


def test_zero_length_bones_are_harmless():
    skeleton = SKELETONS["cmu"]
    joints = np.zeros((3, 20, 3))
    rotations = inverse_kinematics(joints, skeleton)
    assert np.isfinite(rotations).all()
    assert np.allclose(rotations, 0)


@pytest.mark.parametrize("skeleton", SKELETON_LIST, ids=lambda s: s.name)
def test_a_skeleton_rebuilt_from_its_parents_gives_the_same_positions(skeleton):
    order = np.argsort(
        [
            len(str(_depth(skeleton.parents, j))) * 1000 + _depth(skeleton.parents, j)
            for j in range(skeleton.n_joints)
        ],
        kind="stable",
    )
    rank = np.argsort(order)
    parents = [-1 if skeleton.parents[j] < 0 else int(rank[skeleton.parents[j]]) for j in order]
    rebuilt = skeleton_from_parents(parents, [skeleton.joint_names[j] for j in order])
    joints = forward_kinematics(*random_pose(skeleton, np.random.default_rng(4)), skeleton)[
        ..., order, :
    ]
    again = forward_kinematics(
        inverse_kinematics(joints, rebuilt),
        joints[..., 0, :],
        bone_lengths(joints, rebuilt),
        rebuilt,
    )
    assert np.abs(again - joints).max() < 1e-12


def _depth(parents, joint):
    depth = 0
    while parents[joint] >= 0:
        joint, depth = parents[joint], depth + 1
    return depth


def test_broken_trees_are_refused():
    with pytest.raises(InputError, match="every parent before"):
        skeleton_from_parents([-1, 2, 0], ["a", "b", "c"])
    with pytest.raises(InputError, match="two bones"):
        Skeleton("x", ("a", "b"), ((0, 1), (0, 1)), np.zeros((2, 3)))
    with pytest.raises(InputError, match="no chain reaches"):
        Skeleton("x", ("a", "b", "c"), ((0, 1),), np.zeros((3, 3)))


def test_best_scale_ignores_what_has_no_weight() -> None:
    points = np.random.default_rng(0).normal(size=(9, 2))
    targets, weights = 3.5 * points + [4.0, -1.0], np.ones(9)
    targets[0], weights[0] = 99.0, 0.0
    assert best_scale(points, targets, weights) == pytest.approx(3.5)
