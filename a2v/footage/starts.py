"""Initial values for the fit of a film (similar recorded poses, smoothed over time), and its
preconditioner."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.body.anny import AnnyModel
from a2v.body.pose_bank import COMPARED, load_pose_bank
from a2v.footage.track import Track
from a2v.geometry.polar import nearest_rotations
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import FloatArray

STIFF = 20.0
"""Weight of second differences relative to values in `smoother`."""


def starts(track: Track, points: FloatArray, model: AnnyModel) -> tuple[FloatArray, FloatArray]:
    """Find the most similar recorded pose for each frame: its orientation in the world (T, 3, 3)
    and its angles (T, D)."""
    bank = load_pose_bank(model)
    index = [LANDMARK_INDEX[name] for name in COMPARED]
    own = points[:, index].astype(np.float64)
    frames = _trunks(own)
    own = own - own[:, [COMPARED.index("left_hip"), COMPARED.index("right_hip")]].mean(
        axis=1, keepdims=True
    )
    local = np.einsum("tab,tca->tcb", frames, own)
    theirs = _trunks(bank.points.astype(np.float64))
    known = np.einsum("nab,nca->ncb", theirs, bank.points)
    weight = np.sqrt(track.weights[:, index] + 1e-3)[..., None]
    flat = known.reshape(len(known), -1)
    roots, angles = np.zeros((track.frames, 3, 3)), np.zeros((track.frames, bank.angles.shape[1]))
    for frame in range(track.frames):
        if not track.seen[frame]:
            continue
        square = np.broadcast_to(weight[frame] ** 2, local[frame].shape).ravel()
        gap = flat**2 @ square - 2 * flat @ (square * local[frame].ravel())
        nearest = int(gap.argmin())
        cosine, sine = np.cos(track.yaw[frame]), np.sin(track.yaw[frame])
        turned = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
        roots[frame] = turned @ frames[frame] @ theirs[nearest].T @ bank.roots[nearest]
        angles[frame] = bank.angles[nearest]
    last = int(np.flatnonzero(track.seen)[0])
    for frame in range(track.frames):  # an unseen person keeps the last pose
        if track.seen[frame]:
            last = frame
        roots[frame], angles[frame] = roots[last], angles[last]
    return roots, angles


def _trunks(points: FloatArray) -> FloatArray:
    """Return orientations (N, 3, 3) of trunks by hips and shoulders of points (N, C, 3),
    `COMPARED`: columns left, up, ahead."""
    at = {
        name: points[:, COMPARED.index(name)]
        for name in ("left_shoulder", "right_shoulder", "left_hip", "right_hip")
    }
    left = at["left_shoulder"] - at["right_shoulder"] + at["left_hip"] - at["right_hip"]
    up = at["left_shoulder"] + at["right_shoulder"] - at["left_hip"] - at["right_hip"]
    up = up / np.maximum(np.linalg.norm(up, axis=-1, keepdims=True), 1e-9)
    left = left - (left * up).sum(-1, keepdims=True) * up
    left = left / np.maximum(np.linalg.norm(left, axis=-1, keepdims=True), 1e-9)
    return np.stack([left, up, np.cross(left, up)], axis=-1)


def smoother(count: int) -> FloatArray:
    """Return the preconditioner (I + α D'D)^(-1/2) of shape (count, count) for second differences
    D.

    The smoothness term couples neighboring frames. L-BFGS needs hundreds of steps without this
    change of variables, and tens with it.
    """
    if count < 3:
        return np.eye(count)
    second = np.diff(np.eye(count), n=2, axis=0)
    values, vectors = np.linalg.eigh(np.eye(count) + STIFF * second.T @ second)
    found: FloatArray = (vectors / np.sqrt(values)) @ vectors.T
    return found


def smooth_turns(rotmats: FloatArray, frames: float) -> FloatArray:
    """Smooth rotations (T, 3, 3) with a Gaussian of a standard deviation of `frames`."""
    return nearest_rotations(gaussian_filter1d(rotmats, frames, axis=0, mode="nearest"))


def bridged(values: FloatArray, track: Track) -> FloatArray:
    """Interpolate values (T, n) over the frames in which the person is not seen."""
    at, seen = np.arange(track.frames), track.seen
    flat = values.reshape(len(values), -1)
    columns: list[FloatArray] = [
        np.interp(at, at[seen], flat[seen, column]) for column in range(flat.shape[1])
    ]
    filled: FloatArray = np.stack(columns, axis=1).reshape(values.shape)
    return filled
