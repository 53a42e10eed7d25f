"""Features of a window of motion: the root's path and the directions of the bones."""

from __future__ import annotations

from a2v.kinematics import Skeleton, bone_vectors
from a2v.kinematics.so3 import Array, namespace

ROOT_WEIGHT = 3.0
"""Weight of the root's path relative to the unit bone directions in the basis."""


def window_features(joints: Array, skeleton: Skeleton) -> Array:
    """Return features (..., T, 3 J) of native joints (..., T, J, 3) float32, for numpy and torch.

    The first root must be the origin. The first 3 features are the weighted root, the others the
    unit directions of the bones, independent of bone lengths. A bone of zero length has the
    direction zero.
    """
    xp = namespace(joints)
    vectors = bone_vectors(joints, skeleton)[..., 1:, :]
    length = xp.sqrt((vectors * vectors).sum(-1))[..., None]
    directions = vectors / xp.where(length < 1e-8, xp.ones_like(length), length)
    flat = directions.reshape(*directions.shape[:-2], -1)
    features: Array = xp.concatenate([joints[..., 0, :] * ROOT_WEIGHT, flat], -1)
    return features
