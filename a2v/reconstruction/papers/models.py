"""PIFu and PIFuHD as a whole: from a picture to occupancy and colours of points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.errors import InputError
from a2v.reconstruction.papers.checkpoints import fill, part, read_state
from a2v.reconstruction.papers.networks import HourglassFilter, PointNetwork, ResidualNetwork, at_points

PIXELS = 512
DEPTH_FACTOR = 256 / 200
"""What depths in [-1, 1] are multiplied with before the networks see them."""


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

    def see(self, image: Tensor) -> Tensor:
        """Features of an image (1, 3, S, S)."""
        features: Tensor = self.image_filter(image)
        return features

    def occupancy(self, features: Tensor, points: Tensor) -> Tensor:
        """Chance (N,) that points (N, 3), x right, y down, z to the camera, all in [-1, 1], lie in the person."""
        given = torch.cat([at_points(features, points[:, :2]), _depth(points)], 1)
        return torch.sigmoid(self.surface_classifier(given)[0][0, 0])


class PIFuColor(nn.Module):
    """PIFu's ``net_C``: a residual filter whose features stand behind those of `PIFuGeometry`, and five layers for points."""

    def __init__(self, path: str | Path) -> None:
        super().__init__()
        state = read_state(path)
        with torch.device("meta"):
            self.image_filter = ResidualNetwork(part(state, "image_filter."))
            self.surface_classifier = PointNetwork(part(state, "surface_classifier."))
        self.path = path
        fill(self, state, str(path))

    def see(self, image: Tensor, geometry: Tensor) -> Tensor:
        """Features of an image and of the geometry's own; raises InputError where the two networks do not belong together."""
        _demand(self.path, self.surface_classifier, geometry.shape[1] + self.image_filter.features + 1, 3)
        own: Tensor = self.image_filter(image)
        if own.shape[2:] != geometry.shape[2:]:
            raise InputError(f"{self.path} sees {own.shape[2]} cells across where the geometry's network sees {geometry.shape[2]}")
        return torch.cat([geometry, own], 1)

    def colors(self, features: Tensor, points: Tensor) -> Tensor:
        """sRGB (N, 3) in [0, 1] of points as of `PIFuGeometry.occupancy`."""
        given = torch.cat([at_points(features, points[:, :2]), _depth(points)], 1)
        return 0.5 + 0.5 * torch.tanh(self.surface_classifier(given)[0][0].T)


class PIFuHD(nn.Module):
    """PIFuHD: a coarse level that sees normals of front and back, and a fine one that sees the picture at twice the size."""

    def __init__(self, path: str | Path) -> None:
        super().__init__()
        state = read_state(path, inside="model_state_dict")
        with torch.device("meta"):
            self.image_filter = HourglassFilter(part(state, "image_filter."), pool=False)
            self.mlp = PointNetwork(part(state, "mlp."))
            self.netG = nn.Module()
            self.netG.image_filter = HourglassFilter(part(state, "netG.image_filter."), pool=True)
            self.netG.mlp = PointNetwork(part(state, "netG.mlp."))
            self.netG.netF, self.netG.netB = (ResidualNetwork(part(state, f"netG.{name}.")) for name in ("netF", "netB"))
        coarse: Any = self.netG
        _demand(path, coarse.mlp, coarse.image_filter.features + 1, 1)
        wanted = self.mlp.inputs - self.image_filter.features
        layers = [index for index, width in enumerate(coarse.mlp.outputs) if width == wanted]
        if not layers or self.mlp.outputs[-1] != 1:
            raise InputError(f"{path}: no layer of the coarse level gives the {wanted} numbers that the fine level takes of it")
        self.merged = layers[-1]
        if coarse.image_filter.conv1.in_channels not in (3, 9) or self.image_filter.conv1.in_channels not in (3, 6, 9):
            raise InputError(
                f"{path}: the levels see {coarse.image_filter.conv1.in_channels} and {self.image_filter.conv1.in_channels} channels"
            )
        fill(self, state, str(path))

    def see(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """Coarse and fine features of an image (1, 3, 2 S, 2 S)."""
        coarse: Any = self.netG
        small = functional.interpolate(image, scale_factor=0.5, mode="bilinear", align_corners=False, antialias=True)
        sides = [coarse.netF(small), coarse.netB(small)]
        given = torch.cat([small, *sides], 1)
        features = coarse.image_filter(given[:, : coarse.image_filter.conv1.in_channels])
        large = [functional.interpolate(side, size=image.shape[2:], mode="bilinear", align_corners=True) for side in sides]
        del given, small, sides
        return features, self.image_filter(torch.cat([image, *large], 1)[:, : self.image_filter.conv1.in_channels])

    def occupancy(self, features: tuple[Tensor, Tensor], points: Tensor) -> Tensor:
        """Chance (N,) that points (N, 3), as of `PIFuGeometry.occupancy`, lie in the person, by the fine level."""
        places, coarse = points[:, :2], features[0]
        net: Any = self.netG
        kept = net.mlp(torch.cat([at_points(coarse, places), _depth(points)], 1), keep=self.merged)[1]
        return torch.sigmoid(self.mlp(torch.cat([at_points(features[1], places), kept], 1))[0][0, 0])


def _depth(points: Tensor) -> Tensor:
    return DEPTH_FACTOR * points[None, None, :, 2]


def _demand(path: str | Path, network: PointNetwork, inputs: int, outputs: int) -> None:
    if (network.inputs, network.outputs[-1]) != (inputs, outputs):
        found = f"{network.inputs} numbers a point and give {network.outputs[-1]}"
        raise InputError(f"{path}: the layers for points take {found}; expected {inputs} and {outputs}")
