"""Export the trained networks of the implicit surface to three files for
`a2v.reconstruction.implicit`.

``person_maps.onnx`` processes the photo once; ``person_field.onnx`` gives the signed distance at
points, ``person_colors.onnx`` the colors of surface points. Arithmetic is float32, large weights
are stored as float16.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import onnx
import torch
from torch import Tensor, nn

from a2v.lab.surface.networks import GUIDE_CHANNELS, PHOTO_CHANNELS, Painter, point_values
from a2v.lab.surface.training import Detail, Shape, load_networks
from a2v.reconstruction.implicit.inputs import FRAME, GUIDE
from a2v.reconstruction.implicit.model import COLORS_FILE, FIELD_FILE, FORMAT, MAPS_FILE
from a2v.tracing import to_onnx
from export.storage import round_to_stored, save_model, shrink


class MapsGraph(nn.Module):
    """The part of the networks that depends only on the photo."""

    def __init__(self, shape: Shape, detail: Detail, painter: Painter) -> None:
        super().__init__()
        self.shape, self.detail, self.painter = shape, detail, painter

    def forward(
        self, photo: Tensor, photo_half: Tensor, guide: Tensor
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return features, maps, fine features and features for colors."""
        features, maps = self.shape.encoder(photo_half, guide)
        return (
            features,
            maps,
            self.detail.encoder(photo, maps),
            self.painter.features(photo_half, guide, maps),
        )


class FieldGraph(nn.Module):
    """The signed distance of points, coarse and fine."""

    def __init__(self, shape: Shape, detail: Detail) -> None:
        super().__init__()
        self.coarse, self.fine = shape.field, detail.field

    def forward(
        self,
        features: Tensor,
        maps: Tensor,
        fine: Tensor,
        guide: Tensor,
        place: Tensor,
        depth: Tensor,
        guide_distance: Tensor,
        guide_normals: Tensor,
    ) -> tuple[Tensor, Tensor]:
        """Return distances (1, N), meters."""
        values = point_values(maps, guide, place, depth, guide_distance, guide_normals)
        coarse, context = self.coarse(features, values, place)
        return self.fine(fine, place, coarse, context, values), coarse


class ColorsGraph(nn.Module):
    """Colors of surface points."""

    def __init__(self, painter: Painter) -> None:
        super().__init__()
        self.painter = painter

    def forward(
        self,
        color_features: Tensor,
        maps: Tensor,
        photo_half: Tensor,
        guide: Tensor,
        place: Tensor,
        depth: Tensor,
        guide_distance: Tensor,
        guide_normals: Tensor,
        normals: Tensor,
    ) -> Tensor:
        """sRGB (1, N, 3) in [0, 1]."""
        values = point_values(maps, guide, place, depth, guide_distance, guide_normals)
        colors: Tensor = self.painter(color_features, photo_half, values, normals, place)
        return colors


def export_reconstruction(
    run: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    license: str,
    extra: Mapping[str, Any] | None = None,
) -> tuple[Path, ...]:
    """Write the three files of a run of `a2v.lab.surface.training` into `folder`; return their
    paths.

    Parameters
    ----------
    run : path
        The run's folder, with the stages "shape", "detail" and "color".
    license : str
        License that is stored in the files.
    extra : mapping, optional
        More metadata of the model (data, seeds), JSON.

    Raises
    ------
    InputError
        A stage is not trained.
    """
    shape, detail, painter = (load_networks(run, stage) for stage in ("shape", "detail", "color"))
    assert isinstance(shape, Shape)
    assert isinstance(detail, Detail)
    assert isinstance(painter, Painter)
    for network in (shape, detail, painter):
        round_to_stored(network)
    photo, half = (
        torch.zeros(1, PHOTO_CHANNELS, FRAME, FRAME),
        torch.zeros(1, PHOTO_CHANNELS, FRAME // 2, FRAME // 2),
    )
    guide = torch.zeros(1, GUIDE_CHANNELS, GUIDE, GUIDE)
    maps_graph = MapsGraph(shape, detail, painter).eval()
    with torch.no_grad():
        features, maps, fine, color_features = maps_graph(photo, half, guide)
    count = 64
    asked = (
        torch.zeros(1, count, 2),
        torch.zeros(1, count),
        torch.zeros(1, count),
        torch.zeros(1, count, 3),
    )
    point_names = ["place", "depth", "guide_distance", "guide_normals"]
    graphs: dict[str, tuple[nn.Module, tuple[Tensor, ...], list[str], list[str]]] = {
        MAPS_FILE: (
            maps_graph,
            (photo, half, guide),
            ["photo", "photo_half", "guide"],
            ["features", "maps", "fine", "color_features"],
        ),
        FIELD_FILE: (
            FieldGraph(shape, detail).eval(),
            (features, maps, fine, guide, *asked),
            ["features", "maps", "fine", "guide", *point_names],
            ["distance", "coarse_distance"],
        ),
        COLORS_FILE: (
            ColorsGraph(painter).eval(),
            (color_features, maps, half, guide, *asked, torch.zeros(1, count, 3)),
            ["color_features", "maps", "photo_half", "guide", *point_names, "normals"],
            ["colors"],
        ),
    }
    metadata = {"format": FORMAT, "licence": license, **(extra or {})}
    written = []
    for name, (graph, arguments, inputs, outputs) in graphs.items():
        path = Path(folder) / name
        save_model(
            _trace(graph, arguments, inputs, outputs, [*point_names, "normals"]), metadata, path
        )
        written.append(path)
    return tuple(written)


def _trace(
    graph: nn.Module,
    arguments: tuple[Tensor, ...],
    inputs: list[str],
    outputs: list[str],
    varying: list[str],
) -> onnx.ModelProto:
    points = torch.export.Dim("points", min=2)
    with torch.no_grad():
        proto = to_onnx(
            graph,
            arguments,
            inputs,
            outputs,
            [{1: points} if name in varying else None for name in inputs],
        )
    shrink(proto)
    return proto
