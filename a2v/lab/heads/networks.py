"""The network that completes heads: an hourglass over the head chart, whose azimuth goes around."""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.reconstruction.coloring.completing import CHANNELS, OUTPUTS


class _Around(nn.Module):
    """A convolution of 3x3 that goes around in the azimuth and repeats the first and last row."""

    def __init__(self, inputs: int, outputs: int, stride: int = 1) -> None:
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, 3, stride, bias=False)
        self.norm = nn.BatchNorm2d(outputs)

    def forward(self, values: Tensor) -> Tensor:
        values = torch.cat([values[..., -1:], values, values[..., :1]], dim=-1)
        values = torch.cat([values[..., :1, :], values, values[..., -1:, :]], dim=-2)
        found: Tensor = functional.leaky_relu(self.norm(self.conv(values)), 0.1)
        return found


class HeadCompleter(nn.Module):
    """``forward(chart (B, CHANNELS, H, W))`` gives (B, OUTPUTS, H, W): colors, logits of cover and
    keeps, offset in `OFFSET`.

    Colors are differences from the mean colors of what the photo shows of skin and of what covers
    it. The network chooses their cells, so that it carries colors that it has never seen.
    """

    def __init__(self, widths: tuple[int, ...] = (32, 48, 72, 96)) -> None:
        super().__init__()
        self.stem = nn.Sequential(_Around(4 * CHANNELS, widths[0]), _Around(widths[0], widths[0]))
        self.down = nn.ModuleList(
            nn.Sequential(_Around(above, below, 2), _Around(below, below), _Around(below, below))
            for above, below in pairwise(widths)
        )
        self.merge = nn.ModuleList(
            nn.Sequential(_Around(above + below, above), _Around(above, above))
            for above, below in pairwise(widths)
        )
        self.head = nn.Conv2d(widths[0], 4 * (OUTPUTS + 2), 1)
        nn.init.normal_(self.head.weight, std=0.01)

    def forward(self, chart: Tensor) -> Tensor:
        """Complete a chart."""
        levels = [self.stem(functional.pixel_unshuffle(chart, 2))]
        for down in self.down:
            levels.append(down(levels[-1]))
        result: Tensor = levels[-1]
        for level, merge in zip(reversed(levels[:-1]), reversed(self.merge), strict=True):
            larger = functional.interpolate(result, scale_factor=2.0, mode="nearest")
            result = merge(torch.cat([level, larger], dim=1))
        found = functional.pixel_shuffle(self.head(result), 2)
        seen, trust = chart[:, :3] + 0.5 * chart[:, 3:4], chart[:, 3:4]
        covers, skins = (
            _pooled(seen, trust, torch.sigmoid(found[:, number : number + 1]))
            for number in (OUTPUTS, OUTPUTS + 1)
        )
        cover = torch.sigmoid(found[:, 6:7])
        skin = skins + found[:, 3:6]
        outer = cover * covers + (1 - cover) * skin + found[:, :3]
        return torch.cat([outer, skin, found[:, 6:OUTPUTS]], dim=1)


def _pooled(seen: Tensor, trust: Tensor, chosen: Tensor) -> Tensor:
    """Mean color (B, 3, 1, 1) of the `chosen` (B, 1, H, W) cells of `seen` (B, 3, H, W), which are
    colors times `trust` (B, 1, H, W)."""
    total = (seen * chosen).sum(dim=(2, 3), keepdim=True) + 0.05
    weight = (trust * chosen).sum(dim=(2, 3), keepdim=True) + 0.1
    return total / weight
