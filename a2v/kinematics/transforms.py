"""Forward and inverse kinematics in the papers' chain convention (Eq. 6), for numpy and torch."""

from __future__ import annotations

import numpy as np

from a2v.kinematics.skeleton import Skeleton
from a2v.kinematics.so3 import Array, namespace, rotvec_to_rotmat, swing_between


def bone_vectors(joints: Array, skeleton: Skeleton) -> Array:
    """Vectors (..., J, 3) from each joint's parent to the joint; zero for the root."""
    vectors = joints - joints[..., np.maximum(skeleton.parents, 0).tolist(), :]
    return vectors  # type: ignore[no-any-return]


def bone_lengths(joints: Array, skeleton: Skeleton) -> Array:
    """Lengths (..., J) of the bones that end at each joint; zero for the root. Units of `joints`."""
    xp = namespace(joints)
    vectors = bone_vectors(joints, skeleton)
    lengths: Array = xp.sqrt((vectors * vectors).sum(-1))
    return lengths


def best_scale(points: np.ndarray, targets: np.ndarray, weights: np.ndarray) -> float:
    """The factor s of the weighted least squares ``targets ~ s * points + t``: points and targets (N, D), weights (N,) not all 0."""
    first = points - np.average(points, axis=0, weights=weights)
    second = targets - np.average(targets, axis=0, weights=weights)
    return float((weights[:, None] * first * second).sum() / max((weights[:, None] * first * first).sum(), 1e-9))


def compose(first: Array, second: Array) -> Array:
    """Product of rotation matrices (..., 3, 3) as three multiply-adds: on a CPU several times faster than matmul."""
    product: Array = sum(first[..., :, k, None] * second[..., k, None, :] for k in range(3))
    return product


def forward_kinematics(rotations: Array, root: Array, lengths: Array, skeleton: Skeleton) -> Array:
    """Joint positions from rotation vectors, root and bone lengths: the mapping Gamma of Eq. 6.

    Parameters
    ----------
    rotations : (..., J, 3) float
        Rotation vectors; entry j turns the bone that ends at joint j relative to the previous bone of its chain;
        chains start from the identity (the published convention). Entry 0 is not used.
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
    rest = xp.asarray(skeleton.rest_directions, dtype=rotations.dtype)
    if xp is not np:
        rest = rest.to(rotations.device)
    vectors: dict[int, Array] = {0: xp.zeros_like(rotations[..., 0, :])}
    turned: Array | None = None
    position: dict[int, int] = {}
    for joints, previous in skeleton.levels:
        here = local[..., list(joints), :, :]
        if turned is not None:
            here = compose(turned[..., [position[p] for p in previous], :, :], here)
        turned, position = here, {joint: i for i, joint in enumerate(joints)}
        ends = (here * rest[list(joints)][:, None, :]).sum(-1)
        for i, joint in enumerate(joints):
            vectors[joint] = ends[..., i, :]
    directions = xp.stack([vectors[joint] for joint in range(skeleton.n_joints)], -2)
    bones = directions * lengths[..., None]
    path = xp.asarray(skeleton.path_matrix, dtype=rotations.dtype)
    if xp is not np:
        path = path.to(rotations.device)
    positions: Array = path @ bones + root[..., None, :]
    return positions


def inverse_kinematics(joints: Array, skeleton: Skeleton) -> Array:
    """Rotation vectors (..., J, 3) whose forward kinematics give `joints` (..., J, 3) with their bone lengths.

    Each bone takes the smallest turn from the previous one (joint positions leave the twist about a bone open).
    A bone of zero length gets no turn.
    """
    xp = namespace(joints)
    vectors = bone_vectors(joints, skeleton)
    rest = xp.asarray(skeleton.rest_directions, dtype=joints.dtype)
    if xp is not np:
        rest = rest.to(joints.device)
    rotations: dict[int, Array] = {0: xp.zeros_like(joints[..., 0, :])}
    turned: Array | None = None
    position: dict[int, int] = {}
    for level, previous in skeleton.levels:
        target = vectors[..., list(level), :]
        before = None if turned is None else turned[..., [position[p] for p in previous], :, :]
        if before is not None:
            target = (before * target[..., :, None]).sum(-2)  # transpose(before) @ target
        rotvec = swing_between(xp.zeros_like(target) + rest[list(level)], target)
        local = rotvec_to_rotmat(rotvec)
        turned = local if before is None else compose(before, local)
        position = {joint: i for i, joint in enumerate(level)}
        for i, joint in enumerate(level):
            rotations[joint] = rotvec[..., i, :]
    stacked: Array = xp.stack([rotations[joint] for joint in range(skeleton.n_joints)], -2)
    return stacked
