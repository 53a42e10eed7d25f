"""The network of the body map: BlazePose's layers, maps at 64 pixels, and landmarks by integral
regression with attention among them.

A picture (B, 4, 256, 256) is a square around a person, RGB and mask in [0, 1]. All lengths are
fractions of the square's side: u right, v down from its upper left corner, depth towards the camera
from the middle of the hips.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.kinematics.names import BLAZEPOSE
from a2v.lab.bodymap.blazepose import LANDMARKS, BlazePoseLayers
from a2v.perception.depth import HIPS

SIDE = 256
"""Side of the picture, pixels."""
MAP_SIDE = 64
"""Side of the maps, pixels."""
MAPS = (
    "place_x",
    "place_y",
    "place_z",
    "front",
    "back",
    "log_front",
    "log_back",
    "log_place",
    "inside",
)
"""Channels of the maps: the place on the body (`a2v.body.places`), depth of front and back; natural
logarithms of the Laplace scales of front, back and place; the logit of the silhouette."""
TAPS = (279, 277, 251, 269, 316)
"""Tensors of BlazePose's file at strides 4, 8, 16, 32 and 64."""
CHANNELS = (48, 48, 88, 144, 288)
"""Their channels."""
EDGES = 222
"""Number of the tensor up to which BlazePose's weights are frozen."""
WIDTH = 96
"""Channels at strides 8 to 64."""
TOP = 64
"""Channels at stride 4."""
TOKEN = 128
"""Channels of a landmark's token."""
_OWN_SCALE = (1 / SIDE, 1 / SIDE, 1 / SIDE, 0.1, 0.1)
_OWN_DEPTH = -0.186
"""Factor from BlazePose's depth (away from the camera) to depth toward the camera, fitted by least
squares to quick views of held-out people."""


@dataclass(frozen=True, eq=False)
class BodyMaps:
    """Outputs of the network for B pictures.

    Attributes
    ----------
    points : (B, 33, 3)
        BlazePose's landmarks: u, v, depth.
    first : (B, 33, 3)
        Landmarks from the heat maps. `points` is an interpolation between these and BlazePose's
        own, plus a correction.
    log_scales : (B, 33, 2)
        Natural logarithms of the Laplace scales in the picture and in depth.
    maps : (B, 9, 64, 64)
        See `MAPS`.
    """

    points: Tensor
    first: Tensor
    log_scales: Tensor
    maps: Tensor


@dataclass(frozen=True, eq=False)
class Seen:
    """Outputs of the per-pixel part: features (B, 64, 64, 64), `maps`, heat and depth (B, 66, 64,
    64) of the landmarks, features (B, 288) of the whole picture, and BlazePose's own landmarks
    (B, 33, 5)."""

    pixels: Tensor
    maps: Tensor
    marks: Tensor
    whole: Tensor
    own: Tensor

    def float(self) -> Seen:
        """Return all tensors in float32."""
        return Seen(
            self.pixels.float(),
            self.maps.float(),
            self.marks.float(),
            self.whole.float(),
            self.own.float(),
        )


def _convolution(inputs: int, outputs: int, kernel: int = 3, groups: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, kernel, 1, kernel // 2, groups=groups, bias=False),
        nn.BatchNorm2d(outputs),
    )


class _Mixer(nn.Module):
    """A residual block: a depthwise convolution of each channel, then a mix of the channels."""

    def __init__(self, width: int, kernel: int = 5) -> None:
        super().__init__()
        self.change = nn.Sequential(
            _convolution(width, width, kernel, groups=width),
            _convolution(width, 2 * width, 1),
            nn.ReLU(True),
            _convolution(2 * width, width, 1),
        )

    def forward(self, values: Tensor) -> Tensor:
        """Apply the block; number of channels and size are unchanged."""
        changed: Tensor = values + self.change(values)
        return changed


