"""Nearest rotations to many matrices at the same time."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.geometry.compiled import compiled
from a2v.types import FloatArray


def nearest_rotations(matrices: FloatArray) -> FloatArray:
    """Return the rotations (..., 3, 3) nearest to matrices (..., 3, 3), by singular value
    decomposition."""
    u, _, vt = np.linalg.svd(matrices)
    sign = np.linalg.det(u @ vt)
    u[..., 2] *= np.sign(sign)[..., None]
    rotations: FloatArray = u @ vt
    return rotations


def rotations_of(matrices: FloatArray, start: FloatArray, *, steps: int = 4) -> FloatArray:
    """Return the rotations (N, 3, 3) float64 that maximize trace(R^T A) for A (N, 3, 3), from a
    nearby first guess.

    Each step turns R about omega = sum_k R_k x A_k / |sum_k R_k . A_k| (Mueller, Bender, Chentanez,
    Macklin 2016). Where the steps do not converge (far guesses, flat neighborhoods seen from
    behind), the singular value decomposition is used.
    """
    targets = np.ascontiguousarray(matrices, np.float64)
    result = np.array(start, np.float64, order="C")
    lost = np.flatnonzero(compiled(_newton)(targets, result, steps))
    if len(lost):
        result[lost] = nearest_rotations(targets[lost])
    return result


def _newton(a: Any, r: Any, steps: int) -> Any:
    """Turn `r` in place toward `a`; returns flags (N,) of those that did not converge. Plain loops
    for numba."""
    lost = np.zeros(len(a), np.bool_)
    for n in range(len(a)):
        r00, r01, r02 = r[n, 0, 0], r[n, 0, 1], r[n, 0, 2]
        r10, r11, r12 = r[n, 1, 0], r[n, 1, 1], r[n, 1, 2]
        r20, r21, r22 = r[n, 2, 0], r[n, 2, 1], r[n, 2, 2]
        a00, a01, a02 = a[n, 0, 0], a[n, 0, 1], a[n, 0, 2]
        a10, a11, a12 = a[n, 1, 0], a[n, 1, 1], a[n, 1, 2]
        a20, a21, a22 = a[n, 2, 0], a[n, 2, 1], a[n, 2, 2]
        square = 0.0
        for _ in range(steps):
            x = r10 * a20 + r11 * a21 + r12 * a22 - r20 * a10 - r21 * a11 - r22 * a12
            y = r20 * a00 + r21 * a01 + r22 * a02 - r00 * a20 - r01 * a21 - r02 * a22
            z = r00 * a10 + r01 * a11 + r02 * a12 - r10 * a00 - r11 * a01 - r12 * a02
            fit = (
                r00 * a00
                + r01 * a01
                + r02 * a02
                + r10 * a10
                + r11 * a11
                + r12 * a12
                + r20 * a20
                + r21 * a21
                + r22 * a22
            )
            scale = 1.0 / (abs(fit) + 1e-20)
            x, y, z = x * scale, y * scale, z * scale
            square = x * x + y * y + z * z
            if square > 4.0:
                scale = 2.0 / np.sqrt(square)
                x, y, z = x * scale, y * scale, z * scale
            # The quaternion (1, omega / 2), normalized, is omega's rotation to second order,
            # without sine and cosine.
            w = 1.0 / np.sqrt(1.0 + 0.25 * min(square, 4.0))
            x, y, z = 0.5 * w * x, 0.5 * w * y, 0.5 * w * z
            s00, s01, s02 = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
            s10, s11, s12 = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
            s20, s21, s22 = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
            r00, r10, r20 = (
                s00 * r00 + s01 * r10 + s02 * r20,
                s10 * r00 + s11 * r10 + s12 * r20,
                s20 * r00 + s21 * r10 + s22 * r20,
            )
            r01, r11, r21 = (
                s00 * r01 + s01 * r11 + s02 * r21,
                s10 * r01 + s11 * r11 + s12 * r21,
                s20 * r01 + s21 * r11 + s22 * r21,
            )
            r02, r12, r22 = (
                s00 * r02 + s01 * r12 + s02 * r22,
                s10 * r02 + s11 * r12 + s12 * r22,
                s20 * r02 + s21 * r12 + s22 * r22,
            )
            if square < 1e-14:
                break
        r[n, 0, 0], r[n, 0, 1], r[n, 0, 2] = r00, r01, r02
        r[n, 1, 0], r[n, 1, 1], r[n, 1, 2] = r10, r11, r12
        r[n, 2, 0], r[n, 2, 1], r[n, 2, 2] = r20, r21, r22
        fit = (
            r00 * a00
            + r01 * a01
            + r02 * a02
            + r10 * a10
            + r11 * a11
            + r12 * a12
            + r20 * a20
            + r21 * a21
            + r22 * a22
        )
        lost[n] = not (fit > 0.0) or square > 0.16
    return lost
