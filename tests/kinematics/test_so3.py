"""Group laws and round trips of the rotation maps, in numpy and torch, in both dtypes."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from a2v.kinematics import so3

TOLERANCE = {"float32": 2e-6, "float64": 1e-13}


@pytest.fixture(params=["numpy-float32", "numpy-float64", "torch-float32", "torch-float64"])
def make(request):
    """Turn a numpy array into the backend and dtype under test; carries `.tol`."""
    backend, dtype = request.param.split("-")

    def convert(array):
        array = np.asarray(array, dtype=dtype)
        return torch.from_numpy(array.copy()) if backend == "torch" else array

    convert.tol = TOLERANCE[dtype]
    return convert


def rotvecs(seed=0, n=500):
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(n, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.concatenate(
        [rng.uniform(0, np.pi - 1e-3, n - 60), np.geomspace(1e-9, 0.2, 59), [0.0]]
    )
    return axes * angles[:, None]


def test_exponential_agrees_with_scipy(make):
    w = rotvecs()
    assert np.allclose(
        np.asarray(so3.rotvec_to_rotmat(make(w))),
        Rotation.from_rotvec(w).as_matrix(),
        atol=4 * make.tol,
    )


def test_exponential_is_a_rotation_and_inverse_is_transpose(make):
    w = make(rotvecs())
    rotmat = np.asarray(so3.rotvec_to_rotmat(w))
    assert np.allclose(rotmat @ rotmat.swapaxes(-1, -2), np.eye(3), atol=4 * make.tol)
    assert np.allclose(np.linalg.det(rotmat), 1, atol=8 * make.tol)
    assert np.allclose(
        np.asarray(so3.rotvec_to_rotmat(-w)), rotmat.swapaxes(-1, -2), atol=4 * make.tol
    )


def test_turns_about_one_axis_add(make):
    w = rotvecs()
    sum_of_two = so3.rotvec_to_rotmat(make(0.3 * w)) @ so3.rotvec_to_rotmat(make(0.7 * w))
    assert np.allclose(
        np.asarray(sum_of_two), np.asarray(so3.rotvec_to_rotmat(make(w))), atol=8 * make.tol
    )


def test_logarithm_inverts_exponential(make):
    w = rotvecs()
    back = np.asarray(so3.rotmat_to_rotvec(so3.rotvec_to_rotmat(make(w))))
    assert np.allclose(
        back, w, atol=200 * make.tol
    )  # near a half turn the axis is known to sqrt(eps) only


def test_half_turns_come_back_as_half_turns(make):
    axes = np.concatenate([np.eye(3), rotvecs(3, 100)[:20]])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    rotmat = so3.rotvec_to_rotmat(make(np.pi * axes))
    again = so3.rotvec_to_rotmat(so3.rotmat_to_rotvec(rotmat))
    assert np.allclose(np.asarray(again), np.asarray(rotmat), atol=20 * make.tol)


def test_quaternion_round_trips_and_product(make):
    a, b = rotvecs(1), rotvecs(2)
    qa, qb = so3.rotvec_to_quat(make(a)), so3.rotvec_to_quat(make(b))
    assert np.allclose(np.asarray(so3.quat_to_rotvec(qa)), a, atol=200 * make.tol)
    product = so3.quat_to_rotmat(so3.quat_multiply(qa, qb))
    assert np.allclose(
        np.asarray(product),
        np.asarray(so3.quat_to_rotmat(qa) @ so3.quat_to_rotmat(qb)),
        atol=10 * make.tol,
    )
    assert np.allclose(
        np.asarray(so3.rotmat_to_quat(so3.quat_to_rotmat(qa))), np.asarray(qa), atol=20 * make.tol
    )


def test_slerp_ends_and_middle(make):
    a, b = so3.rotvec_to_quat(make(rotvecs(1))), so3.rotvec_to_quat(make(rotvecs(2)))
    assert np.allclose(np.asarray(so3.slerp(a, b, 0.0)), np.asarray(a), atol=10 * make.tol)
    half = so3.slerp(a, b, 0.5)
    end = np.asarray(so3.quat_to_rotmat(so3.slerp(half, b, 1.0)))
    assert np.allclose(end, np.asarray(so3.quat_to_rotmat(b)), atol=40 * make.tol)
    forth, back = (np.abs(np.sum(np.asarray(half) * np.asarray(x), -1)) for x in (a, b))
    assert np.allclose(forth, back, atol=40 * make.tol)


def test_hat_is_the_cross_product(make):
    a, b = rotvecs(1), rotvecs(2)
    assert np.allclose(
        (np.asarray(so3.hat(make(a))) @ b[..., None])[..., 0], np.cross(a, b), atol=10 * make.tol
    )


def test_swing_turns_source_into_target_by_the_least_angle(make):
    a, b = np.random.default_rng(4).normal(size=(2, 500, 3))
    swing = so3.swing_between(make(a), make(b))
    turned = (np.asarray(so3.rotvec_to_rotmat(swing)) @ a[..., None])[..., 0]
    assert np.allclose(
        turned / np.linalg.norm(turned, axis=1)[:, None],
        b / np.linalg.norm(b, axis=1)[:, None],
        atol=50 * make.tol,
    )
    angle = np.arccos(
        np.clip((a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1), -1, 1)
    )
    assert np.allclose(np.linalg.norm(np.asarray(swing), axis=1), angle, atol=1e-3)


@pytest.mark.parametrize("axis", np.eye(3))
def test_swing_of_opposite_and_of_zero_directions(make, axis):
    half = np.asarray(so3.rotvec_to_rotmat(so3.swing_between(make(axis), make(-axis))))
    assert np.allclose(half @ axis, -axis, atol=10 * make.tol)
    assert np.allclose(np.asarray(so3.swing_between(make(axis), make(0 * axis))), 0)


def test_gradients_are_exact_and_finite_at_the_identity():
    w = torch.tensor(
        [[0.0, 0, 0], [1e-5, 0, 0], [0.02, -0.01, 0.03], [1.0, 2.0, -0.5]],
        dtype=torch.float64,
        requires_grad=True,
    )
    assert torch.autograd.gradcheck(so3.rotvec_to_rotmat, (w,))
    assert torch.autograd.gradcheck(so3.rotvec_to_quat, (w,))
    assert torch.autograd.gradcheck(lambda x: so3.rotmat_to_rotvec(so3.rotvec_to_rotmat(x)), (w,))
