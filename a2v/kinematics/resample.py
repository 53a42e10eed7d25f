"""Another frame rate for a motion, without kinks and without drift."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import forward_kinematics, quat_to_rotvec, rotvec_to_quat, skeleton_of
from a2v.kinematics.orientations import rotvecs_of
from a2v.types import FloatArray, Motion

MAX_JOINT_FRAMES = 1_000_000
"""Joints times frames of the longest clip that is read or resampled; working on one takes some 700 bytes a joint and frame."""


def resample_motion(motion: Motion, fps: float) -> Motion:
    """Resample clip(s) to `fps`, keeping the duration from the first to the last frame.

    Rotations (as quaternions of continuous sign), root and bone lengths run through monotone cubics (PCHIP): smooth in
    velocity, no overshoot, so that a foot that stands still keeps still; frames that both rates share are unchanged, and
    bones keep their lengths.

    Parameters
    ----------
    motion : Motion
        One clip or a batch.
    fps : float
        Frames per second, 0.1 to 1000.

    Returns
    -------
    Motion
        Every (1 / `fps`) s from the first frame on.

    Raises
    ------
    InputError
        `fps` is out of range.
    """
    if not (np.isfinite(fps) and 0.1 <= fps <= 1000):
        raise InputError(f"fps is {fps}; expected 0.1 to 1000 frames per second")
    if fps == motion.fps:
        return motion
    frames = int(np.floor((motion.frames - 1) / motion.fps * fps + 1e-6)) + 1
    if frames * len(motion.parents) > MAX_JOINT_FRAMES:
        raise InputError(
            f"{motion.frames} frames at {motion.fps:g} a second become {frames} at {fps:g}, with {len(motion.parents)} joints more than "
            f"{MAX_JOINT_FRAMES:,} positions; cut the motion or ask for fewer frames per second"
        )
    if motion.frames == 1:
        return dataclasses.replace(motion, fps=float(fps))
    at = np.minimum(np.arange(frames) * (motion.fps / fps), motion.frames - 1)
    given = motion.given_frames and int(np.floor((motion.given_frames - 1) / motion.fps * fps + 1e-6)) + 1
    return dataclasses.replace(resample_at(motion, at), fps=float(fps), given_frames=given)


def resample_at(motion: Motion, at: FloatArray) -> Motion:
    """Poses of clip(s) at fractional frames `at` (T,) from 0 to the last, as `resample_motion` finds them; the frame rate is kept."""
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    rotvecs, lengths = rotvecs_of(motion, skeleton)
    quats = interpolate(continuous(rotvec_to_quat(rotvecs), axis=-3), at, axis=-3)
    rotvecs = quat_to_rotvec(quats / np.linalg.norm(quats, axis=-1, keepdims=True))
    root = interpolate(motion.joints[..., 0, :].astype(np.float64), at, axis=-2)
    joints = forward_kinematics(rotvecs, root, interpolate(lengths, at, axis=-2), skeleton)
    return dataclasses.replace(
        motion, joints=joints.astype(np.float32), rotations=rotvecs.astype(np.float32), root=root.astype(np.float32)
    )


def interpolate(values: FloatArray, at: FloatArray, axis: int) -> FloatArray:
    """Values at fractional frames `at` along `axis`: monotone cubic, linear for two frames."""
    from scipy.interpolate import PchipInterpolator

    count = values.shape[axis]
    if count == 1:
        return np.repeat(values, len(at), axis=axis)
    result: FloatArray = PchipInterpolator(np.arange(count), values, axis=axis)(at)
    return result


def continuous(quats: FloatArray, axis: int = 0) -> FloatArray:
    """Flip signs of quaternions (..., 4) so that neighbours along `axis` (time) are on the same side."""
    moved = np.moveaxis(quats, axis, 0)
    dots = (moved[1:] * moved[:-1]).sum(-1, keepdims=True)
    signs = np.concatenate([np.ones_like(dots[:1]), np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)])
    return np.moveaxis(moved * signs, 0, axis)
