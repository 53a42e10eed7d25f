"""Motions that other tools write are read to the same joints, by their content."""

from __future__ import annotations

import io
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v.animation.source import source_joints
from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.formats.smpl import NAMES, OFFSETS, PARENTS, PELVIS
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.datasets import load_dataset

FRAMES = 40
QUARTER = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""Turns y up into z up."""


def walk(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotation vectors (T, 24, 3) and translations (T, 3) of somebody who walks along +z and swings
    the arms, y up, and the joints (T, 24, 3) by forward kinematics of its own."""
    rng = np.random.default_rng(seed)
    time = np.arange(FRAMES) / 30
    poses = np.cumsum(rng.normal(0, 0.01, (FRAMES, 24, 3)), axis=0)
    poses[:, 1, 0], poses[:, 2, 0] = 0.4 * np.sin(6 * time), -0.4 * np.sin(6 * time)
    poses[:, 16, 2], poses[:, 17, 2] = -1.2, 1.2
    poses[:, 22:] = 0
    path = np.stack([0 * time, 1.15 + 0 * time, 1.2 * time], axis=1)
    joints = np.zeros((FRAMES, 24, 3))
    for t in range(FRAMES):
        turned = [np.eye(3)] * 24
        for j, parent in enumerate(PARENTS):
            own = rotvec_to_rotmat(poses[t, j])
            turned[j] = own if parent < 0 else turned[parent] @ own
            joints[t, j] = (
                path[t] + PELVIS if parent < 0 else joints[t, parent] + turned[parent] @ OFFSETS[j]
            )
    return poses, path, joints


POSES, PATH, JOINTS = walk()


def z_up() -> tuple[np.ndarray, np.ndarray]:
    """The same rotations and translations with z up: the pelvis turns about itself."""
    from scipy.spatial.transform import Rotation

    poses = POSES.copy()
    poses[:, 0] = Rotation.from_matrix(QUARTER @ rotvec_to_rotmat(POSES[:, 0])).as_rotvec()
    return poses, (PATH + PELVIS) @ QUARTER.T - PELVIS


def npz(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def npy(array: Any) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def joblib_file(value: Any) -> bytes:
    import joblib

    stream = io.BytesIO()
    joblib.dump(value, stream)
    return stream.getvalue()


def torch_file(value: Any) -> bytes:
    import torch

    stream = io.BytesIO()
    torch.save(value, stream)
    return stream.getvalue()


def six(poses: np.ndarray) -> np.ndarray:
    return rotvec_to_rotmat(poses)[..., :2].reshape(*poses.shape[:-1], 6)


def features() -> np.ndarray:
    """HumanML3D's 263 numbers a frame, of the joints."""
    heading = 0.3 * np.arange(FRAMES) / FRAMES  # half of the turn, as the format counts it
    turn = rotvec_to_rotmat(np.stack([0 * heading, 2 * heading, 0 * heading], axis=1))
    made = np.zeros((FRAMES, 263))
    made[:-1, 0] = np.diff(heading)
    steps = np.diff(JOINTS[:, 0], axis=0)
    made[:-1, 1:3] = np.einsum("tab,tb->ta", turn[1:], steps)[:, [0, 2]]
    made[:, 3] = JOINTS[:, 0, 1]
    others = JOINTS[:, 1:22] - JOINTS[:, :1] * (1, 0, 1)
    made[:, 4:67] = np.einsum("tab,tjb->tja", turn, others).reshape(FRAMES, 63)
    return made


def hands(poses: np.ndarray, count: int) -> np.ndarray:
    """(T, 3 count) of SMPL-H or SMPL-X: 22 joints of the body, then jaw, eyes or fingers."""
    rest = np.random.default_rng(1).normal(0, 0.2, (FRAMES, count - 22, 3))
    return np.concatenate([poses[:, :22], rest], axis=1).reshape(FRAMES, -1)


def files() -> dict[str, tuple[bytes, float]]:
    """Content and frame rate of each kind."""
    poses, path = z_up()
    flat = POSES.reshape(FRAMES, 72)
    motion_x = np.zeros((FRAMES, 322))
    motion_x[:, :66], motion_x[:, 309:312] = flat[:, :66], PATH
    world = {"body_pose": POSES[:, 1:22].reshape(FRAMES, 63), "global_orient": POSES[:, 0], "transl": PATH}  # fmt: skip
    import torch

    tensors = {name: torch.tensor(value)[None] for name, value in world.items()}
    mdm = {
        "motion": np.moveaxis(JOINTS[:, :22], 0, -1)[None].repeat(2, axis=0),
        "text": ["walks", "walks"],
        "lengths": np.array([FRAMES, 30]),
        "num_samples": 1,
        "num_repetitions": 2,
    }
    return {
        "amass": (npz(poses=hands(poses, 52), trans=path, gender="male", mocap_framerate=120.0, dmpls=np.zeros((FRAMES, 8))), 120),
        "smplx": (npz(poses=hands(poses, 55), trans=path, mocap_frame_rate=60.0, markers_latent=np.array([None, 1], object)), 60),
        "parts": (npz(root_orient=POSES[:, 0], pose_body=flat[:, 3:66], trans=PATH, fps=25), 25),
        "pickle": (pickle.dumps({"poses": flat, "trans": PATH, "fps": 25.0}, 2), 25),
        "joblib": (joblib_file({1: {"pose_world": flat, "trans_world": PATH}, 0: {"pose_world": flat[:5], "trans_world": PATH[:5]}}), 30),
        "aist": (pickle.dumps({"smpl_loss": 0.1, "smpl_poses": flat, "smpl_scaling": np.array([90.0]), "smpl_trans": 90 * PATH}), 60),
        "gvhmr": (torch_file({"smpl_params_global": tensors, "smpl_params_incam": tensors, "K_fullimg": torch.eye(3)}), 30),
        "hy rotations": (npz(rot6d=six(POSES[:, :22]), transl=PATH, text="walks"), 30),
        "hy parameters": (npz(poses=hands(POSES, 52), trans=PATH, Rh=np.zeros((FRAMES, 3)), num_frames=FRAMES, mocap_framerate=30), 30),
        "hy joints": (npz(keypoints3d=np.repeat(JOINTS[:, :1], 52, 1) + np.concatenate([JOINTS[:, :22] - JOINTS[:, :1], np.zeros((FRAMES, 30, 3))], 1), rot6d=six(POSES[:, :22]), transl=PATH), 30),
        "motion-x": (npy(motion_x), 30),
        "mdm": (npy(mdm), 20),
        "humanml3d joints": (npy(JOINTS[:, :22].astype(np.float32)), 20),
        "humanml3d features": (npy(features()), 20),
    }  # fmt: skip


FILES = files()


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
