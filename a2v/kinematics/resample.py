"""Resample motions to another frame rate, without kinks and without drift."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import forward_kinematics, quat_to_rotvec, rotvec_to_quat, skeleton_of
from a2v.kinematics.orientations import rotvecs_of
from a2v.types import FloatArray, Motion

SHOWN_FPS = 30.0
"""Default frame rate of videos and exports, frames per second."""

MAX_JOINT_FRAMES = 1_000_000
"""Largest product of joints and frames of a clip that is read or resampled; one takes about 700
bytes per joint and frame in memory."""


def resample_motion(motion: Motion, fps: float) -> Motion:
    """Resample clip(s) to `fps`, keeping the duration from the first to the last frame.

    Rotations (as quaternions of continuous sign), root and bone lengths are interpolated by cubic
    splines. Frames that both rates share are unchanged, and bones keep their lengths. Compared with
    monotone cubics, splines are nearer to the recording, and feet slide and sink less
    (docs/animation.md).

    Parameters
    ----------
    motion : Motion
        One clip or a batch.
    fps : float
        Frames per second, 0.1 to 1000.

    Returns
    -------
    Motion
        A frame every (1 / `fps`) s from the first frame on.

    Raises
    ------
    InputError
        `fps` is out of range.
    """
    if not (np.isfinite(fps) and 0.1 <= fps <= 1000):
        raise InputError(f"fps is {fps}; expected 0.1 to 1000 frames per second")
    if fps == motion.fps:
        return motion
    frames = frames_made(motion.frames, motion.fps, fps)
    if frames * len(motion.parents) > MAX_JOINT_FRAMES:
        raise InputError(
            f"{motion.frames} frames at {motion.fps:g} fps become {frames} at {fps:g} fps: with "
            f"{len(motion.parents)} joints, more than "
            f"{MAX_JOINT_FRAMES:,} positions; cut the motion or request a lower frame rate"
        )
    if motion.frames == 1:
        return dataclasses.replace(motion, fps=float(fps))
    at = np.minimum(np.arange(frames) * (motion.fps / fps), motion.frames - 1)
    given = motion.given_frames and frames_made(motion.given_frames, motion.fps, fps)
    return dataclasses.replace(resample_at(motion, at), fps=float(fps), given_frames=given)


def frames_made(frames: int, fps: float, rate: float) -> int:
    """Return the number of frames at `rate` that resampling makes of `frames` at `fps`."""
    return int(np.floor((frames - 1) / fps * rate + 1e-6)) + 1


def frames_needed(frames: int, fps: float, rate: float) -> int:
    """Return the smallest number of frames at `fps` from which resampling makes at least `frames`
    at `rate`."""
    return int(np.ceil((frames - 1) / rate * fps - 1e-6)) + 1


def resample_at(motion: Motion, at: FloatArray) -> Motion:
    """Sample poses of clip(s) at fractional frames `at` (T,) from 0 to the last, as in
    `resample_motion`; the frame rate is kept."""
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    rotvecs, lengths = rotvecs_of(motion, skeleton)
    quats = interpolate(continuous(rotvec_to_quat(rotvecs), axis=-3), at, axis=-3)
    rotvecs = quat_to_rotvec(quats / np.linalg.norm(quats, axis=-1, keepdims=True))
    root = interpolate(motion.joints[..., 0, :].astype(np.float64), at, axis=-2)
    joints = forward_kinematics(rotvecs, root, interpolate(lengths, at, axis=-2), skeleton)
    rotations, shown = rotvecs.astype(np.float32), _shown_at(motion, at)
    return dataclasses.replace(
        motion,
        joints=joints.astype(np.float32),
        rotations=rotations,
        root=root.astype(np.float32),
        expressions=shown,
    )


def _shown_at(motion: Motion, at: FloatArray) -> dict[str, FloatArray] | None:
    """Interpolate expressions linearly at fractional frames `at` (T,): they stay within [0, 1]."""
    if motion.expressions is None:
        return None
    return {
        name: np.interp(at, np.arange(len(own)), own).astype(np.float32)
        for name, own in motion.expressions.items()
    }


def interpolate(values: FloatArray, at: FloatArray, axis: int) -> FloatArray:
    """Interpolate values at fractional frames `at` along `axis` by a cubic spline, linearly for two
    frames."""
    from scipy.interpolate import CubicSpline

    count = values.shape[axis]
    if count == 1:
        return np.repeat(values, len(at), axis=axis)
    result: FloatArray = CubicSpline(np.arange(count), values, axis=axis)(at)
    return result


def continuous(quats: FloatArray, axis: int = 0) -> FloatArray:
    """Flip signs of quaternions (..., 4) so that neighbors along `axis` (time) are on the same
    side."""
    moved = np.moveaxis(quats, axis, 0)
    dots = (moved[1:] * moved[:-1]).sum(-1, keepdims=True)
    signs = np.concatenate(
        [np.ones_like(moved[:1, ..., :1]), np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)]
    )
    return np.moveaxis(moved * signs, 0, axis)
