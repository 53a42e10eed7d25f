"""The networks of the pixel-aligned implicit surface: maps of the whole person, a coarse and a fine
field, and colors.

All take the photo in one square frame (see `a2v.reconstruction.implicit.inputs`) and points in
meters in the photo's camera axes. Three ideas meet here: pixel-aligned occupancy with a fine level
fed by normal maps (PIFuHD; Sec. 4.1 of the journal paper), colors at surface points (PIFu), and
conditioning on a fitted body, the *guide* (PaMIR, ICON). Fields are signed distances in meters,
negative inside: the occupancy of the papers is ``sigmoid(-distance / OCCUPANCY_WIDTH)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

PHOTO_CHANNELS = 4
"""Channels: red, green, blue (masked, zero at mid gray) and the mask."""
GUIDE_CHANNELS = 10
"""Normals of the guide's front (3) and back (3), depth of its front and back, its mask, and the
distance to the photo's mask."""
MAP_CHANNELS = 8
"""Normals of the person's front (3) and back (3), depth of the front and of the back."""
OCCUPANCY_WIDTH = 0.006
"""Distance, meters, over which the occupancy falls from 1/2 to 0.27."""


@dataclass(frozen=True)
class NetworkSettings:
    """Sizes of the networks.

    Attributes
    ----------
    widths : tuple of 4 int
        Channels at 128, 64, 32 and 16 px, for a photo of 512 px.
    hidden : int
        Width of the perceptrons.
    context : int
        Number of values that the coarse field passes to the fine one at a point.
    fine_width : int
        Channels of the fine encoder, at 256 px for a photo of 1024 px.
    """

    widths: tuple[int, int, int, int] = (48, 80, 128, 160)
    hidden: int = 128
    context: int = 32
    fine_width: int = 32


def _block(inputs: int, outputs: int, *, kernel: int = 3, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False),
        nn.BatchNorm2d(outputs),
        nn.LeakyReLU(0.1, inplace=True),
    )


class _Residual(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.first, self.second = _block(width, width), _block(width, width)

    def forward(self, values: Tensor) -> Tensor:
        """Apply the block; number of channels and size are unchanged."""
        changed: Tensor = values + self.second(self.first(values))
        return changed


class UNet(nn.Module):
    """An hourglass over maps at 128 px with skips; (B, inputs, H, W) -> (B, widths[0], H, W)."""

    def __init__(self, inputs: int, widths: tuple[int, ...]) -> None:
        super().__init__()
        self.stem = nn.Sequential(_block(inputs, widths[0], kernel=1), _Residual(widths[0]))
        self.down = nn.ModuleList(
            nn.Sequential(_block(above, below, stride=2), _Residual(below))
            for above, below in pairwise(widths)
        )
        self.merge = nn.ModuleList(
            nn.Sequential(_block(above + below, above, kernel=1), _Residual(above))
            for above, below in pairwise(widths)
        )

    def forward(self, values: Tensor) -> Tensor:
        """Return the context of the whole person at every pixel."""
        levels = [self.stem(values)]
        for down in self.down:
            levels.append(down(levels[-1]))
        result: Tensor = levels[-1]
        for level, merge in zip(reversed(levels[:-1]), reversed(self.merge), strict=True):
            larger = functional.interpolate(result, scale_factor=2.0, mode="nearest")
            result = merge(torch.cat([level, larger], dim=1))
        return result


def sample_map(values: Tensor, place: Tensor) -> Tensor:
    """Sample a map (B, C, H, W) bilinearly at `place` (B, N, 2) in [-1, 1], x right and y down;
    returns (B, N, C).

    Places outside get the value of the border.
    """
    sampled = functional.grid_sample(
        values.float(), place[:, None], mode="bilinear", padding_mode="border", align_corners=False
    )
    return sampled[:, :, 0].transpose(1, 2)


def unit_normals(maps: Tensor) -> Tensor:
    """Scale the two normals of maps (B, C >= 6, H, W), channels 0..2 and 3..5, to length 1."""
    front, back, rest = maps[:, :3], maps[:, 3:6], maps[:, 6:]
    return torch.cat(
        [
            functional.normalize(front, dim=1, eps=1e-4),
            functional.normalize(back, dim=1, eps=1e-4),
            rest,
        ],
        dim=1,
    )


class MapEncoder(nn.Module):
    """Network from the photo and the guide to the person's normals, depths and per-pixel features.

    ``forward(photo (B, 4, 512, 512), guide (B, 10, 256, 256))`` gives features (B, widths[0], 128,
    128) and maps (B, 8, 256, 256). The maps are corrections of the guide's.
    """

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        self.unet = UNet(16 * PHOTO_CHANNELS + 4 * GUIDE_CHANNELS, settings.widths)
        self.head = nn.Conv2d(settings.widths[0], 4 * MAP_CHANNELS, 1)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)  # type: ignore[arg-type]

    def forward(self, photo: Tensor, guide: Tensor) -> tuple[Tensor, Tensor]:
        """Features and maps."""
        features = self.unet(
            torch.cat(
                [functional.pixel_unshuffle(photo, 4), functional.pixel_unshuffle(guide, 2)], dim=1
            )
        )
        change = functional.pixel_shuffle(self.head(features), 2).float()
        return features, unit_normals(guide[:, :MAP_CHANNELS] + change)


