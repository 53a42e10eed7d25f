"""Forward and inverse kinematics in the papers' chain convention (Eq. 6), for numpy and torch."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.kinematics.skeleton import Skeleton
from a2v.kinematics.so3 import MATRIX_BASIS, Array, constant, hat, namespace, rotvec_to_rotmat
from a2v.types import FloatArray


def bone_vectors(joints: Array, skeleton: Skeleton) -> Array:
    """Vectors (..., J, 3) from each joint's parent to the joint; zero for the root."""
    vectors = joints - joints[..., np.maximum(skeleton.parents, 0).tolist(), :]
    return vectors  # type: ignore[no-any-return]


def bone_lengths(joints: Array, skeleton: Skeleton) -> Array:
    """Lengths (..., J) of the bones that end at each joint; zero for the root. Units of
    `joints`."""
    xp = namespace(joints)
    vectors = bone_vectors(joints, skeleton)
    lengths: Array = xp.sqrt((vectors * vectors).sum(-1))
    return lengths


def on_lengths(joints: FloatArray, skeleton: Skeleton, lengths: FloatArray) -> FloatArray:
    """Return joints (T, J, 3) with the same bone directions and the given `lengths` (J,); the root
    is unchanged."""
    vectors = bone_vectors(joints, skeleton)
    vectors = (
        vectors
        / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
        * lengths[:, None]
    )
    vectors[:, 0] = 0
    moved: FloatArray = np.einsum("jb,tbx->tjx", skeleton.path_matrix, vectors) + joints[:, :1]
    return moved


def best_scale(points: np.ndarray, targets: np.ndarray, weights: np.ndarray) -> float:
    """Return the factor s of the weighted least squares ``targets ~ s * points + t``.

    Points and targets are (N, D), weights (N,) not all 0.
    """
    first = points - np.average(points, axis=0, weights=weights)
    second = targets - np.average(targets, axis=0, weights=weights)
    return float(
        (weights[:, None] * first * second).sum()
        / max((weights[:, None] * first * first).sum(), 1e-9)
    )


def compose(first: Array, second: Array) -> Array:
    """Multiply rotation matrices (..., 3, 3) by three multiply-adds, which is several times faster
    than matmul on a CPU."""
    product: Array = sum(first[..., :, k, None] * second[..., k, None, :] for k in range(3))
    return product


def compose_rows(first: Array, second: Array) -> Array:
    """Multiply rotation matrices (..., 3, 3, N), poses last: few operations on long rows."""
    product: Array = (first[..., :, :, None, :] * second[..., None, :, :, :]).sum(-3)
    return product


def forward_kinematics(rotations: Array, root: Array, lengths: Array, skeleton: Skeleton) -> Array:
    """Joint positions from rotation vectors, root and bone lengths: the mapping Gamma of Eq. 6.

    Parameters
    ----------
    rotations : (..., J, 3) float
        Rotation vectors; entry j rotates the bone that ends at joint j relative to the previous
        bone of its chain; chains start from the identity (the published convention). Entry 0 is not
        used.
    root : (..., 3) float
        Position of joint 0.
    lengths : (..., J) float
        Bone lengths (broadcast against `rotations`); entry 0 is not used.
    skeleton : Skeleton

    Returns
    -------
    (..., J, 3) float
        Positions, in the units of `root` and `lengths`.
    """
    xp = namespace(rotations)
    local = rotvec_to_rotmat(rotations)
    rest = constant(skeleton.rest_directions, rotations)
    vectors: dict[int, Array] = {0: xp.zeros_like(rotations[..., 0, :])}
    oriented: Array | None = None
    position: dict[int, int] = {}
    for joints, previous in skeleton.levels:
        here = local[..., list(joints), :, :]
        if oriented is not None:
            here = compose(oriented[..., [position[p] for p in previous], :, :], here)
        oriented, position = here, {joint: i for i, joint in enumerate(joints)}
        ends = (here * rest[list(joints)][:, None, :]).sum(-1)
        for i, joint in enumerate(joints):
            vectors[joint] = ends[..., i, :]
    directions = xp.stack([vectors[joint] for joint in range(skeleton.n_joints)], -2)
    bones = directions * lengths[..., None]
    positions: Array = constant(skeleton.path_matrix, rotations) @ bones + root[..., None, :]
    return positions


