"""The network that completes hidden colors on both sheets: gated convolutions (Yu et al. 2019) that
choose among visible colors."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

RESIDUAL = 0.12
"""Largest change of a chosen color, in hundredths of CIELAB units."""
LOCAL = 4
"""Local candidates of a pixel: near colors of its sheet and of the other one, and those of the
mirrored pixels."""


@dataclass(frozen=True)
class CompletionSettings:
    """Sizes of the network.

    Attributes
    ----------
    widths : tuple of int
        Channels of each level, from the full resolution on.
    palette : int
        Number of colors that are gathered over the whole person.
    """

    widths: tuple[int, ...] = (24, 48, 96, 128, 160)
    palette: int = 12


class Gated(nn.Module):
    """A gated convolution."""

    def __init__(self, inside: int, outside: int, stride: int = 1) -> None:
        super().__init__()
        self.conv = nn.Conv2d(inside, 2 * outside, 3, stride, 1)

    def forward(self, values: Tensor) -> Tensor:
        """Return values (B, C, H, W) times their gates."""
        own, gate = self.conv(values).chunk(2, dim=1)
        return functional.elu(own) * torch.sigmoid(gate)


def filled_up(colors: Tensor, weight: Tensor) -> Tensor:
    """Fill colors (B, 3, H, W) of weight (B, 1, H, W) 0 from coarser and coarser means."""
    values, shares = [colors * weight], [weight]
    while min(values[-1].shape[-2:]) > 2:
        values.append(functional.avg_pool2d(values[-1], 2, ceil_mode=True))
        shares.append(functional.avg_pool2d(shares[-1], 2, ceil_mode=True))
    mean = values[-1].mean(dim=(2, 3), keepdim=True) / (
        shares[-1].mean(dim=(2, 3), keepdim=True) + 1e-4
    )
    result = mean.expand_as(values[-1])
    for value, share in zip(reversed(values), reversed(shares), strict=True):
        if result.shape[-2:] != value.shape[-2:]:
            result = functional.interpolate(
                result, size=value.shape[-2:], mode="bilinear", align_corners=False
            )
        sure = (share * 4).clamp(0, 1)
        result = sure * value / (share + 1e-4) + (1 - sure) * result
    return result


class Completion(nn.Module):
    """Completes the colors of both sheets.

    `known` are fixed maps (C, H, W) of the layout: which pixels show the body, and where.
    """

    known: Tensor

    def __init__(self, settings: CompletionSettings, known: np.ndarray) -> None:
        super().__init__()
        self.register_buffer("known", torch.from_numpy(known.astype(np.float32)))
        widths, first = settings.widths, 22 + len(known)
        self.palette = settings.palette
        self.enter = Gated(first, widths[0])
        self.down = nn.ModuleList(
            nn.Sequential(Gated(a, b, 2), Gated(b, b)) for a, b in itertools.pairwise(widths)
        )
        self.deep = nn.Sequential(Gated(widths[-1], widths[-1]), Gated(widths[-1], widths[-1]))
        self.up = nn.ModuleList(Gated(a + b, a) for a, b in itertools.pairwise(widths))
        self.gather = nn.Conv2d(widths[1], 2 * self.palette, 1)
        self.leave = nn.Conv2d(widths[0], 2 * (LOCAL + self.palette + 3), 3, 1, 1)

    def forward(self, colors: Tensor, trust: Tensor) -> Tensor:
        """Complete colors.

        Parameters
        ----------
        colors : (B, 2, 3, H, W)
            CIELAB / 100, of front and back.
        trust : (B, 2, 1, H, W)
            From 0 (hidden) to 1.

        Returns
        -------
        (B, 2, 3, H, W)
        """
        batch, _, _, height, width = colors.shape
        masked = colors * trust
        near = filled_up(colors.flatten(0, 1), trust.flatten(0, 1)).view_as(colors)
        given = torch.cat([masked, trust], dim=2).flatten(1, 2)
        known = self.known[None].expand(batch, -1, -1, -1)
        values = torch.cat([given, given.flip(-1), near.flatten(1, 2), known], dim=1)
        levels = [self.enter(values)]
        for down in self.down:
            levels.append(down(levels[-1]))
        values = self.deep(levels[-1])
        gathered = None
        for index in range(len(self.up) - 1, -1, -1):
            values = functional.interpolate(values, scale_factor=2.0, mode="nearest")
            values = self.up[index](torch.cat([levels[index], values], dim=1))
            if index == 1:
                gathered = self._gathered(self.gather(values), colors, trust)
        assert gathered is not None
        out = self.leave(values).float().view(batch, 2, -1, height, width)
        share = out[:, :, :-3].softmax(dim=2)
        local = torch.stack([near, near.flip(1), near.flip(-1), near.flip(1).flip(-1)], dim=2)
        mixed = (share[:, :, :LOCAL, None] * local).sum(dim=2)
        mixed = mixed + torch.einsum("bskhw,bkc->bschw", share[:, :, LOCAL:], gathered)
        completed: Tensor = mixed + RESIDUAL * torch.tanh(out[:, :, -3:])
        return completed

    def _gathered(self, logits: Tensor, colors: Tensor, trust: Tensor) -> Tensor:
        """The palette (B, K, 3): means of visible colors, weighted by attention."""
        batch = len(colors)
        share = functional.avg_pool2d(trust.flatten(0, 1), 2).view(batch, 2, 1, -1)
        value = functional.avg_pool2d((colors * trust).flatten(0, 1), 2).view(batch, 2, 3, -1)
        weight = logits.float().view(batch, 2, self.palette, -1)
        weight = torch.exp(weight.clamp(-12, 12)) * share
        total = weight.sum(dim=(1, 3)) + 1e-4
        mean = value / (share + 1e-4)
        gathered: Tensor = torch.einsum("bskn,bscn->bkc", weight, mean) / total[..., None]
        return gathered
