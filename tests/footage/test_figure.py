"""The body with few bones equals the full body; depth does not flicker."""

from __future__ import annotations

import numpy as np
import torch

from a2v.body import load_body_model
from a2v.body.pose_space import pose_space
from a2v.footage.figure import JOINTS, NAMES, Figure
from a2v.footage.modes import steady_depths
from a2v.footage.starts import STIFF, smoother
from a2v.kinematics.names import LANDMARK_INDEX, LIMBS_BY_HEIGHT
from a2v.kinematics.so3 import rotvec_to_rotmat


def test_landmarks_and_joints_are_the_models_own():
    model = load_body_model()
    space, generator = pose_space(model), torch.Generator().manual_seed(0)
    shape = torch.from_numpy(model.shape_default).double()
    angles = 0.3 * torch.randn(3, len(space), generator=generator, dtype=torch.float64)
    root = rotvec_to_rotmat(torch.randn(3, 3, generator=generator, dtype=torch.float64))
    place = torch.randn(3, 3, generator=generator, dtype=torch.float64)
    figure = Figure(model, shape)
    turns, heads = figure.pose(root, angles, place)
    for pose in range(3):
        rotmats = rotvec_to_rotmat(space.rotvecs(angles[pose]))
        rotmats[0] = root[pose]
        state = model.forward(rotmats, shape, place[pose])
        assert torch.allclose(
            figure.landmarks(turns, heads)[pose], model.landmarks(state), atol=1e-6
        )
        for name in ("left_wrist", "right_foot", "left_hand", "spine2"):
            bone = next(bone for own, _, bone in JOINTS if own == name)
            assert torch.allclose(
                figure.joints(turns, heads)[pose, NAMES.index(name)],
                state.joints[model.bone(bone)],
                atol=1e-6,
            )


def test_a_forearm_that_jumps_to_the_back_for_a_frame_stays_in_front():
    frames, height = 20, 200.0
    points, pixels = np.zeros((frames, 33, 3)), np.zeros((frames, 33, 2))
    shoulder, elbow, wrist = (
        LANDMARK_INDEX[f"left_{name}"] for name in ("shoulder", "elbow", "wrist")
    )
    upper, lower = (
        1.7 * LIMBS_BY_HEIGHT[pair] for pair in (("shoulder", "elbow"), ("elbow", "wrist"))
    )
    points[:, elbow] = points[:, shoulder] + [0, -upper, 0]
    points[:, wrist] = points[:, elbow] + [0, 0.3 * lower, 0.9 * lower]
    pixels[:] = points[..., :2] * [1, -1] * height / 1.7
    jumped = points.copy()
    jumped[9:11, wrist, 2] = points[9:11, elbow, 2] - 0.9 * lower
    times = np.arange(frames) / 30
    found = steady_depths(jumped, pixels, np.full(frames, height), times, np.ones((frames, 33)))
    assert np.allclose(found[..., wrist, 2], points[..., wrist, 2], atol=1e-6)
    assert np.allclose(
        steady_depths(points, pixels, np.full(frames, height), times, np.ones((frames, 33))), points
    )


def test_the_preconditioner_undoes_the_stiffness():
    count = 12
    second = np.diff(np.eye(count), n=2, axis=0)
    stiff = np.eye(count) + STIFF * second.T @ second
    easy = smoother(count)
    assert np.allclose(easy @ stiff @ easy, np.eye(count), atol=1e-9)
