"""Maps between representations of rotations, for numpy arrays and torch tensors.

Rotation vectors are ``(..., 3)`` (axis times angle, radians), matrices ``(..., 3, 3)`` acting on
column vectors, quaternions ``(..., 4)`` in the order w, x, y, z. Any leading batch shape, any
floating dtype; the maps are differentiable everywhere, including the identity (torch).
"""

from __future__ import annotations

import sys
from typing import Any, TypeVar

import numpy as np

from a2v.types import FloatArray

Array = TypeVar("Array", bound=Any)
"""A numpy array or a torch tensor."""


def namespace(array: Any) -> Any:
    """Return the module (numpy or torch) that `array` belongs to."""
    torch = sys.modules.get("torch")
    return torch if torch is not None and isinstance(array, torch.Tensor) else np


def _norm_squared(vector: Array) -> Array:
    result: Array = (vector * vector).sum(-1)
    return result


def hat(rotvec: Array) -> Array:
    """Skew-symmetric matrices (..., 3, 3) of vectors (..., 3): ``hat(w) @ v == cross(w, v)`` (Eq.
    3)."""
    xp = namespace(rotvec)
    x, y, z = rotvec[..., 0], rotvec[..., 1], rotvec[..., 2]
    zero = xp.zeros_like(x)
    rows = [zero, -z, y, z, zero, -x, -y, x, zero]
    matrix: Array = xp.stack(rows, -1).reshape((*rotvec.shape[:-1], 3, 3))
    return matrix


MATRIX_BASIS = np.concatenate([np.eye(3)[None], hat(np.eye(3))]).reshape(4, 9).T.copy()
"""Matrix (9, 4) from (a, v) to the flattened a I + hat(v)."""


def constant(array: FloatArray, like: Array) -> Array:
    """Convert `array` to the library, dtype and device of `like`."""
    xp = namespace(like)
    made = xp.asarray(array, dtype=like.dtype)
    placed: Array = made if xp is np else made.to(like.device)
    return placed


def rotvec_to_rotmat(rotvec: Array) -> Array:
    """Exponential map so(3) -> SO(3) (Rodrigues; Eq. 4 with the square in its last denominator).

    Parameters
    ----------
    rotvec : (..., 3) float
        Rotation vectors, radians.

    Returns
    -------
    (..., 3, 3) float
        Rotation matrices.
    """
    xp = namespace(rotvec)
    square = _norm_squared(rotvec)
    small = square < 1e-3  # three terms of the series are exact to float64 for small angles
    safe = xp.where(small, xp.ones_like(square), square)
    angle = xp.sqrt(safe)
    half = xp.sin(angle / 2)
    sinc = xp.where(
        small, 1 - square / 6 * (1 - square / 20 * (1 - square / 42)), xp.sin(angle) / angle
    )
    cosc = xp.where(
        small, 0.5 - square / 24 * (1 - square / 30 * (1 - square / 56)), 2 * half * half / safe
    )
    x, y, z = rotvec[..., 0], rotvec[..., 1], rotvec[..., 2]
    cx, cy, cz = cosc * x, cosc * y, cosc * z
    sx, sy, sz = sinc * x, sinc * y, sinc * z
    # I + sinc W + cosc W^2 written out: one pass instead of two 3x3 products
    rows = [
        1 - cy * y - cz * z,
        cx * y - sz,
        cx * z + sy,
        cx * y + sz,
        1 - cx * x - cz * z,
        cy * z - sx,
        cx * z - sy,
        cy * z + sx,
        1 - cx * x - cy * y,
    ]
    matrix: Array = xp.stack(rows, -1).reshape((*rotvec.shape[:-1], 3, 3))
    return matrix


def rotmat_to_quat(rotmat: Array) -> Array:
    """Unit quaternions (..., 4), wxyz with w >= 0, of rotation matrices (..., 3, 3); stable for
    every angle."""
    xp = namespace(rotmat)
    m = [[rotmat[..., i, j] for j in range(3)] for i in range(3)]
    trace = m[0][0] + m[1][1] + m[2][2]
    one = xp.ones_like(trace)
    # 4 q q^T has these columns; the one with the largest diagonal is the best conditioned
    columns = [
        xp.stack([one + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]], -1),
        xp.stack(
            [
                m[2][1] - m[1][2],
                one + m[0][0] - m[1][1] - m[2][2],
                m[1][0] + m[0][1],
                m[0][2] + m[2][0],
            ],
            -1,
        ),
        xp.stack(
            [
                m[0][2] - m[2][0],
                m[1][0] + m[0][1],
                one - m[0][0] + m[1][1] - m[2][2],
                m[2][1] + m[1][2],
            ],
            -1,
        ),
        xp.stack(
            [
                m[1][0] - m[0][1],
                m[0][2] + m[2][0],
                m[2][1] + m[1][2],
                one - m[0][0] - m[1][1] + m[2][2],
            ],
            -1,
        ),
    ]
    best = xp.argmax(xp.stack([columns[k][..., k] for k in range(4)], -1), -1)
    quat = columns[0]
    for k in range(1, 4):
        quat = xp.where((best == k)[..., None], columns[k], quat)
    quat = quat / xp.sqrt(_norm_squared(quat))[..., None]
    canonical: Array = xp.where(quat[..., :1] < 0, -quat, quat)
    return canonical


