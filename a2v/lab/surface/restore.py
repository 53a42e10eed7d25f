"""Networks of the implicit surface out of the ONNX files that ``export/reconstruction.py``
wrote."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from torch import nn

from a2v.lab.untracing import fill, read_weights
from a2v.reconstruction.implicit.model import COLORS_FILE, FIELD_FILE, MAPS_FILE

_NAMES = {
    "shape": {MAPS_FILE: {"shape.": ""}, FIELD_FILE: {"coarse.": "field."}},
    "detail": {MAPS_FILE: {"detail.": ""}, FIELD_FILE: {"fine.": "field."}},
    "color": {MAPS_FILE: {"painter.": ""}, COLORS_FILE: {"painter.": ""}},
}
"""What the files call the weights of each stage."""


def restore_networks(networks: nn.Module, folder: str | os.PathLike[str], stage: str) -> None:
    """Give fresh networks of a stage the weights of a folder with ``person_*.onnx``; normalizations
    change nothing, see `a2v.lab.untracing.calibrate`.

    Parameters
    ----------
    networks : Shape, Detail or Painter
        Of `a2v.lab.surface.training`, with the sizes of the files.
    folder : path
    stage : "shape", "detail" or "color"

    Raises
    ------
    InputError
        The files are none of ours, or of networks of other sizes.
    """
    weights: dict[str, np.ndarray] = {}
    for file, names in _NAMES[stage].items():
        weights |= read_weights(Path(folder) / file, names)
    fill(networks, weights, otherwise="give the same --network settings, or leave initial out")