def _perceptron(inputs: int, hidden: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(inputs, hidden),
        nn.LeakyReLU(0.1),
        nn.Linear(hidden, hidden),
        nn.LeakyReLU(0.1),
        nn.Linear(hidden, outputs),
    )


def _zero_last(perceptron: nn.Sequential) -> nn.Sequential:
    last = perceptron[-1]
    if isinstance(last, nn.Linear):
        nn.init.zeros_(last.weight)
        nn.init.zeros_(last.bias)
    return perceptron


POINT_CHANNELS = 15
"""Number of channels of `point_values`."""


def point_values(
    maps: Tensor,
    guide: Tensor,
    place: Tensor,
    depth: Tensor,
    guide_distance: Tensor,
    guide_normals: Tensor,
) -> Tensor:
    """Return the inputs of points without learned features (B, N, 15). Distances are in decimeters,
    so that all values are of order 1.

    Parameters
    ----------
    maps : (B, 8, H, W)
    guide : (B, 10, H, W)
    place : (B, N, 2)
        Places of the points in the frame, [-1, 1].
    depth : (B, N)
        z of the points, meters.
    guide_distance : (B, N)
        Signed distance to the guide, meters, negative inside.
    guide_normals : (B, N, 3)
        The guide's normal at its nearest point.
    """
    seen = sample_map(torch.cat([maps, guide[:, 8:]], dim=1), place)
    before, behind = depth - seen[..., 6], seen[..., 7] - depth
    distances = torch.stack([before, behind, guide_distance, seen[..., 9]], dim=-1) / 0.1
    return torch.cat(
        [seen[..., :6], seen[..., 8:9], distances.clamp(-3, 3), depth[..., None], guide_normals],
        dim=-1,
    )


class CoarseField(nn.Module):
    """Signed distance at points from the whole person's features (PIFuHD's coarse level).

    The result blends the guide's distance with that of the solid between the two depth maps inside
    the mask, and corrects it.
    """

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        self.context = settings.context
        self.trunk = _perceptron(
            settings.widths[0] + POINT_CHANNELS, settings.hidden, settings.context
        )
        self.head = nn.Linear(settings.context, 2)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)

    def forward(self, features: Tensor, values: Tensor, place: Tensor) -> tuple[Tensor, Tensor]:
        """Return distance (B, N) and context (B, N, settings.context) of points with `point_values`
        (B, N, 15) at `place` (B, N, 2)."""
        context = functional.leaky_relu(
            self.trunk(torch.cat([sample_map(features, place), values], dim=-1)), 0.1
        )
        share, change = self.head(context).float().unbind(-1)
        before, behind, guide, mask = values[..., 7:11].unbind(-1)
        slab = torch.maximum(torch.maximum(before, behind), mask)
        share = torch.sigmoid(share)
        return 0.1 * (share * guide + (1 - share) * slab + change), context


