"""Pose prior: a Gaussian mixture over the angles of the rig (Eq. 18), fitted to CMU by
``scripts/fit_pose_prior.py``."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from a2v.errors import InputError
from a2v.io import read_npz
from a2v.types import FloatArray

if TYPE_CHECKING:
    import torch

SHIPPED = Path(__file__).parent / "data" / "pose_prior_anny.npz"


@dataclass(frozen=True, eq=False)
class PosePrior:
    """A Gaussian mixture with full covariances.

    Attributes
    ----------
    weights : (K,), means : (K, D), covariances : (K, D, D)
        Angles in radians, in the order of `names`.
    names : tuple of D str
        Angles of `PoseSpace`.
    source : str
        The data that it was fitted to.
    """

    weights: FloatArray
    means: FloatArray
    covariances: FloatArray
    names: tuple[str, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        k, d = self.means.shape
        if self.weights.shape != (k,) or self.covariances.shape != (k, d, d):
            raise InputError(
                f"pose prior: weights {self.weights.shape}, means {self.means.shape} and "
                f"covariances {self.covariances.shape} do not fit together"
            )

    @cached_property
    def _whiten(self) -> FloatArray:
        """Inverses (K, D, D) of the covariances' Cholesky factors."""
        factor: FloatArray = np.linalg.inv(np.linalg.cholesky(self.covariances.astype(np.float64)))
        return factor

    @cached_property
    def _constant(self) -> FloatArray:
        """Logarithms (K,) of the weights times the densities at the means."""
        constant: FloatArray = (
            np.log(self.weights.astype(np.float64))
            - 0.5 * self.means.shape[1] * np.log(2 * np.pi)
            + np.log(np.diagonal(self._whiten, axis1=1, axis2=2)).sum(axis=1)
        )
        return constant

    def log_likelihood(self, angles: torch.Tensor) -> torch.Tensor:
        """log Σ g_i N(θ; μ_i, Σ_i) of angles (..., D) → (...,), differentiable; Eq. 18 is its
        negative."""
        import torch

        gap = angles[..., None, :] - torch.from_numpy(self.means).to(angles)
        white = (torch.from_numpy(self._whiten).to(angles) @ gap[..., None])[..., 0]
        return torch.logsumexp(
            torch.from_numpy(self._constant).to(angles) - 0.5 * white.square().sum(-1), dim=-1
        )

    @cached_property
    def best(self) -> float:
        """The log-likelihood at the likeliest mean, so that a penalty can start near zero."""
        import torch

        return float(self.log_likelihood(torch.from_numpy(self.means.astype(np.float64))).max())


@lru_cache(maxsize=4)
def load_pose_prior(path: str | os.PathLike[str] = SHIPPED) -> PosePrior:
    """Read a mixture; by default the shipped one for Anny.

    Raises
    ------
    InputError
        The file cannot be read or holds something else.
    """
    arrays = read_npz(path)
    if missing := [
        name for name in ("weights", "means", "covariances", "names") if name not in arrays
    ]:
        raise InputError(
            f"{path} holds no pose prior: no array '{missing[0]}'; make one with "
            "scripts/fit_pose_prior.py"
        )
    return PosePrior(
        weights=arrays["weights"],
        means=arrays["means"],
        covariances=arrays["covariances"],
        names=tuple(str(name) for name in arrays["names"]),
        source=str(arrays.get("source", "")),
    )
