"""Whole windows of motion as short codes: bone directions and root path through a linear (PCA) basis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import eigsh

from a2v.datasets import ActionDataset, ClipSampler
from a2v.errors import InputError
from a2v.kinematics import Skeleton, bone_vectors
from a2v.kinematics.so3 import Array, namespace
from a2v.types import FloatArray

ROOT_WEIGHT = 3.0
"""Weight of the root's path against the unit bone directions in the basis."""


def window_features(joints: Array, skeleton: Skeleton) -> Array:
    """Features (..., T, 3 J) of native joints (..., T, J, 3) float32 whose first root is the origin, for numpy and torch.

    The first 3 are the weighted root, the others the unit directions of the bones, which leaves bone lengths out;
    a bone of zero length has the direction zero.
    """
    xp = namespace(joints)
    vectors = bone_vectors(joints, skeleton)[..., 1:, :]
    length = xp.sqrt((vectors * vectors).sum(-1))[..., None]
    directions = vectors / xp.where(length < 1e-8, xp.ones_like(length), length)
    flat = directions.reshape(*directions.shape[:-2], -1)
    features: Array = xp.concatenate([joints[..., 0, :] * ROOT_WEIGHT, flat], -1)
    return features


@dataclass(frozen=True)
class LinearCode:
    """A PCA of flat features.

    Attributes
    ----------
    mean : (N,) float32
    basis : (D, N) float32
        Orthonormal rows.
    scale : (D,) float32
        Standard deviation of each coefficient: codes have unit variance.
    """

    mean: FloatArray
    basis: FloatArray
    scale: FloatArray

    @classmethod
    def fit(cls, features: FloatArray, size: int) -> LinearCode:
        """The leading `size` components of features (M, N)."""
        if size > min(features.shape):
            raise InputError(f"a code of {size} numbers needs at least as many windows and features; got {features.shape}")
        mean = features.mean(axis=0, dtype=np.float64)
        centred = (features - mean).astype(np.float64)
        covariance = centred.T @ centred / len(features)
        if size < covariance.shape[0] // 4:
            # a Krylov solver finds the leading few of thousands of directions in seconds; its start is fixed
            values, vectors = eigsh(covariance, k=size, v0=np.ones(len(covariance)))
        else:
            values, vectors = np.linalg.eigh(covariance)
        order = np.argsort(values)[::-1][:size]
        scale = np.sqrt(np.maximum(values[order], 1e-12))
        return cls(mean.astype(np.float32), vectors[:, order].T.astype(np.float32), scale.astype(np.float32))

    def encode(self, features: FloatArray) -> FloatArray:
        """Codes (M, D) of features (M, N)."""
        code: FloatArray = (features - self.mean) @ self.basis.T / self.scale
        return code

    def decode(self, code: FloatArray) -> FloatArray:
        """Features (M, N) of codes (M, D)."""
        features: FloatArray = (code * self.scale) @ self.basis + self.mean
        return features


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
        cls, dataset: ActionDataset, *, size: int, context_size: int, context_frames: int, windows: int = 6000, seed: int = 0
    ) -> WindowCodec:
        """Fit both codes on random windows of `dataset` (of its own length)."""
        generator = np.random.default_rng(seed)
        sampler = ClipSampler(dataset, dataset.length)
        joints = sampler.windows(generator.integers(0, len(dataset), windows), generator)
        features = window_features(joints, dataset.skeleton)
        return cls(
            LinearCode.fit(features.reshape(windows, -1), size),
            LinearCode.fit(features[:, :context_frames].reshape(windows, -1), context_size),
            dataset.length,
            context_frames,
        )

    def to_arrays(self) -> dict[str, FloatArray]:
        """Arrays to store; see `from_arrays`."""
        parts = {"window": self.window, "context": self.context}
        return {f"{name}.{field}": getattr(code, field) for name, code in parts.items() for field in ("mean", "basis", "scale")}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, FloatArray], features: int) -> WindowCodec:
        """The inverse of `to_arrays`; `features` is the number of features a frame."""
        window, context = (
            LinearCode(*(arrays[f"{name}.{field}"] for field in ("mean", "basis", "scale"))) for name in ("window", "context")
        )
        return cls(window, context, len(window.mean) // features, len(context.mean) // features)
