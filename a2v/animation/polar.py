"""Rotations nearest to matrices, many at once."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray


def nearest_rotations(matrices: FloatArray) -> FloatArray:
    """Rotations (N, 3, 3) nearest to matrices (N, 3, 3), by singular value decomposition."""
    u, _, vt = np.linalg.svd(matrices)
    sign = np.linalg.det(u @ vt)
    u[:, :, 2] *= np.sign(sign)[:, None]
    rotations: FloatArray = u @ vt
    return rotations


def rotations_of(matrices: FloatArray, start: FloatArray, *, steps: int = 4) -> FloatArray:
    """Rotations (N, 3, 3) maximising trace(R^T A) for A (N, 3, 3), from a first guess near the solution.

    Each step turns R about omega = sum_k R_k x A_k / |sum_k R_k . A_k| (Mueller, Bender, Chentanez, Macklin 2016); a step that
    does not improve (far guesses, flat neighbourhoods seen from behind) falls back to the decomposition for that vertex.
    """
    a = np.ascontiguousarray(np.moveaxis(matrices, 0, -1))  # (3, 3, N): long contiguous rows
    r = np.ascontiguousarray(np.moveaxis(start, 0, -1))
    for _ in range(steps):
        w = np.stack(
            [sum(r[(c + 1) % 3, k] * a[(c + 2) % 3, k] - r[(c + 2) % 3, k] * a[(c + 1) % 3, k] for k in range(3)) for c in range(3)]
        )
        fit = np.abs((r * a).sum((0, 1))) + 1e-20
        w /= fit
        angle = np.sqrt((w * w).sum(0))
        far = angle > 2.0
        if far.any():
            w[:, far] *= 2.0 / angle[far]
            angle = np.minimum(angle, 2.0)
        half = 0.5 * angle
        sinc = np.where(angle > 1e-8, np.sin(half) / np.maximum(angle, 1e-8), 0.5)
        q0, (q1, q2, q3) = np.cos(half), w * sinc
        step = (
            (1 - 2 * (q2 * q2 + q3 * q3), 2 * (q1 * q2 - q0 * q3), 2 * (q1 * q3 + q0 * q2)),
            (2 * (q1 * q2 + q0 * q3), 1 - 2 * (q1 * q1 + q3 * q3), 2 * (q2 * q3 - q0 * q1)),
            (2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), 1 - 2 * (q1 * q1 + q2 * q2)),
        )
        r = np.stack([step[c][0] * r[0] + step[c][1] * r[1] + step[c][2] * r[2] for c in range(3)])
        if float(angle.max(initial=0.0)) < 1e-7:
            break
    result = np.ascontiguousarray(np.moveaxis(r, -1, 0))
    lost = np.flatnonzero(((r * a).sum((0, 1)) <= 0) | (angle > 0.4))
    if len(lost):
        result[lost] = nearest_rotations(matrices[lost])
    return result
