"""PaMIR (Zheng et al. 2021) from its checkpoints: PIFu's idea with a second source of features, the
volume of a posed SMPL body.

Implemented from the paper. Modules have the names of the published files (``pamir_net`` and
``pamir_tex_net``), some of which hold unused layers. `a2v.lab.papers.body_refinement` refines the
body by this field. Points (N, 3) lie in the cube [-.5, .5], x to the person's left, y up, z to the
camera, which is 10 in front of the center and has a focal length of 5000 pixels.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.errors import InputError
from a2v.lab.papers.checkpoints import State, channels, fill, numbers, part, read_state
from a2v.lab.papers.models import Part

PIXELS = 512
"""Side of the picture, pixels."""
VOXELS = 128
"""Side of the body's volume, voxels."""
DISTANCE = 10.0
"""Distance of PaMIR's camera, meters."""
FOCAL = 5000.0
"""Its focal length, pixels."""


class PamirGeometry(nn.Module):
    """``pamir_net``: features of the picture and of the body's volume, and the probability that
    points lie in the person."""

    def __init__(self, path: str | Path) -> None:
        super().__init__()
        state = read_state(path, inside="pamir_net")
        with torch.device("meta"):
            self.hg = _Hourglasses(part(state, "hg."))
            self.ve = _Volume(part(state, "ve."))
            self.mlp = _Points(part(state, "mlp."))
        _demand(path, self.mlp, self.hg.features + self.ve.features, 1)
        fill(self, state, str(path))

    def parts(self, pixels: int) -> Iterator[Part]:
        """Yield the parts: features of a picture and of a volume (1, 3, 128, 128, 128), and the
        probability that points lie in the person."""
        side = pixels // 4
        shapes = {"features": (self.hg.features, side, side), "volume": _volume_shape(self.ve)}
        yield Part("features", self.hg, {"image": (3, pixels, pixels)})
        yield Part("volume", self.ve, {"body": (self.ve.inputs, *3 * (VOXELS,))})
        yield Part("points", _Occupancy(self.mlp), {**shapes, "points": None})


class PamirTexture(nn.Module):
    """``pamir_tex_net``: colors of points, and the weight of the picture's own color; the
    geometry's features come last."""

    def __init__(self, path: str | Path) -> None:
        super().__init__()
        state = read_state(path, inside="pamir_tex_net")
        with torch.device("meta"):
            self.cg = _Encoder(part(state, "cg."))
            self.ve = _Volume(part(state, "ve."))
            self.mlp = _Points(part(state, "mlp."))
        _demand(path, self.mlp, self.mlp.inputs, 4)
        if self.mlp.inputs <= self.cg.features + self.ve.features:
            raise InputError(
                f"{path}: the layers for points take {self.mlp.inputs} inputs; "
                "expected more than the texture's own features"
            )
        fill(self, state, str(path))

    def parts(self, pixels: int) -> Iterator[Part]:
        """Yield the same parts, and sRGB colors (N, 3) in [0, 1] of points."""
        side = pixels // 4
        shapes = {
            "features": (self.mlp.inputs - self.ve.features, side, side),
            "volume": _volume_shape(self.ve),
        }
        yield Part("features", self.cg, {"image": (3, pixels, pixels)})
        yield Part("volume", self.ve, {"body": (self.ve.inputs, *3 * (VOXELS,))})
        yield Part(
            "points", _Colors(self.mlp), {**shapes, "image": (3, pixels, pixels), "points": None}
        )


