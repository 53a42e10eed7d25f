"""From the trained network of the body map to ``bodymap.onnx``: one picture in, landmarks and maps out, without torch.

Arithmetic is float32, large weights are stored as float16.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from a2v.perception.bodymap import FILE, FORMAT
from a2v.reconstruction.bodymap.networks import MAPS, SIDE, BodyMapNetwork
from a2v.reconstruction.bodymap.training import load_network
from a2v.tracing import to_onnx
from export.storage import round_to_stored, save_model, shrink

INPUTS, OUTPUTS = ("picture",), ("points", "log_scales", "maps")


class BodyMapGraph(nn.Module):
    """What the file computes; see `BodyMaps` for its outputs."""

    def __init__(self, network: BodyMapNetwork) -> None:
        super().__init__()
        self.body = network

    def forward(self, picture: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Points (B, 33, 3), log_scales (B, 33, 2) and maps (B, 9, 64, 64) of pictures (B, 4, 256, 256)."""
        told = self.body(picture)
        return told.points, told.log_scales, told.maps


def export_bodymap(
    run: str | os.PathLike[str], folder: str | os.PathLike[str], *, licence: str, extra: Mapping[str, Any] | None = None
) -> Path:
    """Write `FILE` of a run of `a2v.reconstruction.bodymap.training` into `folder`, from its averaged weights; returns its path.

    Parameters
    ----------
    run : path
        The run's folder.
    licence : str
        Goes into the file.
    extra : mapping, optional
        More to say of the network (data, seeds), JSON.

    Raises
    ------
    InputError
        It is not trained.
    """
    network, facts = load_network(run)
    path = Path(folder) / FILE.name
    export_network(network, path, licence=licence, extra={**facts, **(extra or {})})
    return path


def export_network(
    network: BodyMapNetwork, path: str | os.PathLike[str], *, licence: str, extra: Mapping[str, Any] | None = None
) -> None:
    """Write a network as ONNX; its weights are rounded, in place, to what is stored."""
    round_to_stored(network)
    batch = torch.export.Dim("batch", min=1)
    before = torch.backends.mha.get_fastpath_enabled()
    torch.backends.mha.set_fastpath_enabled(False)  # the fused attention has no ONNX
    try:
        with torch.no_grad():
            proto = to_onnx(BodyMapGraph(network).eval(), (torch.zeros(2, 4, SIDE, SIDE),), INPUTS, OUTPUTS, [{0: batch}])
    finally:
        torch.backends.mha.set_fastpath_enabled(before)
    shrink(proto)
    save_model(proto, {"format": FORMAT, "licence": licence, "maps": MAPS, **(extra or {})}, path)