def quat_to_rotmat(quat: Array) -> Array:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), wxyz; the quaternions are normalized
    first."""
    xp = namespace(quat)
    quat = quat / xp.sqrt(_norm_squared(quat))[..., None]
    w, x, y, z = quat[..., 0], quat[..., 1], quat[..., 2], quat[..., 3]
    rows = [
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    ]
    matrix: Array = xp.stack(rows, -1).reshape((*quat.shape[:-1], 3, 3))
    return matrix


def quat_to_rotvec(quat: Array) -> Array:
    """Rotation vectors (..., 3) with angles in [0, pi] of unit quaternions (..., 4), wxyz."""
    xp = namespace(quat)
    quat = xp.where(quat[..., :1] < 0, -quat, quat)
    w, vector = quat[..., 0], quat[..., 1:]
    square = _norm_squared(vector)
    small = square < 1e-8
    sine = xp.sqrt(xp.where(small, xp.ones_like(square), square))
    atan2 = getattr(xp, "arctan2", None) or xp.atan2
    # angle / sin(angle / 2); near the identity its series in sin(angle / 2)
    factor = xp.where(small, 2 + square / 3, 2 * atan2(sine, w) / sine)
    rotvec: Array = factor[..., None] * vector
    return rotvec


def rotvec_to_quat(rotvec: Array) -> Array:
    """Unit quaternions (..., 4), wxyz, of rotation vectors (..., 3)."""
    xp = namespace(rotvec)
    square = _norm_squared(rotvec)
    small = square < 1e-3
    angle = xp.sqrt(xp.where(small, xp.ones_like(square), square))
    half_sinc = xp.where(
        small, 0.5 - square / 48 * (1 - square / 80 * (1 - square / 168)), xp.sin(angle / 2) / angle
    )
    cosine = xp.where(
        small, 1 - square / 8 * (1 - square / 48 * (1 - square / 120)), xp.cos(angle / 2)
    )
    quat: Array = xp.concatenate([cosine[..., None], half_sinc[..., None] * rotvec], -1)
    return quat


def rotmat_to_rotvec(rotmat: Array) -> Array:
    """Logarithm SO(3) -> so(3): rotation vectors (..., 3) with angles in [0, pi] of matrices (...,
    3, 3)."""
    return quat_to_rotvec(rotmat_to_quat(rotmat))


def quat_multiply(a: Array, b: Array) -> Array:
    """Hamilton product of quaternions (..., 4), wxyz: first `b`, then `a`."""
    xp = namespace(a)
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    product: Array = xp.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        -1,
    )
    return product


def slerp(a: Array, b: Array, t: Array | float) -> Array:
    """Spherical interpolation between unit quaternions (..., 4), wxyz, the short way; ``t = 0``
    gives `a`."""
    xp = namespace(a)
    relative = quat_multiply(b, a * xp.asarray([1, -1, -1, -1], dtype=a.dtype))
    step = rotvec_to_quat(
        quat_to_rotvec(relative) * (t if isinstance(t, float | int) else xp.asarray(t)[..., None])
    )
    turned: Array = quat_multiply(step, a)
    return turned


def swing_between(source: Array, target: Array) -> Array:
    """Smallest rotation vectors (..., 3) that turn directions `source` into `target` (..., 3 each).

    Directions need not have unit length; a zero direction gives the zero rotation. For opposite
    directions the axis is chosen perpendicular to `source` (any such turn is equally small).
    """
    xp = namespace(source)
    tiny = 1e-12

    def unit(vector: Array) -> Array:
        length = xp.sqrt(_norm_squared(vector))[..., None]
        result: Array = vector / xp.where(length < tiny, xp.ones_like(length), length)
        return result

    a, b = unit(source), unit(target)
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    # The swing is two half-way turns. Its quaternion is (a . h, a x h) with the unit bisector h. It
    # is precise except for opposite directions, which have no bisector.
    bisector = a + b
    opposite = (_norm_squared(bisector) < xp.finfo(a.dtype).eps)[..., None]
    h = unit(bisector)
    hx, hy, hz = h[..., 0], h[..., 1], h[..., 2]
    cross = xp.stack([ay * hz - az * hy, az * hx - ax * hz, ax * hy - ay * hx], -1)
    quat = xp.concatenate([(a * h).sum(-1)[..., None], cross], -1)
    length = xp.sqrt(_norm_squared(quat))[..., None]
    quat = quat / xp.where(opposite | (length == 0), xp.ones_like(length), length)
    zero = xp.zeros_like(ax)
    side = xp.where(
        (abs(ax) < 0.9)[..., None], xp.stack([zero, -az, ay], -1), xp.stack([az, zero, -ax], -1)
    )
    quat = xp.where(opposite, xp.concatenate([zero[..., None], unit(side)], -1), quat)
    moved = ((_norm_squared(source) > tiny**2) & (_norm_squared(target) > tiny**2))[..., None]
    rotvec: Array = xp.where(moved, quat_to_rotvec(quat), xp.zeros_like(a))
    return rotvec
