"""Cross-fade from one clip to another by mixing directions of bones and steps of the root."""

from __future__ import annotations

import numpy as np

from a2v.geometry.steps import smoothstep
from a2v.kinematics import Skeleton, bone_vectors
from a2v.kinematics.ground import face_forward, heading
from a2v.types import FloatArray


def lowest(joints: FloatArray) -> FloatArray:
    """Return the height (N,) of the lowest joint of clips (N, T, J, 3)."""
    found: FloatArray = joints[..., 1].min(axis=(1, 2)).astype(np.float64)
    return found


def crossfade(
    before: FloatArray, ahead: FloatArray, after: FloatArray, skeleton: Skeleton, lift: FloatArray
) -> FloatArray:
    """Attach clips `after` (N, T, J, 3) float32 to the end of `before` (N, S, J, 3), with a
    cross-fade of their poses.

    `after` is moved and turned to continue `before`. Directions of bones and steps of the root are
    mixed during the frames `ahead` (N, F, J, 3), with which `before` would continue. Bones keep the
    lengths of `after`. Heights are those of `after` plus `lift` (N,), which brings the lowest
    joints of both to the same height.
    """
    fade, last = ahead.shape[1], before[:, -1].astype(np.float64)
    yaw = heading(last, skeleton) - heading(after[:, 0].astype(np.float64), skeleton)
    new = face_forward(after.astype(np.float64), np.stack([np.cos(yaw), -np.sin(yaw)], axis=-1))
    weight = (np.arange(1, fade + 1) / (fade + 1))[:, None]
    weight = smoothstep(weight, 0, 1)
    old_steps = np.diff(np.concatenate([last[:, None, 0], ahead[:, :, 0]], axis=1), axis=1)
    steps = np.diff(new[:, :, 0], axis=1, prepend=2 * new[:, :1, 0] - new[:, 1:2, 0])
    steps[:, :fade] = (1 - weight) * old_steps + weight * steps[:, :fade]
    root = last[:, None, 0] + np.cumsum(steps, axis=1)
    root[..., 1] = new[:, :, 0, 1] + lift[:, None]
    root[:, :fade, 1] = (1 - weight[:, 0]) * ahead[:, :, 0, 1] + weight[:, 0] * root[:, :fade, 1]
    vectors, old = bone_vectors(new, skeleton), bone_vectors(ahead.astype(np.float64), skeleton)
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    mixed = (1 - weight[..., None]) * old + weight[..., None] * vectors[:, :fade]
    vectors[:, :fade] = (
        mixed * lengths[:, :fade] / np.maximum(np.linalg.norm(mixed, axis=-1, keepdims=True), 1e-9)
    )
    joints = np.einsum("jb,ntbx->ntjx", skeleton.path_matrix, vectors) + root[:, :, None]
    return np.asarray(joints, np.float32)
