"""The terms of `a2v.footage.fit` for one frame, with analytic first derivatives."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from a2v.body.evidence import SEGMENT_ENDS
from a2v.body.pose_prior import PosePrior
from a2v.footage.figure import Figure
from a2v.footage.fit import _POSE_WEIGHT, _SMOOTH_WEIGHT, FilmFit
from a2v.footage.terms import _DEPTH, _DEPTH_WEIGHT, _KEYPOINT, _ROBUST
from a2v.footage.track import Track
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.types import FloatArray

FREE = 6
"""Number of unknowns beside the angles: a turn of the body and its place."""
_TOLERANCE = 0.03


@dataclass(frozen=True)
class Pose:
    """Orientation (3, 3), angles (D,) and place (3,) of a body."""

    root: FloatArray
    angles: FloatArray
    place: FloatArray

    def moved(self, step: FloatArray) -> Pose:
        """Add a step (6 + D,): a rotation vector in the world, a shift, and changes of angles."""
        return Pose(
            rotvec_to_rotmat(step[:3]) @ self.root,
            self.angles + step[FREE:],
            self.place + step[3:FREE],
        )


@dataclass
class Recent:
    """Times and joints (J, 3) of the last two frames."""

    times: list[float] = field(default_factory=list)
    joints: list[FloatArray] = field(default_factory=list)

    def add(self, time: float, joints: FloatArray) -> None:
        """Add a frame, and drop the oldest one."""
        self.times, self.joints = [*self.times[-1:], time], [*self.joints[-1:], joints]

    def clear(self) -> None:
        """Drop all frames."""
        self.times, self.joints = [], []


class LiveFigure:
    """A `Figure` of fixed shape in NumPy for one pose, with derivatives."""

    def __init__(self, figure: Figure) -> None:
        frame = figure.frame
        self.parents = frame.parents.tolist()
        self.steps, self.marks = figure.steps.numpy(), figure.marks.numpy()
        self.shares = frame.shares.numpy()
        count = len(self.parents)
        self.basis = frame.basis.numpy().reshape(len(frame.basis), count, 3)
        carrier = frame.joint_carrier.numpy()
        self.points = np.zeros((len(carrier), count, 3))
        self.points[np.arange(len(carrier)), carrier] = figure.points.numpy()
        self.carried = np.eye(count)[carrier]

    def posed(self, pose: Pose) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return rotations (n, 3, 3) and heads (n, 3) of the bones, and their derivatives.

        The derivatives by the unknowns (6 + D) are rotation vectors (n, 6 + D, 3) in the world and
        shifts of heads (n, 6 + D, 3).
        """
        vectors = np.einsum("d,dbk->bk", pose.angles, self.basis)
        local, left = rotvec_to_rotmat(vectors), left_jacobian(vectors)
        axes = np.einsum("bij,dbj->bdi", left, self.basis)
        count, unknowns = len(self.parents), FREE + len(pose.angles)
        turns, heads = np.empty((count, 3, 3)), np.empty((count, 3))
        spin, shift = np.zeros((count, unknowns, 3)), np.zeros((count, unknowns, 3))
        turns[0], heads[0] = pose.root, pose.place + self.steps[0]
        spin[0, :3], shift[0, 3:FREE] = np.eye(3), np.eye(3)
        for bone in range(1, count):
            parent = self.parents[bone]
            turns[bone] = turns[parent] @ local[bone]
            step = turns[parent] @ self.steps[bone]
            heads[bone] = heads[parent] + step
            spin[bone] = spin[parent]
            spin[bone, FREE:] += axes[bone] @ turns[parent].T
            shift[bone] = shift[parent] + crossed(spin[parent], step)
        return turns, heads, spin, shift

    @lru_cache(maxsize=1)  # noqa: B019  # one figure lives as long as its fit
    def precisions(self, prior: PosePrior) -> FloatArray:
        """Return the inverse covariances (K, D, D) of the pose prior."""
        return np.asarray(np.swapaxes(prior._whiten, 1, 2) @ prior._whiten)

    def joints(self, pose: Pose) -> FloatArray:
        """Return `a2v.footage.figure.JOINTS` (J, 3), meters."""
        turns, heads, _, _ = self.posed(pose)
        return np.asarray(np.einsum("bij,lbj->li", turns, self.points) + self.carried @ heads)


