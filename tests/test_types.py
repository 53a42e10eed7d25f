"""Values between stages: optional parts stay absent in the file."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.io import read_npz
from a2v.kinematics import CMU
from a2v.kinematics.resample import resample_motion
from a2v.motion.edit import change_speed
from a2v.types import Motion, Reconstruction, Surface


@pytest.fixture
def motion() -> Motion:
    zeros = np.zeros((13, 20, 3), np.float32)
    return Motion(
        joints=zeros,
        rotations=zeros,
        root=zeros[:, 0],
        fps=12.0,
        parents=CMU.parents,
        joint_names=CMU.joint_names,
        skeleton="cmu",
    )


def test_a_motion_keeps_its_rest_pose_and_what_was_given(motion, tmp_path):
    offsets = np.random.default_rng(0).normal(size=(20, 3))
    made = dataclasses.replace(
        motion,
        rest_offsets=offsets,
        given_frames=5,
        action="Walk,Jump",
        action_starts=np.array([0.0, 0.5]),
    )
    made.save(tmp_path / "m.npz")
    again = Motion.load(tmp_path / "m.npz")
    assert again.rest_offsets is not None
    assert np.array_equal(again.rest_offsets, offsets)
    assert again.rest_offsets.dtype == np.float64
    assert (
        again.given_frames,
        again.first(3).given_frames,
        resample_motion(again, 24.0).given_frames,
    ) == (5, 3, 9)
    assert (again.action_starts.tolist(), change_speed(again, 2.0).action_starts.tolist()) == (
        [0.0, 0.5],
        [0.0, 0.25],
    )


def test_a_motion_without_them_has_no_arrays_of_them(motion, tmp_path):
    motion.save(tmp_path / "m.npz")
    assert not {"rest_offsets", "given_frames", "action_starts"} & set(read_npz(tmp_path / "m.npz"))
    again = Motion.load(tmp_path / "m.npz")
    assert (again.rest_offsets, again.given_frames, again.first(3).given_frames) == (
        None,
        None,
        None,
    )


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("rest_offsets", np.zeros((19, 3)), r"\(20, 3\)"),
        ("given_frames", 14, "0 to 13"),
        ("action_starts", np.zeros(2), r"expected \(1\)"),
    ],
)
def test_what_does_not_fit_is_refused(motion, field, value, words):
    with pytest.raises(InputError, match=words):
        dataclasses.replace(motion, **{field: value})


@pytest.fixture
def triangle() -> Surface:
    return Surface(
        vertices=np.eye(3, dtype=np.float32),
        faces=np.array([[0, 1, 2]], np.int32),
        colors=np.zeros((3, 3), np.float32),
    )


def test_a_reconstruction_keeps_what_its_backend_expects_and_does_not_know(triangle, tmp_path):
    colors = np.array([[0.1, 0.2, 0.3], [np.nan, np.nan, np.nan], [1, 1, 1]], np.float32)
    Reconstruction(surface=triangle, backend="pifu", expected_colors=colors).save(
        tmp_path / "r.npz"
    )
    again = Reconstruction.load(tmp_path / "r.npz")
    assert (again.backend, again.from_body) == ("pifu", False)
    assert again.expected_colors is not None
    assert np.array_equal(again.expected_colors, colors, equal_nan=True)
    Reconstruction(surface=triangle, backend="body-prior", from_body=True).save(tmp_path / "r.npz")
    again = Reconstruction.load(tmp_path / "r.npz")
    assert (again.from_body, again.expected_colors) == (True, None)


def test_nan_is_refused_where_it_means_nothing(triangle):
    with pytest.raises(InputError, match="NaN"):
        dataclasses.replace(triangle, colors=np.full((3, 3), np.nan, np.float32))
    with pytest.raises(InputError, match=r"\(3, 3\)"):
        Reconstruction(
            surface=triangle, backend="pifu", expected_colors=np.zeros((2, 3), np.float32)
        )
