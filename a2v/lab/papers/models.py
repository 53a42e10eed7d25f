"""PIFu and PIFuHD as a whole: from a picture to occupancy and colors of points;
`a2v.lab.papers.converted` runs their parts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.errors import InputError
from a2v.lab.papers.checkpoints import fill, part, read_state
from a2v.lab.papers.networks import HourglassFilter, PointNetwork, ResidualNetwork, at_points

DEPTH_FACTOR = 256 / 200
"""Factor on depths in [-1, 1] for the networks' input."""


class PIFuGeometry(nn.Module):
    """PIFu's ``net_G``: one picture of 512 pixels, an hourglass filter, five layers for points."""

    def __init__(self, path: str | Path) -> None:
        super().__init__()
        state = read_state(path)
        with torch.device("meta"):
            self.image_filter = HourglassFilter(part(state, "image_filter."), pool=True)
            self.surface_classifier = PointNetwork(part(state, "surface_classifier."))
        _demand(path, self.surface_classifier, self.image_filter.features + 1, 1)
        fill(self, state, str(path))

    def parts(self, pixels: int) -> Iterator[Part]:
        """Yield the parts: features of a picture (1, 3, `pixels`, `pixels`), and the probability
        that points lie in the person."""
        with_map = (self.image_filter.features, pixels // 4, pixels // 4)
        yield Part("features", self.image_filter, {"image": (3, pixels, pixels)})
        yield Part(
            "points", _Occupancy(self.surface_classifier), {"features": with_map, "points": None}
        )


class PIFuColor(nn.Module):
    """PIFu's ``net_C``: a residual filter whose features are appended to those of `PIFuGeometry`,
    and five layers for points."""

    def __init__(self, path: str | Path) -> None:
        super().__init__()
        state = read_state(path)
        with torch.device("meta"):
            self.image_filter = ResidualNetwork(part(state, "image_filter."))
            self.surface_classifier = PointNetwork(part(state, "surface_classifier."))
        _demand(path, self.surface_classifier, self.surface_classifier.inputs, 3)
        if self.surface_classifier.inputs < self.image_filter.features + 2:
            raise InputError(
                f"{path}: the layers for points take "
                f"{self.surface_classifier.inputs} inputs, fewer than the outputs of its picture "
                "filter"
            )
        fill(self, state, str(path))

    def parts(self, pixels: int) -> Iterator[Part]:
        """Yield the parts: features of a picture, and sRGB colors of points from the geometry's
        features followed by these."""
        with_map = (self.surface_classifier.inputs - 1, pixels // 4, pixels // 4)
        yield Part("features", self.image_filter, {"image": (3, pixels, pixels)})
        yield Part(
            "points", _Colors(self.surface_classifier), {"features": with_map, "points": None}
        )


class PIFuHD(nn.Module):
    """PIFuHD: a coarse level with normals of front and back as input, and a fine one with the
    picture at twice the size."""

    def __init__(self, path: str | Path) -> None:
        super().__init__()
        state = read_state(path, inside="model_state_dict")
        with torch.device("meta"):
            self.image_filter = HourglassFilter(part(state, "image_filter."), pool=False)
            self.mlp = PointNetwork(part(state, "mlp."))
            self.netG = nn.Module()
            self.netG.image_filter = HourglassFilter(part(state, "netG.image_filter."), pool=True)
            self.netG.mlp = PointNetwork(part(state, "netG.mlp."))
            self.netG.netF, self.netG.netB = (
                ResidualNetwork(part(state, f"netG.{name}.")) for name in ("netF", "netB")
            )
        coarse: Any = self.netG
        _demand(path, coarse.mlp, coarse.image_filter.features + 1, 1)
        wanted = self.mlp.inputs - self.image_filter.features
        layers = [index for index, width in enumerate(coarse.mlp.outputs) if width == wanted]
        if not layers or self.mlp.outputs[-1] != 1:
            raise InputError(
                f"{path}: no layer of the coarse level has the {wanted} outputs "
                "that the fine level needs"
            )
        self.merged = layers[-1]
        if coarse.image_filter.conv1.in_channels not in (
            3,
            9,
        ) or self.image_filter.conv1.in_channels not in (3, 6, 9):
            raise InputError(
                f"{path}: the coarse and the fine level take "
                f"{coarse.image_filter.conv1.in_channels} and "
                f"{self.image_filter.conv1.in_channels} input channels; expected 3 or 9, and "
                "3, 6 or 9"
            )
        fill(self, state, str(path))

    def parts(self, pixels: int) -> Iterator[Part]:
        """Yield the parts: normals of front and back of a picture, coarse features of all three,
        fine ones at twice the size, and points by both."""
        net: Any = self.netG
        small, large = (3, pixels, pixels), (3, 2 * pixels, 2 * pixels)
        yield Part("front", net.netF, {"image": small})
        yield Part("back", net.netB, {"image": small})
        yield Part(
            "coarse", _Coarse(net.image_filter), {"image": small, "front": small, "back": small}
        )
        yield Part(
            "fine", _Fine(self.image_filter), {"image": large, "front": small, "back": small}
        )
        shapes = {
            "coarse": (net.image_filter.features, pixels // 4, pixels // 4),
            "fine": (self.image_filter.features, pixels, pixels),
        }
        yield Part(
            "points", _FineOccupancy(net.mlp, self.mlp, self.merged), {**shapes, "points": None}
        )


class Part(NamedTuple):
    """A network that is stored as a separate file.

    Attributes
    ----------
    name : str
    network : Module
    inputs : mapping
        Name to shape without the batch of one; None for points (N, 3), x right, y down, z to the
        camera, all in [-1, 1].
    """

    name: str
    network: nn.Module
    inputs: Mapping[str, tuple[int, ...] | None]


class _Occupancy(nn.Module):
    """Probability (N,) that points lie in the person."""

    def __init__(self, layers: PointNetwork) -> None:
        super().__init__()
        self.layers = layers

    def forward(self, features: Tensor, points: Tensor) -> Tensor:
        return torch.sigmoid(self.layers(_seen_at(features, points))[0][0, 0])


class _Colors(nn.Module):
    """sRGB (N, 3) in [0, 1] of points."""

    def __init__(self, layers: PointNetwork) -> None:
        super().__init__()
        self.layers = layers

    def forward(self, features: Tensor, points: Tensor) -> Tensor:
        return 0.5 + 0.5 * torch.tanh(self.layers(_seen_at(features, points))[0][0].T)


class _Coarse(nn.Module):
    """Features of a picture and its normals."""

    def __init__(self, see: HourglassFilter) -> None:
        super().__init__()
        self.see = see

    def forward(self, image: Tensor, front: Tensor, back: Tensor) -> Tensor:
        features: Tensor = self.see(
            torch.cat([image, front, back], 1)[:, : self.see.conv1.in_channels]
        )
        return features


class _Fine(_Coarse):
    """The same of a picture at twice the size."""

    def forward(self, image: Tensor, front: Tensor, back: Tensor) -> Tensor:
        normals = functional.interpolate(
            torch.cat([front, back], 1), size=image.shape[2:], mode="bilinear", align_corners=True
        )
        features: Tensor = self.see(torch.cat([image, normals], 1)[:, : self.see.conv1.in_channels])
        return features


class _FineOccupancy(nn.Module):
    """Probability (N,) that points lie in the person, by the fine level and the output of a layer
    of the coarse one."""

    def __init__(self, first: PointNetwork, second: PointNetwork, merged: int) -> None:
        super().__init__()
        self.first, self.second, self.merged = first, second, merged

    def forward(self, coarse: Tensor, fine: Tensor, points: Tensor) -> Tensor:
        kept = self.first(_seen_at(coarse, points), keep=self.merged)[1]
        return torch.sigmoid(
            self.second(torch.cat([at_points(fine, points[:, :2]), kept], 1))[0][0, 0]
        )


def _seen_at(features: Tensor, points: Tensor) -> Tensor:
    """Return features (1, D, N) at points, and their depth."""
    return torch.cat(
        [at_points(features, points[:, :2]), DEPTH_FACTOR * points[None, None, :, 2]], 1
    )


def _demand(path: str | Path, network: PointNetwork, inputs: int, outputs: int) -> None:
    if (network.inputs, network.outputs[-1]) != (inputs, outputs):
        found = f"{network.inputs} inputs and have {network.outputs[-1]} outputs"
        raise InputError(
            f"{path}: the layers for points take {found}; expected {inputs} and {outputs}"
        )
