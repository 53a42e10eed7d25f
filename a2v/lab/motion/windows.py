"""Whole windows of motion as short codes: bone directions and root path through a linear basis
(PCA).

The remainder of a plain PCA is small for the pose, but large for a foot that should stand still. So
the basis minimizes a sum of squares that includes the feet's positions and steps besides the
directions (`foot_metric`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.sparse.linalg import eigsh

from a2v.errors import InputError
from a2v.kinematics import Skeleton
from a2v.kinematics.ground import face_forward, first_heading
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.motion.features import ROOT_WEIGHT, window_features
from a2v.types import FloatArray

_LEAST_SCALE = 1e-5
"""Smallest standard deviation of a direction; below it, the direction counts as constant."""
CODE_FIELDS = ("mean", "basis", "encoder", "scale")


def foot_metric(
    skeleton: Skeleton, lengths: FloatArray, frames: int, *, place: float, step: float
) -> FloatArray:
    """Return M of the sum of squares x^T M x, which includes the feet's positions and steps, for
    flat features x of `frames` frames.

    Feet are linear in the features for bones of given lengths, as long as directions are not
    normalized again.

    Parameters
    ----------
    skeleton : Skeleton
        Skeleton whose `feet` are used.
    lengths : (J,)
        Bone lengths of a typical body, in the features' unit of length; the mean bone is the unit
        of the weights.
    frames : int
    place, step : float
        Weights of the square of a foot's place and of its step from one frame to the next.

    Returns
    -------
    (N, N) float64
        Symmetric, positive definite: the identity for weights of 0. N = 3 J `frames`.
    """
    feet, joints = list(skeleton.feet), skeleton.n_joints
    levers = np.zeros((joints, len(feet)))
    levers[0] = 1 / ROOT_WEIGHT
    levers[1:] = (skeleton.path_matrix[feet, 1:] * lengths[1:]).T
    levers /= np.mean(lengths[1:])
    in_frame = np.kron(levers @ levers.T, np.eye(3))
    steps = np.diff(np.eye(frames), axis=0)
    in_time = place * np.eye(frames) + step * steps.T @ steps
    metric: FloatArray = np.eye(3 * joints * frames) + np.kron(in_time, in_frame)
    return metric


@dataclass(frozen=True)
class LinearCode:
    """A PCA of flat features, under a metric.

    Attributes
    ----------
    mean : (N,) float32
    basis : (D, N) float32
        Rows that a code combines, orthonormal in the metric.
    encoder : (D, N) float32
        Rows that make coefficients from features: the basis times the metric.
    scale : (D,) float32
        Standard deviation of each coefficient: codes have unit variance.
    """

    mean: FloatArray
    basis: FloatArray
    encoder: FloatArray
    scale: FloatArray

    @classmethod
    def fit(cls, features: FloatArray, size: int, metric: FloatArray | None = None) -> LinearCode:
        """Fit the first `size` components of features (M, N) under a positive definite `metric` (N,
        N), else the identity."""
        if size > min(features.shape):
            raise InputError(
                f"a code of {size} numbers needs at least as many windows and "
                f"features; got {features.shape}"
            )
        mean = features.mean(axis=0, dtype=np.float64)
        centered = (features - mean).astype(np.float64)
        root = None if metric is None else np.linalg.cholesky(metric)  # metric = root root^T
        seen = centered if root is None else centered @ root
        covariance = seen.T @ seen / len(features)
        if size < covariance.shape[0] // 4:
            # a Krylov solver finds the first few of thousands of directions in seconds; its start
            # is fixed
            values, vectors = eigsh(covariance, k=size, v0=np.ones(len(covariance)))
        else:
            values, vectors = np.linalg.eigh(covariance)
        order = np.argsort(values)[::-1][:size]
        scale = np.sqrt(np.maximum(values[order], 1e-12))
        leading = vectors[:, order]
        basis = encoder = leading.T
        if root is not None:
            basis, encoder = (
                solve_triangular(root, leading, lower=True, trans="T").T,
                (root @ leading).T,
            )
        return cls(*(part.astype(np.float32) for part in (mean, basis, encoder, scale)))

    @property
    def inverse_scale(self) -> FloatArray:
        """1 / scale (D,), and 0 for constant directions.

        Few clips have few directions, and 1 / scale of the others would overflow half precision.
        """
        varies = self.scale > _LEAST_SCALE
        return np.where(varies, 1 / np.where(varies, self.scale, 1), 0).astype(np.float32)

    def encode(self, features: FloatArray) -> FloatArray:
        """Return codes (M, D) of features (M, N)."""
        code: FloatArray = (features - self.mean) @ self.encoder.T * self.inverse_scale
        return code

    def rotation_to(self, other: LinearCode) -> FloatArray:
        """Return the rotation Q (D, D) float32 nearest to the map from codes of `other` to codes of
        this: this = Q other.

        Both codes have unit covariance, so Q is exact for windows that both codes represent.
        """
        between = (self.encoder @ other.basis.T) * other.scale / self.scale[:, None]
        left, _, right = np.linalg.svd(between)
        rotation: FloatArray = left @ right
        return rotation

    def decode(self, code: FloatArray) -> FloatArray:
        """Return features (M, N) of codes (M, D)."""
        features: FloatArray = (code * self.scale) @ self.basis + self.mean
        return features


@dataclass(frozen=True, kw_only=True)
class CodecSettings:
    """Sizes of a `WindowCodec`.

    Attributes
    ----------
    size, context_size : int
        Numbers in the code of a window, and of the frames that it continues.
    context_frames : int
    foot_place, foot_step : float
        As in `foot_metric`.
    forward : bool
        Windows are turned so that their first frames face +z.
    """

    size: int
    context_size: int
    context_frames: int
    foot_place: float = 0.0
    foot_step: float = 0.0
    forward: bool = False


@dataclass(frozen=True)
class WindowCodec:
    """Codes of whole windows and of their first frames.

    Attributes
    ----------
    window : LinearCode
        Of windows of `frames` frames.
    context : LinearCode
        Of the first `context_frames` frames, which a following window continues.
    frames, context_frames : int
    """

    window: LinearCode
    context: LinearCode
    frames: int
    context_frames: int

    @classmethod
    def fit(
        cls,
        dataset: ActionDataset,
        settings: CodecSettings,
        *,
        windows: int = 6000,
        seed: int = 0,
    ) -> WindowCodec:
        """Fit both codes on random windows of `dataset` (of its own length)."""
        generator = np.random.default_rng(seed)
        sampler = ClipSampler(dataset, dataset.length)
        joints = sampler.windows(generator.integers(0, len(dataset), windows), generator)
        if settings.forward:
            joints = face_forward(joints, first_heading(joints, dataset.skeleton))
        features = window_features(joints, dataset.skeleton)
        metric = None
        if settings.foot_place or settings.foot_step:
            lengths = np.median(dataset.clip_bone_lengths, axis=0)
            metric = foot_metric(
                dataset.skeleton,
                lengths,
                dataset.length,
                place=settings.foot_place,
                step=settings.foot_step,
            )
        return cls(
            LinearCode.fit(features.reshape(windows, -1), settings.size, metric),
            LinearCode.fit(
                features[:, : settings.context_frames].reshape(windows, -1), settings.context_size
            ),
            dataset.length,
            settings.context_frames,
        )

    def to_arrays(self) -> dict[str, FloatArray]:
        """Return arrays to store; see `from_arrays`."""
        parts = {"window": self.window, "context": self.context}
        return {
            f"{name}.{field}": getattr(code, field)
            for name, code in parts.items()
            for field in CODE_FIELDS
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray], features: int) -> WindowCodec:
        """Make a codec from the arrays of `to_arrays`; `features` is the number of features per
        frame."""
        window, context = (
            LinearCode(*(arrays[f"{name}.{field}"] for field in CODE_FIELDS))
            for name in ("window", "context")
        )
        return cls(window, context, len(window.mean) // features, len(context.mean) // features)