def attached(
    points: FloatArray, shares: FloatArray, posed: tuple[FloatArray, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return points (L, 3) carried by bones, and their derivatives (L, 6 + D, 3).

    Parameters
    ----------
    points : (L, n, 3)
        Offsets from the heads in the axes of the bones, times the shares of the bones.
    shares : (L, n)
    posed : as of `LiveFigure.posed`
    """
    turns, heads, spin, shift = posed
    arms = np.einsum("bij,lbj->ilb", turns, points)
    places = arms.sum(axis=2).T + shares @ heads
    x, y, z = np.moveaxis(spin, 2, 0)
    moves = np.stack(
        [
            arms[2] @ y - arms[1] @ z + shares @ shift[..., 0],
            arms[0] @ z - arms[2] @ x + shares @ shift[..., 1],
            arms[1] @ x - arms[0] @ y + shares @ shift[..., 2],
        ],
        axis=-1,
    )
    return places, moves


class Costs:
    """Cost of a pose in one frame: `FilmFit`'s terms."""

    def __init__(
        self,
        figure: LiveFigure,
        track: Track,
        points: FloatArray,
        *,
        tilt: float,
        film: FilmFit,
        recent: Recent,
    ) -> None:
        self.figure, self.tilt, self.prior, self.recent = figure, tilt, film.prior, recent
        self.limits = film.space.limits.astype(np.float64)
        self.precisions = figure.precisions(film.prior)
        self.usual = film.settings.acceleration
        self.time = float(track.times[-1])
        self.focal, self.height = track.focal, float(track.heights[-1])
        self.pixels, self.weights = track.pixels[-1], track.weights[-1]
        ends = points[-1, SEGMENT_ENDS, 2]
        self.depths = (ends[:, 1] - ends[:, 0]) / TYPICAL_HEIGHT
        self.sure = track.confidence[-1][SEGMENT_ENDS].min(axis=-1)

    def at(self, pose: Pose) -> tuple[float, FloatArray, FloatArray]:
        """Return the cost, half of its gradient and half of its approximate curvature."""
        posed = self.figure.posed(pose)
        total = _Sum(FREE + len(pose.angles))
        marks, moves = attached(self.figure.marks, self.figure.shares, posed)
        self._seen(total, marks, moves)
        self._smooth(total, posed)
        self._likely(total, pose.angles)
        return total.cost, total.gradient, total.curvature

    def _seen(self, total: _Sum, marks: FloatArray, moves: FloatArray) -> None:
        """Add the positions of landmarks in the picture, and the depths of bones."""
        cosine, sine = np.cos(self.tilt), np.sin(self.tilt)
        axes = np.array([[1, 0, 0], [0, -cosine, sine], [0, -sine, -cosine]])
        seen, by = marks @ axes.T, moves @ axes.T  # right, down, ahead
        ahead = np.maximum(seen[:, 2:], 0.3)
        scale = self.focal / self.height
        gap = scale * (seen[:, :2] / ahead - self.pixels / self.focal)
        slope = (
            scale * (by[..., :2] - (seen[:, :2] / ahead)[:, None] * by[..., 2:]) / ahead[:, None]
        )
        total.add(gap, slope, self.weights / _KEYPOINT**2, _ROBUST)
        far = scale / ahead.mean()
        first, last = SEGMENT_ENDS.T
        gap = far * (marks[last, 2] - marks[first, 2]) - self.depths
        slope = far * (moves[last, :, 2] - moves[first, :, 2])
        total.add(gap[:, None], slope[..., None], self.sure * _DEPTH_WEIGHT / _DEPTH**2, 3 * _DEPTH)

    def _smooth(self, total: _Sum, posed: tuple[FloatArray, ...]) -> None:
        """Add the accelerations of joints: quadratic for usual ones, linear beyond."""
        if len(self.recent.times) < 2:
            return
        joints, moves = attached(self.figure.points, self.figure.carried, posed)
        before, last = self.recent.joints
        early, late = self.recent.times[1] - self.recent.times[0], self.time - self.recent.times[1]
        share = 2 / (late * (early + late)) / self.usual
        gap = share * (joints - last - (last - before) * late / early)
        root = np.sqrt(1 + (gap**2).sum(axis=1))
        total.add(gap, share * moves, _SMOOTH_WEIGHT / root)
        total.cost += float(_SMOOTH_WEIGHT * (2 * (root - 1) - (gap**2).sum(axis=1) / root).sum())

    def _likely(self, total: _Sum, angles: FloatArray) -> None:
        """Add the pose prior and the limits of the angles."""
        own = slice(FREE, None)
        low, high = self.limits.T
        beyond = np.maximum(angles - high, 0) - np.maximum(low - angles, 0)
        total.cost += float((beyond**2).sum()) / _TOLERANCE**2
        total.gradient[own] += beyond / _TOLERANCE**2
        total.curvature[own, own] += np.diag((beyond != 0) / _TOLERANCE**2)
        prior = self.prior
        white = np.einsum("kij,kj->ki", prior._whiten, angles - prior.means)
        logs = prior._constant - 0.5 * (white**2).sum(axis=1)
        top = logs.max()
        parts = np.exp(logs - top)
        total.cost += float(2 * _POSE_WEIGHT * (prior.best - top - np.log(parts.sum())))
        parts = _POSE_WEIGHT * parts / parts.sum()
        total.gradient[own] += np.einsum("k,kij,ki->j", parts, prior._whiten, white)
        total.curvature[own, own] += np.tensordot(parts, self.precisions, 1)


class _Sum:
    """A sum of weighted squares, with half its gradient and half its curvature."""

    def __init__(self, unknowns: int) -> None:
        self.cost = 0.0
        self.gradient, self.curvature = np.zeros(unknowns), np.zeros((unknowns, unknowns))

    def add(
        self, gap: FloatArray, slope: FloatArray, weights: FloatArray, robust: float = np.inf
    ) -> None:
        """Add residuals (n, c) of slope (n, unknowns, c), robust above `robust` (Eq. 16)."""
        square = (gap**2).sum(axis=1)
        rest = 1.0 if np.isinf(robust) else robust**2 / (robust**2 + square)
        self.cost += float((weights * square * rest).sum())
        held = weights * rest**2
        flat = np.moveaxis(slope, 2, 1).reshape(-1, slope.shape[1])
        repeated = np.repeat(held, gap.shape[1])
        self.gradient += flat.T @ (repeated * gap.ravel())
        self.curvature += flat.T @ (repeated[:, None] * flat)


def crossed(vectors: FloatArray, by: FloatArray) -> FloatArray:
    """Return the cross products of vectors (..., 3) with one vector (3,)."""
    x, y, z = by
    return np.asarray(vectors @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]).T * -1)


def left_jacobian(vectors: FloatArray) -> FloatArray:
    """Return the left Jacobians (..., 3, 3) of the exponential map of rotations at vectors
    (..., 3)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5, (1 - np.cos(safe)) / safe**2)
    second = np.where(small, 1 / 6, (safe - np.sin(safe)) / safe**3)
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    skew = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    return np.asarray(np.eye(3) + first * skew + second * (skew @ skew))