class FineEncoder(nn.Module):
    """Features of the photo at full resolution, fed by the normals (PIFuHD's fine level).

    ``forward(photo (B, 4, S, S), maps (B, 8, S / 4, S / 4))`` gives (B, fine_width / 4 + 6, S / 2,
    S / 2): features, then finer normals of front and back. Its receptive field is only 17 px, so
    that it can be trained on parts of the frame.
    """

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        width = settings.fine_width
        self.stem = _block(16 * PHOTO_CHANNELS + MAP_CHANNELS, width, kernel=1)
        self.body = nn.Sequential(_Residual(width), _Residual(width))
        self.features = nn.Conv2d(width, width, 1)
        self.normals = nn.Conv2d(width, 24, 1)
        nn.init.zeros_(self.normals.weight)
        nn.init.zeros_(self.normals.bias)  # type: ignore[arg-type]

    def forward(self, photo: Tensor, maps: Tensor) -> Tensor:
        """Features and finer normals."""
        values = self.body(
            self.stem(torch.cat([functional.pixel_unshuffle(photo, 4), maps], dim=1))
        )
        larger = functional.interpolate(
            maps[:, :6], scale_factor=2.0, mode="bilinear", align_corners=False
        )
        normals = unit_normals(larger + functional.pixel_shuffle(self.normals(values), 2).float())
        return torch.cat(
            [normals, functional.pixel_shuffle(self.features(values), 2).float()], dim=1
        )


class FineField(nn.Module):
    """Correction of the coarse distance by detail."""

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        inputs = settings.fine_width // 4 + 6 + settings.context + POINT_CHANNELS + 1
        self.trunk = _zero_last(_perceptron(inputs, settings.hidden // 2, 1))

    def forward(
        self, fine: Tensor, place: Tensor, coarse: Tensor, context: Tensor, values: Tensor
    ) -> Tensor:
        """Return the distance (B, N) from the coarse one (B, N), its context, and `FineEncoder`'s
        map at `place` (B, N, 2) of that map."""
        given = torch.cat(
            [sample_map(fine, place), context, values, coarse[..., None].clamp(-0.1, 0.1) / 0.02],
            dim=-1,
        )
        change: Tensor = self.trunk(given).float()[..., 0]
        return coarse + 0.01 * change


class Painter(nn.Module):
    """Colors of visible and unseen surface points (PIFu's second network).

    A color is a blend of the photo's at the same pixel and one that the network predicts.
    """

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        self.unet = UNet(16 * PHOTO_CHANNELS + 4 * (GUIDE_CHANNELS + MAP_CHANNELS), settings.widths)
        self.trunk = _zero_last(
            _perceptron(settings.widths[0] + POINT_CHANNELS + 3 + 4, settings.hidden, 4)
        )

    def features(self, photo: Tensor, guide: Tensor, maps: Tensor) -> Tensor:
        """Return features (B, widths[0], 128, 128) of the photo (B, 4, 512, 512), the guide and the
        maps (256 px)."""
        small = functional.pixel_unshuffle(torch.cat([guide, maps], dim=1), 2)
        result: Tensor = self.unet(torch.cat([functional.pixel_unshuffle(photo, 4), small], dim=1))
        return result

    def forward(
        self, features: Tensor, photo: Tensor, values: Tensor, normals: Tensor, place: Tensor
    ) -> Tensor:
        """Return colors (B, N, 3), sRGB in [0, 1], of surface points with `point_values`, normals
        (B, N, 3) at `place`."""
        seen = sample_map(photo, place)
        given = torch.cat([sample_map(features, place), values, normals, seen], dim=-1)
        result = self.trunk(given).float()
        share = torch.sigmoid(result[..., 3:])
        return share * (seen[..., :3] + 0.5) + (1 - share) * torch.sigmoid(result[..., :3])
