"""The networks of PIFu (Saito et al. 2019) and PIFuHD (Saito et al. 2020), with the names of their
checkpoints.

Widths and depths are taken from the checkpoint's own shapes. Images are (1, C, S, S) with values in
[-1, 1].
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.errors import InputError
from a2v.lab.papers.checkpoints import State, channels, numbers

GROUPS = 32


class ConvBlock(nn.Module):
    """Three 3 x 3 convolutions, each after group norm and rectifier; their concatenated outputs are
    added to the input (Newell et al. 2016)."""

    def __init__(self, before: int, after: int) -> None:
        super().__init__()
        half, quarter = after // 2, after // 4
        for index, (inputs, outputs) in enumerate(
            ((before, half), (half, quarter), (quarter, quarter)), 1
        ):
            setattr(self, f"bn{index}", nn.GroupNorm(GROUPS, inputs))
            setattr(self, f"conv{index}", nn.Conv2d(inputs, outputs, 3, padding=1, bias=False))
        self.bn4 = nn.GroupNorm(GROUPS, before)
        # the checkpoints name the norm of the shortcut twice
        self.downsample = (
            nn.Sequential(self.bn4, nn.ReLU(), nn.Conv2d(before, after, 1, bias=False))
            if before != after
            else None
        )

    def forward(self, image: Tensor) -> Tensor:
        """Map (1, before, H, W) to (1, after, H, W)."""
        parts, value = [], image
        for index in (1, 2, 3):
            value = getattr(self, f"conv{index}")(
                functional.relu(getattr(self, f"bn{index}")(value))
            )
            parts.append(value)
        return torch.cat(parts, 1) + (image if self.downsample is None else self.downsample(image))


class Hourglass(nn.Module):
    """Blocks at decreasing sizes, each added to the result of the next coarser one."""

    def __init__(self, depth: int, width: int) -> None:
        super().__init__()
        self.depth = depth
        for level in range(1, depth + 1):
            for name in ("b1", "b2", "b3") + (("b2_plus",) if level == 1 else ()):
                self.add_module(f"{name}_{level}", ConvBlock(width, width))

    def forward(self, image: Tensor) -> Tensor:
        """Map (1, width, H, W), whose size is a multiple of 2 to the power of `depth`, to the same
        shape."""
        return self._level(image, self.depth)

    def _level(self, image: Tensor, level: int) -> Tensor:
        low = self.get_submodule(f"b2_{level}")(functional.avg_pool2d(image, 2))
        low = self._level(low, level - 1) if level > 1 else self.get_submodule("b2_plus_1")(low)
        low = self.get_submodule(f"b3_{level}")(low)
        around: Tensor = self.get_submodule(f"b1_{level}")(image)
        return around + functional.interpolate(
            low, scale_factor=2, mode="bicubic", align_corners=True
        )


class HourglassFilter(nn.Module):
    """Stacked hourglasses: features of a picture at a quarter of its size, or at half of it without
    `pool` (PIFuHD's fine level)."""

    def __init__(self, state: State, *, pool: bool) -> None:
        super().__init__()
        stacks, depth = len(numbers(state, r"m(\d+)\.")), len(numbers(state, r"m0\.b1_(\d+)\."))
        if not stacks or not depth:
            raise InputError(
                "the checkpoint's picture filter has no hourglass 'm0'; is it another network's?"
            )
        first, second, width = (
            channels(state, f"{name}.weight", 0)
            for name in ("conv1", "conv2.downsample.2", "conv4.downsample.2")
        )
        self.stacks, self.pool, self.features = stacks, pool, channels(state, "l0.weight", 0)
        self.conv1 = nn.Conv2d(channels(state, "conv1.weight", 1), first, 7, stride=2, padding=3)
        self.bn1 = nn.GroupNorm(GROUPS, first)
        self.conv2, self.conv3, self.conv4 = (
            ConvBlock(first, second),
            ConvBlock(second, second),
            ConvBlock(second, width),
        )
        for index in range(stacks):
            self.add_module(f"m{index}", Hourglass(depth, width))
            self.add_module(f"top_m_{index}", ConvBlock(width, width))
            self.add_module(f"conv_last{index}", nn.Conv2d(width, width, 1))
            self.add_module(f"bn_end{index}", nn.GroupNorm(GROUPS, width))
            self.add_module(f"l{index}", nn.Conv2d(width, self.features, 1))
            if index < stacks - 1:
                self.add_module(f"bl{index}", nn.Conv2d(width, width, 1))
                self.add_module(f"al{index}", nn.Conv2d(self.features, width, 1))

    def forward(self, image: Tensor) -> Tensor:
        """Return features (1, F, S / 4, S / 4), or S / 2 without `pool`, of the last hourglass."""
        value = self.conv2(functional.relu(self.bn1(self.conv1(image))))
        value = self.conv4(self.conv3(functional.avg_pool2d(value, 2) if self.pool else value))
        for index in range(self.stacks):
            top = getattr(self, f"top_m_{index}")(getattr(self, f"m{index}")(value))
            top = functional.relu(
                getattr(self, f"bn_end{index}")(getattr(self, f"conv_last{index}")(top))
            )
            features: Tensor = getattr(self, f"l{index}")(top)
            if index < self.stacks - 1:
                value = (
                    value + getattr(self, f"bl{index}")(top) + getattr(self, f"al{index}")(features)
                )
        return features


class PointNetwork(nn.Module):
    """Linear layers on the features of points; some get the first input again.

    PIFu's are called ``conv0..``, PIFuHD's ``filters.0..`` and ``norms.0..``; the layers that get
    the input again are recognized by their widths.
    """

    def __init__(self, state: State) -> None:
        super().__init__()
        self.style = "conv" if "conv0.weight" in state else "filters."
        count = len(numbers(state, rf"{self.style}(\d+)\.".replace("filters.", r"filters\.")))
        inputs = [channels(state, f"{self.style}{index}.weight", 1) for index in range(count)]
        outputs = [channels(state, f"{self.style}{index}.weight", 0) for index in range(count)]
        self.again = [
            index > 0 and inputs[index] == outputs[index - 1] + inputs[0] for index in range(count)
        ]
        if count < 2 or any(
            inputs[i] != outputs[i - 1] + self.again[i] * inputs[0] for i in range(1, count)
        ):
            raise InputError(
                f"the checkpoint's layers for points are {inputs} to {outputs} wide; "
                "expected the inputs of each to be the outputs of the previous one"
            )
        self.inputs, self.outputs = inputs[0], outputs
        layers = [
            nn.Conv1d(before, after, 1) for before, after in zip(inputs, outputs, strict=True)
        ]
        if self.style == "conv":
            for index, layer in enumerate(layers):
                self.add_module(f"conv{index}", layer)
        else:
            self.filters = nn.ModuleList(layers)
            self.norms = nn.ModuleList(
                [
                    nn.GroupNorm(GROUPS, outputs[index])
                    for index in numbers(state, r"norms\.(\d+)\.")
                ]
            )

    def forward(self, features: Tensor, keep: int = -1) -> tuple[Tensor, Tensor]:
        """Return outputs (1, C, N) before the last non-linearity for features (1, D, N), and the
        output of layer `keep`."""
        value, kept = features, features
        for index in range(len(self.outputs)):
            layer = getattr(self, f"conv{index}") if self.style == "conv" else self.filters[index]
            value = layer(torch.cat([value, features], 1) if self.again[index] else value)
            if index < len(self.outputs) - 1:
                if self.style != "conv" and index < len(self.norms):
                    value = self.norms[index](value)
                value = functional.leaky_relu(value)
            if index == keep:
                kept = value
        return value, kept


class _Residual(nn.Module):
    """Two 3 x 3 convolutions on reflected borders, added to the input."""

    def __init__(
        self, width: int, norm: Callable[[int], nn.Module], *, bias: bool, last: bool
    ) -> None:
        super().__init__()
        parts: list[nn.Module] = [
            nn.ReflectionPad2d(1),
            nn.Conv2d(width, width, 3, bias=bias),
            norm(width),
            nn.ReLU(),
        ]
        parts += [nn.ReflectionPad2d(1), nn.Conv2d(width, width, 3, bias=bias)] + (
            [] if last else [norm(width)]
        )
        self.conv_block = nn.Sequential(*parts)

    def forward(self, image: Tensor) -> Tensor:
        out: Tensor = image + self.conv_block(image)
        return out


class ResidualNetwork(nn.Module):
    """Convolutions that halve the picture, residual blocks, and, in PIFuHD's networks of normals,
    convolutions that double it again."""

    def __init__(self, state: State) -> None:
        super().__init__()
        blocks, all_of = (
            numbers(state, r"model\.(\d+)\.conv_block"),
            numbers(state, r"model\.(\d+)\."),
        )
        if not blocks:
            raise InputError(
                "the checkpoint's residual network has no block 'conv_block'; is it "
                "another network's?"
            )
        learned, bias = "model.2.weight" in state, "model.1.bias" in state

        def norm(width: int) -> nn.Module:
            return nn.GroupNorm(GROUPS, width) if learned else nn.InstanceNorm2d(width)

        width = channels(state, "model.1.weight", 0)
        parts: list[nn.Module] = [
            nn.ReflectionPad2d(3),
            nn.Conv2d(channels(state, "model.1.weight", 1), width, 7, bias=bias),
            norm(width),
            nn.ReLU(),
        ]
        while len(parts) < blocks[0]:
            parts += [
                nn.Conv2d(width, 2 * width, 3, stride=2, padding=1, bias=bias),
                norm(2 * width),
                nn.ReLU(),
            ]
            width *= 2
        doubled = all_of[-1] > blocks[-1]
        parts += [
            _Residual(width, norm, bias=bias, last=not doubled and index == blocks[-1])
            for index in blocks
        ]
        if doubled:
            while len(parts) < all_of[-1] - 1:
                up = nn.ConvTranspose2d(
                    width, width // 2, 3, stride=2, padding=1, output_padding=1, bias=bias
                )
                parts += [up, norm(width // 2), nn.ReLU()]
                width //= 2
            parts += [
                nn.ReflectionPad2d(3),
                nn.Conv2d(width, channels(state, f"model.{all_of[-1]}.weight", 0), 7),
                nn.Tanh(),
            ]
        self.model = nn.Sequential(*parts)
        self.features = channels(state, f"model.{all_of[-1]}.weight", 0) if doubled else width

    def forward(self, image: Tensor) -> Tensor:
        """Map (1, C, S, S) to features at a quarter of the size, or to a picture of the same
        size."""
        out: Tensor = self.model(image)
        return out


def at_points(features: Tensor, places: Tensor) -> Tensor:
    """Sample a map (1, F, H, W) at places (N, 2) in [-1, 1], x to the right, y down: features (1,
    F, N).

    -1 and 1 are the centers of the outermost pixels.
    """
    sampled: Tensor = functional.grid_sample(
        features, places[None, :, None], mode="bilinear", padding_mode="zeros", align_corners=True
    )
    return sampled.squeeze(-1)
