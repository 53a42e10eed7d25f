"""Losses of the networks of the implicit surface."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from a2v.lab.surface.networks import OCCUPANCY_WIDTH

REACH = 0.05
"""Beyond this distance, meters, a prediction only has to be at least as large."""


def distance_loss(predicted: Tensor, true: Tensor) -> Tensor:
    """Return the mean |error| near the surface, decimeters, plus the occupancy's cross entropy.
    Beyond `REACH`, a prediction only counts if it is smaller than `REACH`."""
    error = torch.where(
        true.abs() > REACH,
        functional.relu(REACH - true.sign() * predicted),
        (predicted - true).abs(),
    )
    occupancy = functional.binary_cross_entropy_with_logits(
        -predicted / OCCUPANCY_WIDTH, (true < 0).float()
    )
    return error.mean() / 0.1 + occupancy


def normal_loss(predicted: Tensor, true: Tensor) -> Tensor:
    """Return the mean of 1 - cosine of both normals (B, 6, H, W) over pixels with true normals."""
    losses = []
    for part in (slice(0, 3), slice(3, 6)):
        there = true[:, part].square().sum(dim=1) > 0.25
        cosine = functional.cosine_similarity(predicted[:, part], true[:, part], dim=1)
        losses.append(((1 - cosine) * there).sum() / there.sum().clamp(min=1))
    return torch.stack(losses).mean()


def depth_loss(predicted: Tensor, true: Tensor) -> Tensor:
    """Return the mean |error|, decimeters, of depth maps (B, 2, H, W).

    NaN in `true` is ignored; the part of an error above 15 cm counts a tenth.
    """
    there = torch.isfinite(true)
    error = (predicted - torch.nan_to_num(true)).abs()
    error = torch.where(error < 0.15, error, 0.15 + 0.1 * (error - 0.15)) / 0.1
    return (error * there).sum() / there.sum().clamp(min=1)
