"""Motions that other tools write are read to the same joints, by their content."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from a2v.animation.source import source_joints
from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.formats.smpl import NAMES, PELVIS
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.datasets import load_dataset
from tests.support.smpl_files import FILES, FRAMES, JOINTS, PATH, POSES, npy, npz, z_up


@pytest.mark.parametrize("kind", FILES)
def test_arrays_of_other_tools_give_the_same_joints(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "without.suffix"
    path.write_bytes(FILES[kind][0])
    motion = read_motion(path)
    assert motion.fps == FILES[kind][1]
    assert motion.joint_names[:22] == NAMES[:22]
    count = len(motion.joint_names)
    wanted = JOINTS[:, :count]
    if kind == "humanml3d features":  # these begin at the origin
        wanted = wanted - wanted[0, 0] * (1, 0, 1)
    assert np.abs(motion.joints - wanted).max() < 1e-4
    assert {"left_hip", "right_wrist", "neck", "spine3"} <= set(source_joints(motion))


def test_what_was_assumed_is_said(tmp_path: Path) -> None:
    said = {}
    for kind, (content, _) in FILES.items():
        (tmp_path / "m").write_bytes(content)
        said[kind] = " ".join(read_motion(tmp_path / "m").provenance["notes"])
    assert said["mdm"].startswith("of 2 motions the first is read")
    assert "20 frames per second" in said["humanml3d joints"]
    assert "of 2 people '1'" in said["joblib"]
    assert said["amass"] == said["parts"] == said["pickle"] == ""


def test_the_upward_axis_is_by_gravity(tmp_path: Path) -> None:
    """Parameters with AMASS's names may be y up, and a handstand of AMASS stays one."""
    poses, path = z_up()
    np.savez(tmp_path / "y.npz", poses=POSES.reshape(FRAMES, 72), trans=PATH, mocap_framerate=30)
    motion = read_motion(tmp_path / "y.npz")
    assert np.abs(motion.joints - JOINTS).max() < 1e-4
    assert "along y" in motion.provenance["notes"][0]
    over = np.diag([1.0, -1, -1])
    turned = poses.copy()
    turned[:, 0] = _rotvec(over @ rotvec_to_rotmat(poses[:, 0]))
    hips = (path + PELVIS) * (1, 1, 0) + (0, 0, 0.75)
    np.savez(
        tmp_path / "h.npz",
        poses=turned.reshape(FRAMES, 72),
        trans=hips - PELVIS,
        mocap_framerate=30,
    )
    upside = read_motion(tmp_path / "h.npz").joints
    assert (upside[:, 7, 1] > upside[:, 15, 1] + 1).all()


def _rotvec(rotmats: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotmats).as_rotvec())


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (npz(foo=np.zeros((3, 4)), poses=np.zeros((3, 4))), "unknown arrays"),
        (npz(poses=np.full((3, 72), np.nan), trans=np.zeros((3, 3))), "unknown arrays"),
        (npz(poses=np.zeros((3, 72)), trans=np.full((3, 3), np.inf)), "absurd"),
        (npy(np.random.default_rng(0).normal(0, 1, (50, 263))), "normalized"),
        (npy(np.zeros((0, 22, 3))), "0 frames"),
        (pickle.dumps({"poses": print}), "not opened"),
        (b"\x93NUMPY\x01\x00\x10\x00garbage", "not a motion"),
        (b"PK\x03\x04garbage", "not a motion"),
    ],
)  # fmt: skip
def test_other_arrays_are_refused_in_a_sentence(content: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / "m.npz").write_bytes(content)
    with pytest.raises(InputError, match=said):
        read_motion(tmp_path / "m.npz")


def test_motions_of_strangers(data_dir: Path) -> None:
    folder = data_dir / "strangers"
    if not (folder / "test.vrma").is_file():
        pytest.skip(f"{folder} is not present")
    vrma = read_motion(folder / "test.vrma")
    assert (vrma.frames, vrma.fps) == (91, 30)
    joints = source_joints(vrma)
    assert (joints["head"][:, 1] > joints["left_ankle"][:, 1] + 1).all()
    moved = np.ptp(vrma.joints, axis=0).max(axis=1)
    arm = [name in vrma.joint_names[j] for j, name in zip(range(51), ["right"] * 51, strict=True)]
    assert moved[arm].max() > 0.1
    assert read_motion(folder / "amass.npz").fps == 120
    assert read_motion(folder / "mdm_results.npy").frames == 120


def test_a_folder_of_arrays_is_a_data_set(tmp_path: Path) -> None:
    for action in ("walk", "run"):
        (tmp_path / action).mkdir()
        (tmp_path / action / "a.npz").write_bytes(FILES["amass"][0])
    dataset = load_dataset("bvh", tmp_path)
    assert len(dataset) == 2
    assert dataset.actions == ("run", "walk")
