"""Smooth the clips of actions for which the model's clips are jerkier than the recordings."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from a2v.kinematics.even_paths import evened
from a2v.types import FloatArray, IntArray, Motion

SMOOTHED: Mapping[str, float] = {
    "Dragon": 0.03,
    "Drunk walk": 0.05,
    "Elephant": 0.05,
    "Flamingo": 0.05,
    "Ghost": 0.03,
    "Range of motion": 0.03,
    "Salsa": 0.05,
    "Shy walk": 0.03,
    "Sidestep": 0.05,
    "Snake": 0.05,
    "Sneak": 0.05,
    "Wash windows": 0.03,
    "Whirl": 0.05,
}
"""Width in seconds (`a2v.kinematics.even_paths.evened`) for each action of `cmu-fine` whose
generated clips had more than 1.8 times the jerk of its recordings. At this width the jerk is .6 to
1.8 times that of the recordings (docs/results/motion_standing.md)."""
EASE_SECONDS = 0.4
"""Seconds over which the smoothing sets in and ends where the action changes."""


def smooth_actions(motion: Motion, actions: Sequence[str]) -> Motion:
    """Smooth the parts of a clip or batch whose action is in `SMOOTHED`; bones keep their lengths.

    Only joints and root change. The caller computes the rotations again (`a2v.motion.limbs.planted`
    does).

    Parameters
    ----------
    motion : Motion
    actions : sequence of str
        One for each step of the clip; `motion.action_starts` says when each begins.
    """
    widths = [SMOOTHED.get(action, 0.0) for action in actions]
    if not any(widths) or motion.frames < 4:
        return motion
    even = _even_bones(motion.joints, motion.parents, max(widths) * motion.fps)
    if all(widths):
        joints = even
    else:
        starts = np.zeros(1) if motion.action_starts is None else motion.action_starts
        step = np.searchsorted(starts, np.arange(motion.frames) / motion.fps + 1e-6, "right") - 1
        flags = (np.array(widths)[step] > 0).astype(float)
        weight = uniform_filter1d(flags, max(1, round(EASE_SECONDS * motion.fps)), mode="nearest")
        joints = _mixed_bones(motion.joints, even, motion.parents, weight)
    joints = joints.astype(np.float32)
    return dataclasses.replace(motion, joints=joints, root=joints[..., 0, :])


def _even_bones(joints: FloatArray, parents: IntArray, width: float) -> FloatArray:
    """Return joints (..., T, J, 3) with a smooth root and smooth bone directions; `width` is in
    frames."""
    bones, lengths = _bones(joints, parents)
    flat = evened(bones.reshape(*bones.shape[:-2], -1), width)
    return _joints(flat.reshape(bones.shape), lengths, parents)


def _mixed_bones(
    one: FloatArray, other: FloatArray, parents: IntArray, weight: FloatArray
) -> FloatArray:
    """Interpolate joints (..., T, J, 3) between two clips of the same bone lengths, at weight
    `weight` (T,) of the second."""
    first, lengths = _bones(one, parents)
    second, _ = _bones(other, parents)
    share = weight[:, None, None]
    return _joints((1 - share) * first + share * second, lengths, parents)


def _bones(joints: FloatArray, parents: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the vector of each joint from its parent (the root's from the origin) and its length
    (..., 1)."""
    places = np.asarray(joints, np.float64)
    vectors = places - places[..., np.maximum(parents, 0), :]
    vectors[..., 0, :] = places[..., 0, :]
    return vectors, np.linalg.norm(vectors, axis=-1, keepdims=True)


def _joints(vectors: FloatArray, lengths: FloatArray, parents: IntArray) -> FloatArray:
    """Return the joints at the ends of bones with the directions `vectors` and these `lengths`. The
    vector of the root is its position."""
    made = np.array(vectors)
    for joint, parent in enumerate(parents.tolist()):
        if parent >= 0:
            size = np.maximum(np.linalg.norm(vectors[..., joint, :], axis=-1, keepdims=True), 1e-9)
            along = vectors[..., joint, :] / size * lengths[..., joint, :]
            made[..., joint, :] = made[..., parent, :] + along
    return made