def inverse_kinematics(joints: Array, skeleton: Skeleton) -> Array:
    """Return rotation vectors (..., J, 3) whose forward kinematics give `joints` (..., J, 3) with
    their bone lengths.

    Each bone takes the smallest rotation from the previous one (joint positions do not determine
    the twist about a bone). A bone of zero length gets no rotation.
    """
    bones = bone_vectors(joints, skeleton).reshape(-1, 3 * skeleton.n_joints).T
    rotvecs = bones_to_rotvecs(bones.reshape(skeleton.n_joints, 3, -1), skeleton)
    rotations: Array = rotvecs.reshape(3 * skeleton.n_joints, -1).T.reshape(joints.shape)
    return rotations


def bones_to_rotvecs(bones: Array, skeleton: Skeleton) -> Array:
    """Return the rotation vectors of `inverse_kinematics` from bones of any length.

    Poses come last, so that every operation runs along N contiguous numbers. The graph of a flow
    contains this function.

    Parameters
    ----------
    bones : (J, 3, N) float
        Vectors from each joint's parent to the joint; entry 0 is not used.
    skeleton : Skeleton

    Returns
    -------
    (J, 3, N) float
    """
    xp = namespace(bones)
    tiny = 1e-12
    length = xp.sqrt((bones * bones).sum(1))[:, None]
    still = length < tiny
    directions = bones / xp.where(still, xp.ones_like(length), length)
    rotvecs: dict[int, Array] = {0: xp.zeros_like(bones[0])}
    frames: Any = None
    position: dict[int, int] = {}
    for level, previous in skeleton.levels:
        joints = list(level)
        rest = skeleton.rest_directions[joints]
        target = directions[joints]
        before = None if frames is None else frames[[position[p] for p in previous]]
        if before is not None:
            target = (before * target[:, :, None]).sum(1)  # transpose(before) @ target
        target = xp.where(still[joints], constant(rest[..., None], bones), target)
        # for rest directions e and targets w: cos = e . w, sin * axis = e x w, and cos I + hat(sin
        # * axis), all linear in w
        parts = constant(_swing_parts(rest), bones) @ target
        cosine, cross, linear = parts[:, :1], parts[:, 1:4], parts[:, 4:]
        sine = xp.sqrt((cross * cross).sum(1))[:, None]
        beyond = cosine < 0
        # the tangent of half the angle, from the pair that does not cancel
        angle = 2 * xp.arctan(
            xp.where(beyond, 1 - cosine, sine)
            / xp.where(beyond, xp.clip(sine, tiny, None), 1 + cosine)
        )
        # a bone turned by 180 degrees has no unique axis: any one perpendicular to the rest
        # direction
        opposite = beyond & (sine < xp.finfo(bones.dtype).eps ** 0.5)
        axis = xp.where(
            opposite,
            constant(_any_normal(rest)[..., None], bones),
            cross / xp.clip(sine, tiny, None),
        )
        rotvec = axis * angle
        frame = (
            linear.reshape(len(joints), 3, 3, -1)
            + ((1 - cosine) * axis)[:, :, None] * axis[:, None]
        )
        if before is not None:
            frame = compose_rows(before, frame)
        frames, position = frame, {joint: i for i, joint in enumerate(level)}
        for i, joint in enumerate(level):
            rotvecs[joint] = rotvec[i]
    stacked: Array = xp.stack([rotvecs[joint] for joint in range(skeleton.n_joints)])
    return stacked


def _swing_parts(rest: FloatArray) -> FloatArray:
    """Return matrices (n, 13, 3) from w to e . w, e x w and (e . w) I + hat(e x w), for unit rest
    directions e (n, 3)."""
    both = np.concatenate([rest[:, None], hat(rest)], 1)
    parts: FloatArray = np.concatenate([both, MATRIX_BASIS @ both], 1)
    return parts


def _any_normal(directions: FloatArray) -> FloatArray:
    """Return unit vectors (n, 3), each perpendicular to one of the unit `directions` (n, 3)."""
    normals = np.cross(directions, np.eye(3)[np.argmin(np.abs(directions), -1)])
    unit: FloatArray = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    return unit
