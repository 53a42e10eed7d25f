"""Liquid Warping GAN (Liu et al. 2019) with the user's copy of the generator, on our
correspondences instead of a CUDA renderer.

It is implemented from the paper. Tensors have the names of the published file,
``net_epoch_30_id_G.pth``, whose weights may only be used for research and are not shipped. Pictures
are (1, 3, S, S) in [-1, 1].
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.errors import InputError
from a2v.lab.papers.checkpoints import State, channels, fill, numbers, part, read_state

PIXELS = 256
"""Side of the pictures that the published weights were trained on."""
CONDITION = 3
"""Number of channels that describe the body: its texture coordinates, and 1 outside of it."""


class Generator(nn.Module):
    """Three networks: one fills the background, one encodes the photo, and one draws the moved
    person with features of the second.

    At each size of features, those of the photo are warped to the same points of the moved body,
    and added.

    Raises
    ------
    InputError
        The file is missing or holds another network.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__()
        state = read_state(path)
        with torch.device("meta"):
            self.bg_model = _Background(part(state, "bg_model."))
            self.src_model = _Stream(part(state, "src_model."))
            self.tsf_model = _Stream(part(state, "tsf_model."))
        given = [self.bg_model.inputs, self.src_model.inputs, self.tsf_model.inputs]
        if given != [4, 3 + CONDITION, 3 + CONDITION]:
            raise InputError(
                f"{path}: the networks take {given} channels; expected [4, 6, 6], a "
                "picture and texture coordinates"
            )
        fill(self, state, str(path))

    def background(self, picture: Tensor, person: Tensor) -> Tensor:
        """Return the background behind the person; `person` (1, 1, S, S) is 1 on the person."""
        around = 1 - person
        out: Tensor = self.bg_model(torch.cat([picture * around, around], 1))
        return out

    def read(self, picture: Tensor, condition: Tensor) -> list[Tensor]:
        """Return features of the person on an empty background with the body's `condition` (1, 3,
        S, S), from fine to coarse, then block by block."""
        return list(self.src_model.read(torch.cat([picture, condition], 1)))

    def draw(
        self, features: Sequence[Tensor], picture: Tensor, condition: Tensor, places: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Draw the moved person, and the visible fraction of the background (1, 1, S, S).

        Parameters
        ----------
        features : tensors
            Features of `read`.
        picture, condition
            The photo's pixels warped to the moved body, and the condition of that body.
        places : (1, S, S, 2)
            Place in the photo, [-1, 1], of each pixel's point of the body; outside of this range if
            there is no body.
        """
        warped = [_warped(value, places) for value in features]
        return self.tsf_model.draw(
            list(self.tsf_model.read(torch.cat([picture, condition], 1), warped))
        )


def _warped(features: Tensor, places: Tensor) -> Tensor:
    grid = functional.interpolate(
        places.permute(0, 3, 1, 2), size=features.shape[2:], mode="bilinear", align_corners=True
    )
    return functional.grid_sample(
        features,
        grid.permute(0, 2, 3, 1),
        mode="bilinear",
        padding_mode="zeros",
        align_corners=True,
    )


class _Normed(nn.Sequential):
    """A convolution without bias, instance normalization, a rectifier."""

    def __init__(self, convolution: nn.Module, width: int) -> None:
        super().__init__(convolution, nn.InstanceNorm2d(width, affine=True), nn.ReLU())


def _first(before: int, after: int) -> nn.Module:
    return nn.Conv2d(before, after, 7, padding=3, bias=False)


def _halved(before: int, after: int) -> nn.Module:
    return nn.Conv2d(before, after, 3, stride=2, padding=1, bias=False)


def _doubled(before: int, after: int) -> nn.Module:
    return nn.ConvTranspose2d(before, after, 3, stride=2, padding=1, output_padding=1, bias=False)


class _Block(nn.Module):
    """Two convolutions with norms, added to the input."""

    def __init__(self, width: int) -> None:
        super().__init__()
        first = _Normed(nn.Conv2d(width, width, 3, padding=1, bias=False), width)
        self.main = nn.Sequential(
            *first,
            nn.Conv2d(width, width, 3, padding=1, bias=False),
            nn.InstanceNorm2d(width, affine=True),
        )

    def forward(self, value: Tensor) -> Tensor:
        out: Tensor = value + self.main(value)
        return out


class _Background(nn.Module):
    """Convolutions that halve the picture, residual blocks, and convolutions that double it
    again."""

    def __init__(self, state: State) -> None:
        super().__init__()
        blocks = numbers(state, r"model\.(\d+)\.main")
        if not blocks:
            raise InputError(
                "the checkpoint lacks 'bg_model.model.N.main'; is it another network's?"
            )
        width, self.inputs = (
            channels(state, "model.0.weight", 0),
            channels(state, "model.0.weight", 1),
        )
        layers = [*_Normed(_first(self.inputs, width), width)]
        halvings = (blocks[0] - 3) // 3
        for _ in range(halvings):
            layers += [*_Normed(_halved(width, 2 * width), 2 * width)]
            width *= 2
        layers += [_Block(width) for _ in blocks]
        for _ in range(halvings):
            layers += [*_Normed(_doubled(width, width // 2), width // 2)]
            width //= 2
        self.model = nn.Sequential(
            *layers, nn.Conv2d(width, 3, 7, padding=3, bias=False), nn.Tanh()
        )

    def forward(self, value: Tensor) -> Tensor:
        out: Tensor = self.model(value)
        return out


class _Stream(nn.Module):
    """The same with skip connections from each size on the way down to the way up, and two outputs:
    a picture, and the fraction of the background."""

    def __init__(self, state: State) -> None:
        super().__init__()
        depth, blocks = (
            len(numbers(state, r"encoders\.(\d+)\.")) - 1,
            numbers(state, r"resnets\.(\d+)\."),
        )
        width, self.inputs = (
            channels(state, "encoders.0.0.weight", 0),
            channels(state, "encoders.0.0.weight", 1),
        )
        widths = [width * 2**level for level in range(depth + 1)]
        self.encoders = nn.Sequential(
            _Normed(_first(self.inputs, width), width),
            *(_Normed(_halved(near, 2 * near), 2 * near) for near in widths[:-1]),
        )
        self.resnets = nn.Sequential(*(_Block(widths[-1]) for _ in blocks))
        back = widths[:0:-1]
        self.decoders = nn.Sequential(
            *(_Normed(_doubled(near, near // 2), near // 2) for near in back)
        )
        self.skippers = nn.Sequential(
            *(
                _Normed(nn.Conv2d(near, near // 2, 3, padding=1, bias=False), near // 2)
                for near in back
            )
        )
        self.img_reg = nn.Sequential(nn.Conv2d(width, 3, 7, padding=3, bias=False), nn.Tanh())
        # spelled like this in the file
        self.attetion_reg = nn.Sequential(
            nn.Conv2d(width, 1, 7, padding=3, bias=False), nn.Sigmoid()
        )

    def read(self, value: Tensor, added: Sequence[Tensor] | None = None) -> Iterator[Tensor]:
        """Yield features after every convolution that halves, and every block, each with its own of
        `added` (the first has none)."""
        for index, layer in enumerate([*self.encoders, *self.resnets]):
            value = layer(value)
            if added is not None and index:
                value = value + added[index]
            yield value

    def draw(self, features: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
        """Return picture and fraction of the background from the output of `read`."""
        value = features[-1]
        for index, (double, skip) in enumerate(zip(self.decoders, self.skippers, strict=True)):
            value = skip(torch.cat([features[len(self.decoders) - 1 - index], double(value)], 1))
        return self.img_reg(value), self.attetion_reg(value)
