"""Export the trained network of the body map to ``bodymap.onnx``: a picture to landmarks and maps.

Arithmetic is float32, large weights are stored as float16.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.lab.bodymap.networks import MAPS, SIDE, BodyMapNetwork
from a2v.lab.bodymap.training import initial_folder, load_network, stored_weights
from a2v.lab.untracing import fill
from a2v.perception.bodymap import FILE, FORMAT
from a2v.tracing import to_onnx
from export.storage import round_to_stored, save_model, shrink

INPUTS = ("picture",)
"""Names of the graph's inputs."""
OUTPUTS = ("points", "log_scales", "maps")
"""Names of its outputs."""


class BodyMapGraph(nn.Module):
    """The computation of the file; see `BodyMaps` for its outputs."""

    def __init__(self, network: BodyMapNetwork) -> None:
        super().__init__()
        self.body = network

    def forward(self, picture: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Points (B, 33, 3), log_scales (B, 33, 2) and maps (B, 9, 64, 64) of pictures (B, 4, 256,
        256)."""
        told = self.body(picture)
        return told.points, told.log_scales, told.maps


def export_bodymap(
    run: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    license: str,
    blend: float = 1.0,
    initial: str = "",
    extra: Mapping[str, Any] | None = None,
) -> Path:
    """Write `FILE` from the averaged weights of a run of `a2v.lab.bodymap.training` into `folder`;
    return its path.

    Parameters
    ----------
    run : path
        The run's folder.
    license : str
        License that is stored in the file.
    blend : float
        Share, above 0, of the run's weights; the rest are the weights of the file in the folder
        `initial` ("shipped": that of a2v) from which the run started. The blend loses less of the
        initial network's accuracy when new views are learned (Wortsman et al. 2022).
    extra : mapping, optional
        More metadata of the network (data, seeds), JSON.

    Raises
    ------
    InputError
        The network is not trained, `blend` is out of range, or no weights to blend with are found.
    """
    if not 0 < blend <= 1:
        raise InputError(
            f"blend is {blend:g}; expected a share of the trained weights, above 0 and at most 1"
        )
    if blend < 1 and not initial:
        raise InputError(
            "blend mixes the trained weights with those of bodymap.initial; give it too, or leave "
            "blend out"
        )
    network, facts = load_network(run)
    if blend < 1:
        other = stored_weights(initial_folder(initial))
        network, facts = blended(folded(network), other, blend), {**facts, "blend": blend}
    path = Path(folder) / FILE.name
    export_network(network, path, license=license, extra={**facts, **(extra or {})})
    return path


def folded(network: BodyMapNetwork) -> dict[str, np.ndarray]:
    """Return a network's weights with the normalizations folded into them, as its file has them."""
    with tempfile.TemporaryDirectory() as folder:
        export_network(network, Path(folder) / FILE.name, license="")
        return stored_weights(folder)


def blended(
    own: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray], share: float
) -> BodyMapNetwork:
    """Return a network of two blended sets of `folded` weights; `own` have the weight `share`."""
    mixed = BodyMapNetwork()
    fill(
        mixed,
        {name: share * own[name] + (1 - share) * other[name] for name in own if name in other},
        otherwise="leave blend out",
    )
    return mixed.eval()


def export_network(
    network: BodyMapNetwork,
    path: str | os.PathLike[str],
    *,
    license: str,
    extra: Mapping[str, Any] | None = None,
) -> None:
    """Write a network as ONNX; its weights are rounded in place to the stored values."""
    round_to_stored(network)
    batch = torch.export.Dim("batch", min=1)
    before = torch.backends.mha.get_fastpath_enabled()
    torch.backends.mha.set_fastpath_enabled(False)  # fused attention cannot be exported to ONNX
    try:
        with torch.no_grad():
            proto = to_onnx(
                BodyMapGraph(network).eval(),
                (torch.zeros(2, 4, SIDE, SIDE),),
                INPUTS,
                OUTPUTS,
                [{0: batch}],
            )
    finally:
        torch.backends.mha.set_fastpath_enabled(before)
    shrink(proto)
    save_model(proto, {"format": FORMAT, "licence": license, "maps": MAPS, **(extra or {})}, path)