def _volume_shape(network: _Volume) -> tuple[int, ...]:
    return (network.features, *3 * (VOXELS // 4,))


def _demand(path: str | Path, layers: _Points, inputs: int, outputs: int) -> None:
    if (layers.inputs, layers.outputs) != (inputs, outputs):
        raise InputError(
            f"{path}: the layers for points take {layers.inputs} inputs and have "
            f"{layers.outputs} outputs; expected {inputs} and {outputs}"
        )


class _Occupancy(nn.Module):
    """Probability (N,) that points lie in the person."""

    def __init__(self, layers: _Points) -> None:
        super().__init__()
        self.layers = layers

    def forward(self, features: Tensor, volume: Tensor, points: Tensor) -> Tensor:
        chance: Tensor = self.layers(_seen_at(features, volume, points))[0, 0, :, 0]
        return chance


class _Colors(nn.Module):
    """sRGB (N, 3): a weighted mean of the picture's color and a predicted one."""

    def __init__(self, layers: _Points) -> None:
        super().__init__()
        self.layers = layers

    def forward(self, features: Tensor, volume: Tensor, image: Tensor, points: Tensor) -> Tensor:
        found: Tensor = self.layers(_seen_at(features, volume, points))[0, :, :, 0].T
        seen = _in_picture(image, points)[0, :, :, 0].T
        return found[:, 3:] * seen + (1 - found[:, 3:]) * found[:, :3]


def _seen_at(features: Tensor, volume: Tensor, points: Tensor) -> Tensor:
    return torch.cat([_in_picture(features, points), in_volume(volume, points)], 1)


def _in_picture(features: Tensor, points: Tensor) -> Tensor:
    """Return the features (1, F, N, 1) of a map at the pixels of points (N, 3)."""
    places = (
        points[:, :2]
        * points.new_tensor([1.0, -1.0])
        * (FOCAL / (PIXELS / 2))
        / (DISTANCE - points[:, 2:])
    )
    return functional.grid_sample(
        features, places[None, :, None], mode="bilinear", padding_mode="border", align_corners=False
    )


def in_volume(volume: Tensor, points: Tensor) -> Tensor:
    """Sample a volume (1, F, D, H, W), with axes z, y and x, trilinearly at points (N, 3): features
    (1, F, N, 1).

    Points outside get the value of the border.
    """
    side = volume.shape[-1]
    cells = ((points + 0.5) * side - 0.5).clamp(0, side - 1)
    low = cells.floor().clamp(max=side - 2)
    share, first = cells - low, low.long()
    flat = volume.flatten(2)[0]
    found = torch.zeros_like(flat[:, :1])
    for corner in range(8):
        step = [corner >> axis & 1 for axis in range(3)]
        index = (
            ((first[:, 2] + step[2]) * side + first[:, 1] + step[1]) * side + first[:, 0] + step[0]
        )
        weights = [share[:, axis] if step[axis] else 1 - share[:, axis] for axis in range(3)]
        found = found + flat.index_select(1, index) * (weights[0] * weights[1] * weights[2])
    return found[None, :, :, None]


class _Points(nn.Module):
    """Five layers on the features of points. All but the first and the last get these features
    again, in front of the output of the previous layer."""

    def __init__(self, state: State) -> None:
        super().__init__()
        count = len(numbers(state, r"conv(\d+)\."))
        self.inputs, self.outputs = (
            channels(state, "conv0.0.weight", 1),
            channels(state, f"conv{count - 1}.0.weight", 0),
        )
        self.count = count
        for index in range(count):
            wide, given = (channels(state, f"conv{index}.0.weight", axis) for axis in (0, 1))
            end = nn.Sigmoid() if index == count - 1 else nn.LeakyReLU(0.2)
            self.add_module(f"conv{index}", nn.Sequential(nn.Conv2d(given, wide, 1), end))

    def forward(self, features: Tensor) -> Tensor:
        value: Tensor = self.get_submodule("conv0")(features)
        for index in range(1, self.count):
            value = self.get_submodule(f"conv{index}")(
                value if index == self.count - 1 else torch.cat([features, value], 1)
            )
        return value


class _Block(nn.Module):
    """Two convolutions after norms and rectifiers, added to the input."""

    def __init__(self, before: int, after: int) -> None:
        super().__init__()
        self.bn, self.conv1 = nn.GroupNorm(4, before), nn.Conv2d(before, after // 2, 3, padding=1)
        self.bn2, self.conv3 = (
            nn.GroupNorm(4, after // 2),
            nn.Conv2d(after // 2, after, 3, padding=1),
        )
        self.conv4 = nn.Conv2d(before, after, 1) if before != after else None

    def forward(self, value: Tensor) -> Tensor:
        out = self.conv3(functional.relu(self.bn2(self.conv1(functional.relu(self.bn(value))))))
        return out + (value if self.conv4 is None else self.conv4(value))  # type: ignore[no-any-return]


def _blocks(count: int, width: int) -> nn.Sequential:
    return nn.Sequential(*(_Block(width, width) for _ in range(count)))


class _Hourglass(nn.Module):
    """Blocks at half the size with the next hourglass inside, and blocks at the full size beside
    them."""

    def __init__(self, depth: int, count: int, width: int) -> None:
        super().__init__()
        self.up1_, self.low1_, self.low3_ = (_blocks(count, width) for _ in range(3))
        if depth > 1:
            self.low2: nn.Module = _Hourglass(depth - 1, count, width)
        else:
            self.low2_ = _blocks(count, width)
        self.depth = depth

    def forward(self, value: Tensor) -> Tensor:
        low = self.low1_(functional.max_pool2d(value, 2))
        low = self.low3_((self.low2 if self.depth > 1 else self.low2_)(low))
        around: Tensor = self.up1_(value)
        return around + functional.interpolate(
            low, scale_factor=2, mode="bilinear", align_corners=False
        )


class _Hourglasses(nn.Module):
    """Stacked hourglasses at a quarter of the picture's size; features of the last."""

    def __init__(self, state: State) -> None:
        super().__init__()
        stacks, count = (
            len(numbers(state, r"hourglass\.(\d+)\.")),
            len(numbers(state, r"hourglass\.0\.up1_\.(\d+)\.")),
        )
        if not stacks or not count:
            raise InputError(
                "the checkpoint has no 'hg.hourglass.0.up1_'; is it another network's?"
            )
        depth = max(name.count("low2.") for name in state) + 1
        width, self.features = (
            channels(state, "tmpOut.0.weight", 1),
            channels(state, "tmpOut.0.weight", 0),
        )
        self.count = count
        self.conv1_, self.bn1 = nn.Conv2d(3, 64, 7, stride=2, padding=3), nn.GroupNorm(4, 64)
        self.r1, self.r4, self.r5 = _Block(64, 128), _Block(128, 128), _Block(128, width)
        self.hourglass = nn.ModuleList(_Hourglass(depth, count, width) for _ in range(stacks))
        self.Residual = nn.ModuleList(_Block(width, width) for _ in range(stacks * count))
        self.lin_ = nn.ModuleList(
            nn.Sequential(nn.Conv2d(width, width, 1), nn.GroupNorm(4, width), nn.ReLU())
            for _ in range(stacks)
        )
        self.tmpOut = nn.ModuleList(nn.Conv2d(width, self.features, 1) for _ in range(stacks))
        self.ll_ = nn.ModuleList(nn.Conv2d(width, width, 1) for _ in range(stacks - 1))
        self.tmpOut_ = nn.ModuleList(nn.Conv2d(self.features, width, 1) for _ in range(stacks - 1))

    def forward(self, image: Tensor) -> Tensor:
        value = self.r1(functional.relu(self.bn1(self.conv1_(image))))
        value = self.r5(self.r4(functional.max_pool2d(value, 2)))
        for index, hourglass in enumerate(self.hourglass):
            out = hourglass(value)
            for block in self.Residual[index * self.count : (index + 1) * self.count]:
                out = block(out)
            out = self.lin_[index](out)
            features: Tensor = self.tmpOut[index](out)
            if index < len(self.ll_):
                value = value + self.ll_[index](out) + self.tmpOut_[index](features)
        return features


class _Wide(nn.Module):
    """Two convolutions with norms, added to the input. The file also has an unused norm and a third
    convolution."""

    def __init__(
        self, width: int, groups: int, kind: type[nn.Conv2d] | type[nn.Conv3d], dilation: int
    ) -> None:
        super().__init__()
        self.bn = nn.GroupNorm(groups, width)
        self.conv1, self.bn1 = (
            kind(width, width, 3, padding=dilation, dilation=dilation),
            nn.GroupNorm(groups, width),
        )
        self.conv2, self.bn2 = kind(width, width, 3, padding=1), nn.GroupNorm(groups, width)
        self.conv3 = kind(width, width, 3, padding=1)

    def forward(self, value: Tensor) -> Tensor:
        out: Tensor = value + self.bn2(self.conv2(functional.relu(self.bn1(self.conv1(value)))))
        return out


class _Volume(nn.Module):
    """Features at a quarter of a volume's size."""

    def __init__(self, state: State) -> None:
        super().__init__()
        self.inputs, inner = channels(state, "conv1.weight", 1), channels(state, "conv1.weight", 0)
        self.features = channels(state, "conv2.weight", 0)
        self.conv1, self.bn1 = (
            nn.Conv3d(self.inputs, inner, 5, stride=2, padding=4, dilation=2),
            nn.GroupNorm(4, inner),
        )
        self.conv2, self.bn2 = (
            nn.Conv3d(inner, self.features, 5, stride=2, padding=4, dilation=2),
            nn.GroupNorm(4, self.features),
        )
        self.r1, self.r2, self.r3 = (_Wide(self.features, 4, nn.Conv3d, 2) for _ in range(3))
        self.conv_out1, self.conv_out2 = (
            nn.Conv3d(self.features, self.features, 3, padding=1) for _ in range(2)
        )  # for training only

    def forward(self, body: Tensor) -> Tensor:
        value = functional.relu(self.bn2(self.conv2(functional.relu(self.bn1(self.conv1(body))))))
        out: Tensor = self.r3(self.r2(self.r1(value)))
        return out


class _Encoder(nn.Module):
    """Features of a picture at a quarter of its size; the first convolution pads by the picture's
    opposite border."""

    def __init__(self, state: State) -> None:
        super().__init__()
        widths = [channels(state, f"conv{index}.weight", 0) for index in (1, 2, 3)]
        self.features = widths[-1]
        self.conv1 = nn.Conv2d(3, widths[0], 7, padding=3, padding_mode="circular")
        self.conv2, self.conv3 = (
            nn.Conv2d(near, far, 3, stride=2, padding=1) for near, far in itertools.pairwise(widths)
        )
        self.bn1, self.bn2, self.bn3 = (nn.GroupNorm(32, width) for width in widths)
        self.r1, self.r2, self.r3, self.r4, self.r5, self.r6 = (
            _Wide(self.features, 32, nn.Conv2d, 1) for _ in range(6)
        )

    def forward(self, image: Tensor) -> Tensor:
        value = functional.relu(self.bn1(self.conv1(image)))
        value = functional.relu(self.bn2(self.conv2(value)))
        value = functional.relu(self.bn3(self.conv3(value)))
        out: Tensor = self.r6(self.r5(self.r4(self.r3(self.r2(self.r1(value))))))
        return out
