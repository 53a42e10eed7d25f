"""FID, accuracy, diversity and multimodality over classifier features (first paper, Sec. 5.1)."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from a2v.errors import InputError
from a2v.types import FloatArray, IntArray

DIVERSITY_PAIRS = 200
"""Random pairs over all actions, as in the papers."""

MULTIMODALITY_PAIRS = 20
"""Random pairs of each action, as in the papers."""


def gaussian_statistics(features: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (D,) and covariance (D, D) of features (N, D)."""
    return features.mean(axis=0), np.cov(features, rowvar=False)


def frechet_distance(
    first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]
) -> float:
    """Squared Fréchet distance between two Gaussians given as (mean, covariance).

    The trace of the matrix square root is taken from the eigenvalues of a symmetric product, which
    stays real for covariances of any rank.
    """
    (mean1, cov1), (mean2, cov2) = first, second
    values, vectors = linalg.eigh(cov1)
    root = vectors * np.sqrt(np.clip(values, 0, None)) @ vectors.T
    product = linalg.eigvalsh(root @ cov2 @ root)
    return float(
        ((mean1 - mean2) ** 2).sum()
        + np.trace(cov1)
        + np.trace(cov2)
        - 2 * np.sqrt(np.clip(product, 0, None)).sum()
    )


def fid(real: FloatArray, generated: FloatArray) -> float:
    """Fréchet distance between features (N, D) of real and generated motions."""
    return frechet_distance(gaussian_statistics(real), gaussian_statistics(generated))


def accuracy(predicted: IntArray, labels: IntArray) -> float:
    """Share of motions that are recognized as their action; both (N,)."""
    return float((np.asarray(predicted) == np.asarray(labels)).mean())


def diversity(
    features: FloatArray, generator: np.random.Generator, *, pairs: int = DIVERSITY_PAIRS
) -> float:
    """Mean distance of random pairs of features (N, D), over all actions."""
    first, second = generator.integers(0, len(features), (2, pairs))
    return float(np.linalg.norm(features[first] - features[second], axis=1).mean())


def multimodality(
    features: FloatArray,
    labels: IntArray,
    generator: np.random.Generator,
    *,
    pairs: int = MULTIMODALITY_PAIRS,
) -> float:
    """Mean distance of random pairs of features (N, D) of the same action, averaged over the
    actions that occur in `labels` (N,).

    Raises
    ------
    InputError
        There are no motions.
    """
    means = []
    for label in np.unique(labels):
        own = features[labels == label]
        first, second = generator.integers(0, len(own), (2, pairs))
        means.append(np.linalg.norm(own[first] - own[second], axis=1).mean())
    if not means:
        raise InputError("multimodality needs at least one motion")
    return float(np.mean(means))


def confidence_interval(values: FloatArray) -> tuple[float, float]:
    """Mean and half width of the 95 % interval, 1.96 std / sqrt(n), of repeated measurements
    (n,)."""
    values = np.asarray(values, dtype=np.float64)
    return float(values.mean()), float(1.96 * values.std() / np.sqrt(len(values)))
