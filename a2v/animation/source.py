"""Prepare the joints of a motion for retargeting: canonical, smooth, upright, facing +z."""

from __future__ import annotations

import numpy as np

from a2v.animation.rig import SIDES
from a2v.errors import InputError
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat, swing_between
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.types import FloatArray, Motion


def source_joints(motion: Motion) -> dict[str, FloatArray]:
    """Canonical joints (T, 3) float64 of a clip, in its own units.

    Raises
    ------
    InputError
        A batch, or a skeleton without a person's joints.
    """
    if motion.batch:
        raise InputError(
            f"retarget takes one clip; this Motion is a batch of shape {motion.batch}: index it "
            "first"
        )
    found = canonical_joints(motion.joint_names, motion.parents.tolist())
    if missing := missing_joints(found):
        raise InputError(
            f"the motion's skeleton '{motion.skeleton}' has no {', '.join(missing[:4])} among "
            f"{', '.join(motion.joint_names[:8])}...; "
            "rename its joints to Mixamo's, CMU's or SMPL's names"
        )
    return {name: motion.joints[:, index].astype(np.float64) for name, index in found.items()}


LEANING = frozenset({"humanact12", "ntu_vibe"})
"""Skeletons of data sets that were reconstructed from tilted cameras."""


def upright_rotmat(source: dict[str, FloatArray], fps: float) -> FloatArray:
    """Rotation (3, 3) that balances a standing person, for motions whose vertical leans with the
    camera.

    The center of mass of a person who stands still is above the feet. The rotation turns the mean
    direction from the feet to the center of mass to +y, over upright frames in which the hips
    hardly move. It is at most 20 degrees, and the identity without such frames.

    Parameters
    ----------
    source : dict of canonical joint to (T, 3)
        Meters, y roughly up.
    fps : float
    """
    hips, shoulders = middle(source, "hip"), middle(source, "shoulder")
    ankles = middle(source, "ankle")
    feet = (
        0.4 * ankles + 0.6 * middle(source, "foot")
        if "left_foot" in source and "right_foot" in source
        else ankles
    )
    lean = 0.6 * hips + 0.4 * shoulders - feet
    speed = (
        np.linalg.norm(np.gradient(hips, axis=0), axis=-1) * fps
        if len(hips) > 1
        else np.zeros(len(hips))
    )
    legs = np.mean(
        [
            np.linalg.norm(source[f"{side}_hip"] - source[f"{side}_ankle"], axis=-1)
            for side in SIDES
        ],
        axis=0,
    )
    upright = (legs > 0.85 * source_leg_length(source)) & (
        unit(lean)[:, 1] > np.cos(np.deg2rad(35))
    )
    still = np.exp(-((speed / 0.4) ** 2)) * upright
    if still.sum() < 0.25 * fps and still.sum() < 0.3 * len(hips):
        return np.eye(3)
    mean = (still[:, None] * unit(lean)).sum(0)
    swing = swing_between(mean, np.array([0.0, 1.0, 0.0]))
    angle = float(np.linalg.norm(swing))
    return rotvec_to_rotmat(swing * min(1.0, np.deg2rad(20) / max(angle, 1e-9)))


def heading_rotmat(source: dict[str, FloatArray]) -> FloatArray:
    """Rotation (3, 3) about y that makes the first frame face +z, by hips and shoulders; `source`:
    canonical joints (T, 3)."""
    across = (
        source["left_hip"][0]
        - source["right_hip"][0]
        + 0.5 * (source["left_shoulder"][0] - source["right_shoulder"][0])
    )
    yaw = 0.0 if np.hypot(across[0], across[2]) < 1e-9 else float(np.arctan2(across[2], across[0]))
    return rotvec_to_rotmat(np.array([0.0, yaw, 0.0]))


def source_leg_length(source: dict[str, FloatArray]) -> float:
    """Median length of thigh plus shin in a clip, in the clip's units.

    Parameters
    ----------
    source : dict of canonical joint to (T, 3)

    Raises
    ------
    InputError
        The legs have no length.
    """
    total = 0.0
    for side in SIDES:
        for a, b in (("hip", "knee"), ("knee", "ankle")):
            total += (
                float(
                    np.median(
                        np.linalg.norm(source[f"{side}_{b}"] - source[f"{side}_{a}"], axis=-1)
                    )
                )
                / 2
            )
    if total <= 1e-9:
        raise InputError("the motion's legs have no length; check its joints")
    return total


def aligned(source: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Canonical joints (T, 3), turned about y and moved so that frame 0 faces +z above the
    origin."""
    rotmat = heading_rotmat(source)
    start = 0.5 * (source["left_hip"][0] + source["right_hip"][0]) * np.array([1.0, 0, 1])
    return {name: (points - start) @ rotmat.T for name, points in source.items()}


def middle(source: dict[str, FloatArray], joint: str) -> FloatArray:
    """Point (T, 3) half-way between the left and the right `joint`, such as "hip"."""
    return 0.5 * (source[f"left_{joint}"] + source[f"right_{joint}"])
