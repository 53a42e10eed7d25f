"""Read DeepMimic's clips: durations, root positions and quaternions of its ``humanoid3d``."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.io import parse_json, read_bytes
from a2v.kinematics.from_joints import motion_of_joints
from a2v.kinematics.resample import MAX_JOINT_FRAMES
from a2v.kinematics.skeleton import skeleton_of
from a2v.kinematics.so3 import quat_to_rotmat, rotvec_to_rotmat
from a2v.types import FloatArray, Motion

# DeepMimic's humanoid3d: name, parent, offset in meters (x forward, y up, z right), degrees of
# freedom in a frame: 4 a quaternion, 1 an angle about z, 0 fixed. Frames hold the duration, the
# root's position and then these, in order.
_HUMANOID3D: tuple[tuple[str, int, tuple[float, float, float], int], ...] = (
    ("root", -1, (0, 0, 0), 4),
    ("chest", 0, (0, 0.236151, 0), 4),
    ("neck", 1, (0, 0.223894, 0), 4),
    ("right_hip", 0, (0, 0, 0.084887), 4),
    ("right_knee", 3, (0, -0.421546, 0), 1),
    ("right_ankle", 4, (0, -0.40987, 0), 4),
    ("right_shoulder", 1, (-0.02405, 0.2435, 0.18311), 4),
    ("right_elbow", 6, (0, -0.274788, 0), 1),
    ("right_wrist", 7, (0, -0.258947, 0), 0),
    ("left_hip", 0, (0, 0, -0.084887), 4),
    ("left_knee", 9, (0, -0.421546, 0), 1),
    ("left_ankle", 10, (0, -0.40987, 0), 4),
    ("left_shoulder", 1, (-0.02405, 0.2435, -0.18311), 4),
    ("left_elbow", 12, (0, -0.274788, 0), 1),
    ("left_wrist", 13, (0, -0.258947, 0), 0),
    (
        "right_foot",
        5,
        (0.13, -0.05, 0),
        0,
    ),  # tips implied by its boxes and spheres; they give the directions of feet and head
    ("left_foot", 11, (0.13, -0.05, 0), 0),
    ("head", 2, (0, 0.175, 0), 0),
)
_FRAME = 1 + 3 + sum(dof for _, _, _, dof in _HUMANOID3D)
_FACING = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # x forward, z right -> z forward, x left
MAX_BYTES = 256 << 20


def read_deepmimic(path: str | os.PathLike[str], *, action: str = "") -> Motion:
    """Read a DeepMimic clip for its ``humanoid3d`` character (quaternions wxyz, x forward, y up).

    Frames of uneven duration are resampled to the median rate. The character has fixed wrists, and
    its feet and head are boxes: tips of plausible length represent them (``left_foot``,
    ``right_foot``, ``head``).

    Parameters
    ----------
    path : path
    action : str
        Stored in the motion; the file's stem by default.

    Returns
    -------
    Motion
        Meters, y up, facing +z; rotations have no twist about the bones.

    Raises
    ------
    InputError
        The file is no DeepMimic clip; the message names the file and the frame.
    """
    source = Path(path)
    frames = _read_frames(source)
    duration = float(np.median(frames[:-1, 0])) if len(frames) > 1 else 1 / 30
    if not 1e-4 <= duration <= 10:
        raise InputError(f"{source}: frames last {duration:g} s; expected 0.0001 to 10")
    joints = _even(_joint_positions(frames, source) @ _FACING.T, frames[:, 0], duration)
    parents = [joint[1] for joint in _HUMANOID3D]
    names = ("pelvis", *(joint[0] for joint in _HUMANOID3D[1:]))
    skeleton = skeleton_of("custom", parents, names)
    rate = 1 / duration
    return motion_of_joints(
        joints,
        skeleton,
        float(round(rate)) if abs(rate - round(rate)) < 0.05 else rate,
        action=action or source.stem,
        provenance={"source": str(source), "format": "DeepMimic humanoid3d"},
    )


def _read_frames(source: Path) -> FloatArray:
    """Read and check the file's numbers (T, `_FRAME`)."""
    content = parse_json(read_bytes(source, limit=MAX_BYTES), source, "DeepMimic's JSON")
    rows = content.get("Frames") if isinstance(content, dict) else None
    if not isinstance(rows, list) or not rows:
        raise InputError(f"{source}: no 'Frames' in it; expected a DeepMimic clip")
    for number, row in enumerate(rows):
        if (
            not isinstance(row, list)
            or len(row) != _FRAME
            or not all(isinstance(value, int | float) for value in row)
        ):
            got = len(row) if isinstance(row, list) else "no list of"
            raise InputError(
                f"{source}: frame {number} has {got} numbers; expected {_FRAME} (humanoid3d)"
            )
    try:
        frames = np.asarray(rows, dtype=np.float64)
    except OverflowError:
        raise InputError(
            f"{source}: a number has hundreds of digits; expected meters, seconds and quaternions"
        ) from None
    if len(frames) * len(_HUMANOID3D) > MAX_JOINT_FRAMES:
        raise InputError(
            f"{source}: {len(frames)} frames are more than are read "
            f"({MAX_JOINT_FRAMES // len(_HUMANOID3D)}); cut the clip"
        )
    if not np.isfinite(frames).all() or np.abs(frames).max() > 1e4:
        raise InputError(
            f"{source}: frame {int(np.argmax(~(np.abs(frames) <= 1e4).all(1)))} holds NaN, "
            "infinite or absurd numbers"
        )
    return frames


def _joint_positions(frames: FloatArray, source: Path) -> FloatArray:
    """Joints (T, J, 3) of frames (T, `_FRAME`), meters, in DeepMimic's axes."""
    count = len(frames)
    column = 4
    joints = np.zeros((count, len(_HUMANOID3D), 3))
    rotmats = np.zeros((count, len(_HUMANOID3D), 3, 3))
    for j, (name, parent, offset, dof) in enumerate(_HUMANOID3D):
        if dof == 4:
            quats = frames[:, column : column + 4]
            if (np.linalg.norm(quats, axis=1) < 1e-3).any():
                raise InputError(
                    f"{source}: the quaternion of '{name}' is zero in frame "
                    f"{int(np.argmin(np.linalg.norm(quats, axis=1)))}"
                )
            local = quat_to_rotmat(quats)
        elif dof == 1:
            local = rotvec_to_rotmat(frames[:, column, None] * np.array([0.0, 0, 1]))
        else:
            local = np.tile(np.eye(3), (count, 1, 1))
        column += dof
        if parent < 0:
            joints[:, j], rotmats[:, j] = frames[:, 1:4], local
        else:
            joints[:, j] = joints[:, parent] + rotmats[:, parent] @ np.asarray(offset)
            rotmats[:, j] = rotmats[:, parent] @ local
    return joints


def _even(joints: FloatArray, durations: FloatArray, step: float) -> FloatArray:
    """Resample positions (T, J, 3) whose frames last `durations` seconds to even steps."""
    if len(joints) < 2 or np.ptp(durations[:-1]) < 1e-3 * step:
        return joints
    times = np.concatenate([[0.0], np.cumsum(durations[:-1])])
    if (np.diff(times) <= 0).any():
        return joints
    if times[-1] / step * joints.shape[1] > MAX_JOINT_FRAMES:
        raise InputError(
            f"the clip lasts {times[-1]:.0f} s, {step:g} s per frame, which is too long to be "
            "read; cut it"
        )
    from scipy.interpolate import PchipInterpolator

    result: FloatArray = PchipInterpolator(times, joints, axis=0)(
        np.arange(0, times[-1] + 1e-9, step)
    )
    return result