class Backbone(nn.Module):
    """BlazePose's features at `TAPS` and its own landmarks. It does not use the mask."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = BlazePoseLayers((*TAPS, LANDMARKS))
        self.layers.freeze_until(EDGES)

    def forward(self, picture: Tensor) -> tuple[list[Tensor], Tensor]:
        """Return features (B, C, H, W) from fine to coarse, and landmarks (B, 33, 5), lengths in
        sides of the picture."""
        *features, own = self.layers(picture[:, :3])
        return features, own[:, : 5 * len(BLAZEPOSE)].reshape(
            -1, len(BLAZEPOSE), 5
        ) * own.new_tensor(_OWN_SCALE)


class BodyMapNetwork(nn.Module):
    """The network of the module. The mask is added after BlazePose's features, because BlazePose
    was trained without masks."""

    grid: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.backbone = Backbone()
        self.veil, self.veil16 = nn.Conv2d(1, TOP, 5, 1, 2), nn.Conv2d(1, WIDTH, 3, 1, 1)
        self.narrow = nn.Conv2d(WIDTH, TOP, 1)
        self.lateral = nn.ModuleList(
            nn.Conv2d(channels, WIDTH if level else TOP, 1)
            for level, channels in enumerate(CHANNELS)
        )
        self.deep = nn.Sequential(_Mixer(WIDTH), _Mixer(WIDTH))
        self.mid = nn.ModuleList(
            nn.Sequential(_convolution(WIDTH, WIDTH), nn.ReLU(True)) for _ in CHANNELS[1:-1]
        )
        self.mid32 = nn.Sequential(_Mixer(WIDTH), _Mixer(WIDTH), _Mixer(WIDTH))
        self.top = _Mixer(TOP, 3)
        self.maps = nn.Conv2d(TOP, len(MAPS), 1)
        count = len(BLAZEPOSE)
        self.marks = nn.Conv2d(TOP, 2 * count, 1)  # heat and depth of each landmark
        self.embed, self.whole, self.own = (
            nn.Linear(TOP + 6, TOKEN),
            nn.Linear(CHANNELS[-1], TOKEN),
            nn.Linear(5, TOKEN),
        )
        self.name = nn.Parameter(0.02 * torch.randn(count, TOKEN))
        layer = nn.TransformerEncoderLayer(
            TOKEN, 4, 2 * TOKEN, dropout=0.0, batch_first=True, norm_first=True, activation="gelu"
        )
        self.attend = nn.TransformerEncoder(layer, 3, enable_nested_tensor=False)
        # a correction, two scales, and the weights of the heat maps against BlazePose's landmarks,
        # in the picture and in depth
        self.out = nn.Linear(TOKEN, 7)
        nn.init.zeros_(self.out.weight)
        with torch.no_grad():
            self.out.bias.copy_(torch.tensor([0.0, 0.0, 0.0, 0.0, 0.0, -2.0, -2.0]))
        middle = (torch.arange(MAP_SIDE) + 0.5) / MAP_SIDE
        across, down = torch.meshgrid(middle, middle, indexing="xy")
        self.register_buffer(
            "grid", torch.stack([across, down], dim=-1).reshape(-1, 2).contiguous()
        )

    def look(self, picture: Tensor) -> Seen:
        """Run the per-pixel part on pictures (B, 4, 256, 256); it may run in half precision."""
        seen, own = self.backbone(picture)
        levels = [lateral(level) for lateral, level in zip(self.lateral, seen, strict=True)]
        mask = functional.avg_pool2d(picture[:, 3:], SIDE // MAP_SIDE)
        values: Tensor = self.deep(levels[-1])
        for level in range(len(levels) - 2, 0, -1):
            values = (
                functional.interpolate(values, scale_factor=2.0, mode="nearest") + levels[level]
            )
            if level == 2:
                values = values + self.veil16(functional.avg_pool2d(mask, 4))
            values = self.mid[level - 1](values)
        values = self.narrow(self.mid32(values))
        values = (
            functional.interpolate(values, scale_factor=2.0, mode="bilinear", align_corners=False)
            + levels[0]
            + self.veil(mask)
        )
        pixels = self.top(values)
        return Seen(pixels, self.maps(pixels), self.marks(pixels), seen[-1].mean(dim=(2, 3)), own)

    def conclude(self, seen: Seen) -> BodyMaps:
        """Compute landmarks from the heat maps and BlazePose's own, with attention among them."""
        count = len(BLAZEPOSE)
        marks = seen.marks.flatten(2)
        heat, depth = marks[:, :count], marks[:, count:]
        heat = heat.softmax(dim=-1)  # integral regression, Sun et al. 2018, Eq. 1
        first = torch.cat([heat @ self.grid, (heat * depth).sum(dim=-1, keepdim=True)], dim=-1)
        around = heat @ seen.pixels.flatten(2).transpose(1, 2)
        start = _start(seen.own)
        context = torch.cat([around, 4 * first.detach(), 4 * (start - first).detach()], dim=-1)
        token = (
            self.embed(context) + self.name + self.whole(seen.whole)[:, None] + self.own(seen.own)
        )
        change = self.out(self.attend(token))
        gate = torch.cat([change[..., 5:6], change[..., 5:]], dim=-1).sigmoid()
        return BodyMaps(
            points=start + gate * (first - start) + 0.25 * change[..., :3],
            first=first,
            log_scales=change[..., 3:5].clamp(-3, 4) - 3.5,
            maps=seen.maps,
        )

    def forward(self, picture: Tensor) -> BodyMaps:
        """Return maps and landmarks of pictures (B, 4, 256, 256)."""
        return self.conclude(self.look(picture))


def _start(own: Tensor) -> Tensor:
    """Convert BlazePose's own landmarks (B, 33, 5) to the form of `BodyMaps.points`."""
    depth = _OWN_DEPTH * own[..., 2:3]
    hips = (depth[:, HIPS[0], None] + depth[:, HIPS[1], None]) / 2
    return torch.cat([own[..., :2], depth - hips], dim=-1)
