"""Wishes for a window model: a path, a heading, poses at given moments, joints that are held.

All of them are linear in a window's code (`a2v.motion.windows`), as long as bone directions are not normalised anew: C x = b. On its way
the flow heads for a code; what that code misses of the wishes is given to it by the gain of a Kalman filter (`a2v.motion.flow`), and the
flow settles the rest around it. What normalisation moves is measured in the result and given back to the goal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.kinematics import Skeleton
from a2v.motion.features import ROOT_WEIGHT
from a2v.types import FloatArray, IntArray


@dataclass(frozen=True)
class CodeReader:
    """What a code of a window says of its joints.

    Attributes
    ----------
    basis : (D, N) float32
        Features of each coefficient; N = 3 J frames.
    mean : (N,) float32
    skeleton : Skeleton
    lengths : (J,) float
        Bone lengths, metres.
    metres_per_unit : float
    frames : int
    """

    basis: FloatArray
    mean: FloatArray
    skeleton: Skeleton
    lengths: FloatArray
    metres_per_unit: float
    frames: int

    def root(self, frames: IntArray) -> tuple[FloatArray, FloatArray]:
        """Places of the root at `frames` (F,) against the first: rows (F, 3, D) and offsets (F, 3), metres, in the window's own axes."""
        scale = self.metres_per_unit / ROOT_WEIGHT
        basis, mean = self._features()
        rows = (basis[:, frames, :3] - basis[:, :1, :3]) * scale
        return np.moveaxis(rows, 0, -1), (mean[frames, :3] - mean[:1, :3]) * scale

    def directions(self, frames: IntArray) -> tuple[FloatArray, FloatArray]:
        """Directions of all bones at `frames`: rows (F, J - 1, 3, D) and offsets (F, J - 1, 3)."""
        basis, mean = self._features()
        joints = self.skeleton.n_joints
        rows = basis[:, frames, 3:].reshape(len(basis), len(frames), joints - 1, 3)
        return np.moveaxis(rows, 0, -1), mean[frames, 3:].reshape(len(frames), joints - 1, 3)

    def joints(self, frames: IntArray, joints: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Places of `joints` (K,) against the root at the same `frames`: rows (F, K, 3, D) and offsets (F, K, 3), metres."""
        levers = self.skeleton.path_matrix[list(joints), 1:] * self.lengths[1:]
        rows, offsets = self.directions(frames)
        return np.einsum("kb,fbxd->fkxd", levers, rows), np.einsum("kb,fbx->fkx", levers, offsets)

    def _features(self) -> tuple[FloatArray, FloatArray]:
        size = 3 * self.skeleton.n_joints
        return self.basis.reshape(len(self.basis), self.frames, size), self.mean.reshape(self.frames, size)


@dataclass(frozen=True)
class Wish:
    """Numbers that a window shall have: ``rows @ code + offset`` near `value`, to within `sigma`.

    Attributes
    ----------
    rows : (K, D)
    offset, value, sigma : (K,)
        `sigma` in units of `value`: the smaller, the harder.
    """

    rows: FloatArray
    offset: FloatArray
    value: FloatArray
    sigma: FloatArray

    @classmethod
    def of(cls, rows: FloatArray, offset: FloatArray, value: FloatArray, sigma: float) -> Wish:
        """A wish from arrays of any shape (..., D), (...), (...)."""
        flat = np.broadcast_to(value, offset.shape).astype(np.float64).ravel()
        return cls(rows.reshape(-1, rows.shape[-1]).astype(np.float64), offset.astype(np.float64).ravel(), flat, np.full(flat.shape, sigma))


@dataclass(frozen=True)
class Steering:
    """Wishes as a window graph takes them: ``code + (goal - code @ measure.T) @ gain``.

    Attributes
    ----------
    measure, gain : (K, D) float32
    goal : (1, K) float32
    """

    measure: FloatArray
    gain: FloatArray
    goal: FloatArray

    def feed(self) -> dict[str, FloatArray]:
        """The graph's inputs."""
        return {"measure": self.measure, "gain": self.gain, "goal": self.goal}


def steer(wishes: Sequence[Wish], correction: FloatArray | None = None) -> Steering:
    """The steering that joins `wishes`; codes are taken for standard normal, as the flow's are.

    Parameters
    ----------
    wishes : sequence of Wish
        One at least.
    correction : (K,) or None
        Added to what is wanted: what an earlier result missed.
    """
    rows = np.concatenate([wish.rows for wish in wishes])
    sigma = np.concatenate([wish.sigma for wish in wishes])
    wanted = np.concatenate([wish.value - wish.offset for wish in wishes])
    if correction is not None:
        wanted = wanted + correction
    gain = np.linalg.solve(rows @ rows.T + np.diag(sigma**2), rows)
    return Steering(rows.astype(np.float32), gain.astype(np.float32), wanted[None].astype(np.float32))
