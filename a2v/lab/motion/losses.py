"""The objective of Eq. 12."""

from __future__ import annotations

from typing import Literal, NamedTuple

import torch
from torch import Tensor

from a2v.lab.motion.networks import Roots
from a2v.lab.motion.vae import Reconstruction, shifted

ReconstructionLoss = Literal["norm", "mse"]
AlignmentLoss = Literal["norm", "mse"]


class Losses(NamedTuple):
    """Scalar terms of Eq. 12, each averaged over batch and frames, not weighted."""

    reconstruction: Tensor
    kl: Tensor
    alignment: Tensor


def gaussian_kl(mean1: Tensor, logvar1: Tensor, mean2: Tensor, logvar2: Tensor) -> Tensor:
    """Return the KL divergence (...) of diagonal Gaussians 1 from 2, given as (..., Z) means and
    log variances."""
    ratio = logvar1 - logvar2
    return 0.5 * (torch.exp(ratio) + (mean1 - mean2) ** 2 * torch.exp(-logvar2) - 1 - ratio).sum(-1)


def vae_losses(
    result: Reconstruction,
    joints: Tensor,
    *,
    reconstruction: ReconstructionLoss = "norm",
    roots: Roots = "absolute",
    alignment: AlignmentLoss = "norm",
) -> Losses:
    """Terms of Eq. 12.

    Parameters
    ----------
    result : Reconstruction
    joints : (B, T, J, 3)
        Real poses; the first root at the origin.
    reconstruction : "norm" or "mse"
        Eq. 13, the sum over joints of the Euclidean norm, or the published code's mean squared
        error.
    roots : "absolute" or "relative"
        Whether absolute joints are compared, or joints relative to the root and the root's step
        since the last frame. Networks with relative roots cannot know how far they have drifted.
    alignment : "norm" or "mse"
        Eq. 12, the Euclidean norm of the error of the root's velocity, or the published code's mean
        squared error. The norm is least at the median of the velocities, which is near zero for an
        action that mostly stands still; the squared error is least at their mean.
    """
    difference = result.pose.joints - joints
    if roots == "relative":
        made, real = result.pose.joints[:, :, :1], joints[:, :, :1]
        way = (made - result.before[:, :, :1]) - (real - shifted(real))
        difference = torch.cat([way, difference[:, :, 1:] - difference[:, :, :1]], 2)
    if reconstruction == "norm":
        # a tiny floor keeps the gradient of the norm finite if a joint is exact
        rec = torch.sqrt((difference**2).sum(-1) + 1e-12).sum(-1).mean()
    else:
        rec = (difference**2).mean()
    kl = gaussian_kl(
        result.posterior_mean, result.posterior_logvar, result.prior_mean, result.prior_logvar
    ).mean()
    if result.pose.velocity is None:
        return Losses(rec, kl, rec.new_zeros(()))
    root = joints[:, :, 0]
    velocity = root - shifted(root)
    squared = (result.pose.velocity - velocity) ** 2
    if alignment == "norm":
        return Losses(rec, kl, torch.sqrt(squared.sum(-1) + 1e-12).mean())
    return Losses(rec, kl, squared.mean())
