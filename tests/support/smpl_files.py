"""Motions in the layouts of tools around SMPL: somebody who walks, as bytes of each kind of file."""

from __future__ import annotations

import io
import pickle
from typing import Any

import numpy as np

from a2v.formats.smpl import OFFSETS, PARENTS, PELVIS
from a2v.kinematics import rotvec_to_rotmat

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
