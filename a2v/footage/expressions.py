"""Fit the 52 expressions to mediapipe's landmarks of a face in every frame of a video."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.body.face import actions_of, face_landmarks, teeth
from a2v.types import FloatArray, IntArray

LEAST = 0.3
"""Share of the frames in which a face must be seen for its expressions to be used."""
FRAMES = 8
"""Smallest number of such frames."""
_STEADY = 0.0012
"""Largest displacement in meters by any expression of the landmarks that align the face."""
_ERROR = 0.0015
"""Expected error of a landmark, meters."""
_ALIKE = 12.0
"""Number of neighboring landmarks with correlated errors."""
_SPREAD = 0.4
"""Usual strength of an expression."""
RARE = (
    "mouthClose",
    "mouthRoll",
    "mouthShrug",
    "mouthPress",
    "jawForward",
    "jawLeft",
    "jawRight",
    "mouthFunnel",
    "cheekPuff",
    "tongueOut",
)
"""Rare expressions that resemble parts of others."""
_RARE = 0.15
"""Their usual strength."""
_SPARSE = 1.0
"""Weight of the L1 penalty on expressions, in standard deviations."""
_AGAIN = 3
_DEPTH = 0.3
"""Weight of the depth of a landmark relative to its place in the picture."""
_NEUTRAL = 0.25
"""Share of the frames, those with the most open eyes and the most closed jaw, that count as
neutral."""
_ROUNDS = 300
_SMOOTH = 0.7
"""Standard deviation in frames with which strengths are smoothed. A blink lasts five frames."""
_FADE = 0.25
"""Time in seconds in which an unseen face returns to neutral."""
_EYES = ((159, 145), (386, 374))
"""Landmarks of the lids' middles, upper and lower."""
_JAW = (1, 152)
"""Landmarks of nose and chin."""


@dataclass(frozen=True)
class FaceBasis:
    """The body's face in the detector's landmarks, meters: at rest (478, 3), their moves by `names`
    (52, 478, 3), and the `steady` ones (n,)."""

    names: tuple[str, ...]
    rest: FloatArray
    moves: FloatArray
    steady: IntArray


@functools.cache
def face_basis() -> FaceBasis:
    """Return the face of Anny."""
    corners, weights = face_landmarks()
    around, actions = teeth().around, actions_of()
    moves = np.zeros((len(actions), len(corners), 3))
    for row, (vertices, offsets) in zip(moves, actions.values(), strict=True):
        moved, own = np.zeros_like(around), vertices < len(around)
        moved[vertices[own]] = offsets[own]
        row[:] = (moved[corners] * weights[..., None]).sum(axis=1)
    rest = (around[corners] * weights[..., None]).sum(axis=1)
    steady = np.flatnonzero(np.linalg.norm(moves, axis=-1).max(axis=0) < _STEADY)
    return FaceBasis(tuple(actions), rest, moves, steady)


def fit_expressions(faces: Sequence[FloatArray | None], times: FloatArray) -> dict[str, FloatArray]:
    """Fit strengths (T,) in [0, 1] of the expressions by ARKit's names; empty if the face is rarely
    visible.

    The landmarks are aligned with the body's by those that no expression moves (a similarity). The
    neutral face is the median of frames with open eyes and a closed jaw. The strengths w of a frame
    minimize ‖B w - d‖² + ‖w‖² + 2 Σ w in units of standard deviations, 0 <= w <= 1.

    Parameters
    ----------
    faces : T of (478, 3) or None
        u, v and depth, larger is nearer, in any unit.
    times : (T,)
        Seconds.
    """
    seen = np.array([face is not None for face in faces])
    if seen.sum() < max(FRAMES, LEAST * len(faces)):
        return {}
    basis = face_basis()
    points = np.stack(
        [np.asarray(face, np.float64) for face in faces if face is not None]
    ) * np.array([1.0, -1.0, 1.0])
    laid = _aligned(points[:, basis.steady], basis.rest[basis.steady], points)
    neutral = _neutral(laid)
    strengths = _strengths(laid - neutral, basis)
    # after the expressions' moves are removed, all landmarks align the face
    for _ in range(_AGAIN):
        laid = _aligned(points, neutral + np.einsum("tb,bnk->tnk", strengths, basis.moves), points)
        strengths = _strengths(laid - neutral, basis)
    found = np.zeros((len(faces), len(basis.names)))
    found[seen] = strengths
    found = _rested(found, seen, times)
    smooth = np.clip(gaussian_filter1d(found, _SMOOTH, axis=0, mode="nearest"), 0, 1).astype(
        np.float32
    )
    return {
        name: smooth[:, index]
        for index, name in enumerate(basis.names)
        if smooth[:, index].max() > 0.05
    }


