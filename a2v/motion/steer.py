"""Constraints for a window model: a path, a heading, poses at given moments, joints that are held.

All of them are linear in a window's code (`a2v.lab.motion.windows`), as long as bone directions are
not normalized again: C x = b. At each step the flow predicts a final code. The gain of a Kalman
filter corrects this code by its error in the constraints (`a2v.lab.motion.flow`), and the flow
adapts the rest. The error from the normalization is measured in the result and added to the target.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from a2v.kinematics import Skeleton
from a2v.motion.features import ROOT_WEIGHT
from a2v.types import FloatArray


@dataclass(frozen=True)
class CodeReader:
    """Linear map from the code of a window to its joints.

    Attributes
    ----------
    basis : (D, N) float32
        Features of each coefficient; N = 3 J frames.
    mean : (N,) float32
    skeleton : Skeleton
    lengths : (J,) float
        Bone lengths, meters.
    meters_per_unit : float
    frames : int
    """

    basis: FloatArray
    mean: FloatArray
    skeleton: Skeleton
    lengths: FloatArray
    meters_per_unit: float
    frames: int

    def root(self, frames: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the linear map to the root's positions at `frames` (F,) relative to the first
        frame.

        It consists of rows (F, 3, D) and offsets (F, 3), meters, in the window's own axes. `frames`
        may be fractional, here and below.
        """
        scale = self.meters_per_unit / ROOT_WEIGHT
        rows, offset = self._features(frames)
        first, at_first = self._features(np.zeros(1))
        return (rows[:, :3] - first[:, :3]) * scale, (offset[:, :3] - at_first[:, :3]) * scale

    def directions(self, frames: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the linear map to the directions of all bones at `frames`: rows (F, J - 1, 3, D)
        and offsets (F, J - 1, 3)."""
        rows, offset = self._features(frames)
        bones = (len(rows), self.skeleton.n_joints - 1, 3)
        return rows[:, 3:].reshape(*bones, -1), offset[:, 3:].reshape(bones)

    def joints(self, frames: FloatArray, joints: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Return the linear map to positions of `joints` (K,) relative to the root at the same
        `frames`: rows (F, K, 3, D) and offsets (F, K, 3), meters."""
        levers = self.skeleton.path_matrix[list(joints), 1:] * self.lengths[1:]
        rows, offsets = self.directions(frames)
        return np.einsum("kb,fbxd->fkxd", levers, rows), np.einsum("kb,fbx->fkx", levers, offsets)

    def _features(self, frames: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rows (F, 3 J, D) and offsets (F, 3 J) of the features at `frames`."""
        size = 3 * self.skeleton.n_joints
        basis, mean = (
            self.basis.reshape(len(self.basis), self.frames, size),
            self.mean.reshape(self.frames, size),
        )
        rows: FloatArray = np.moveaxis(between_frames(basis, frames, axis=1), 0, -1)
        return rows, between_frames(mean, frames)


def between_frames(values: FloatArray, frames: FloatArray, *, axis: int = 0) -> FloatArray:
    """Interpolate values linearly at `frames` (F,) along `axis`."""
    first = np.clip(np.floor(frames).astype(int), 0, max(values.shape[axis] - 2, 0))
    share = (frames - first).reshape(-1, *[1] * (values.ndim - axis - 1))
    after = np.minimum(first + 1, values.shape[axis] - 1)
    mixed: FloatArray = (1 - share) * np.take(values, first, axis) + share * np.take(
        values, after, axis
    )
    return mixed


@dataclass(frozen=True)
class SoftConstraint:
    """Target of a window: ``rows @ code + offset`` near `value`, to within `sigma`.

    Attributes
    ----------
    rows : (K, D)
    offset, value, sigma : (K,)
        `sigma` is the tolerance in units of `value`: smaller values are harder constraints.
    """

    rows: FloatArray
    offset: FloatArray
    value: FloatArray
    sigma: FloatArray

    @classmethod
    def of(
        cls, rows: FloatArray, offset: FloatArray, value: FloatArray, sigma: float
    ) -> SoftConstraint:
        """Make a constraint from arrays of any shape (..., D), (...), (...)."""
        flat = np.broadcast_to(value, offset.shape).astype(np.float64).ravel()
        return cls(
            rows.reshape(-1, rows.shape[-1]).astype(np.float64),
            offset.astype(np.float64).ravel(),
            flat,
            np.full(flat.shape, sigma),
        )


@dataclass(frozen=True)
class Steering:
    """Constraints in the form of a window graph: ``code + (goal - code @ measure.T) @ gain``.

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


def steer(constraints: Sequence[SoftConstraint], correction: FloatArray | None = None) -> Steering:
    """Join `constraints` to one steering. Codes are assumed to be standard normal, as in the flow.

    Parameters
    ----------
    constraints : sequence of SoftConstraint
        At least one.
    correction : (K,) or None
        Added to the target: the error of an earlier result.
    """
    rows = np.concatenate([constraint.rows for constraint in constraints])
    sigma = np.concatenate([constraint.sigma for constraint in constraints])
    wanted = np.concatenate([constraint.value - constraint.offset for constraint in constraints])
    if correction is not None:
        wanted = wanted + correction
    gain = np.linalg.solve(rows @ rows.T + np.diag(sigma**2), rows)
    return Steering(
        rows.astype(np.float32), gain.astype(np.float32), wanted[None].astype(np.float32)
    )


class Steerer(Protocol):
    """Steers the windows of one clip, one after the other."""

    start: tuple[FloatArray, float]
    """Position of the first root (3,), meters, and heading of the person, radians about +y from
    +z."""

    def begin(self, joints: FloatArray) -> FloatArray:
        """Move the clip's first window (1, W, J, 3), which faces +z at the origin, to its start."""

    def until(self, first: int, end: int) -> int:
        """Return the frame at which a window that could give the frames `first` to `end`
        (exclusive) has to end."""

    def window(
        self, first: int, taken: tuple[int, int], place: FloatArray, yaw: float
    ) -> Generator[Steering | None, FloatArray, None]:
        """Yield the steering of a window repeatedly; each time the resulting joints (W, J, 3) are
        sent in, until it returns.

        `first` is the index of the window's first frame in the clip. `taken` is the range of the
        window's frames that are used. `place` (3,) and `yaw` are position and heading of its first
        frame.
        """