def _aligned(own: FloatArray, target: FloatArray, points: FloatArray) -> FloatArray:
    """Move, turn and scale points (T, N, 3) as best aligns `own` (T, n, 3) with `target` (n, 3) or
    (T, n, 3) (Umeyama 1991)."""
    target = np.broadcast_to(target, own.shape)
    middle, center = target.mean(axis=1, keepdims=True), own.mean(axis=1, keepdims=True)
    first, second = own - center, target - middle
    u, sizes, vt = np.linalg.svd(np.einsum("tnk,tnl->tkl", second, first))
    sign = np.ones((len(points), 3))
    sign[:, 2] = np.linalg.det(u @ vt)
    turn = (u * sign[:, None]) @ vt
    scale = (sizes * sign).sum(axis=1) / np.maximum((first**2).sum(axis=(1, 2)), 1e-12)
    laid: FloatArray = (
        scale[:, None, None] * np.einsum("tkl,tnl->tnk", turn, points - center) + middle
    )
    return laid


def _neutral(laid: FloatArray) -> FloatArray:
    """Return the face (478, 3) at rest."""
    lids = sum(laid[:, upper, 1] - laid[:, lower, 1] for upper, lower in _EYES)
    jaw = laid[:, _JAW[0], 1] - laid[:, _JAW[1], 1]
    order = np.argsort(jaw - lids, kind="stable")
    neutral: FloatArray = np.median(laid[order[: max(3, round(_NEUTRAL * len(laid)))]], axis=0)
    return neutral


def _strengths(moved: FloatArray, basis: FaceBasis) -> FloatArray:
    """Return the strengths (T, 52) that move landmarks by (T, 478, 3), by accelerated projected
    gradients (Nesterov 1983)."""
    weight = np.array([1.0, 1.0, _DEPTH]) / (_ERROR**2 * _ALIKE)
    spread = np.array([_RARE if name.startswith(RARE) else _SPREAD for name in basis.names])
    matrix = np.einsum("ank,k,bnk->ab", basis.moves, weight, basis.moves) + np.diag(1 / spread**2)
    wanted = np.einsum("tnk,k,bnk->tb", moved, weight, basis.moves) - _SPARSE / spread
    step = 1 / float(np.linalg.eigvalsh(matrix)[-1])
    now, ahead, speed = np.zeros_like(wanted), np.zeros_like(wanted), 1.0
    for _ in range(_ROUNDS):
        before, now = now, np.clip(ahead - step * (ahead @ matrix - wanted), 0, 1)
        faster = (1 + np.sqrt(1 + 4 * speed**2)) / 2
        ahead, speed = now + (speed - 1) / faster * (now - before), faster
    return np.asarray(now)


def _rested(found: FloatArray, seen: np.ndarray, times: FloatArray) -> FloatArray:
    """Interpolate strengths (T, 52) between frames in which the face is visible; in long gaps the
    face is at rest."""
    at = times[seen]
    out = np.stack([np.interp(times, at, column) for column in found[seen].T], axis=1)
    after = np.searchsorted(at, times).clip(0, len(at) - 1)
    before = (np.searchsorted(at, times, side="right") - 1).clip(0, len(at) - 1)
    gap = np.minimum(np.abs(times - at[before]), np.abs(at[after] - times))
    return np.asarray(out * np.clip(1 - (gap - 0.1) / _FADE, 0, 1)[:, None])
