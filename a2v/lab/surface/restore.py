"""Networks of the implicit surface, restored from the ONNX files of
``export/reconstruction.py``."""

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
"""Names of each stage's weights in the files."""


def restore_networks(networks: nn.Module, folder: str | os.PathLike[str], stage: str) -> None:
    """Set the weights of a stage's fresh networks to those of a folder with ``person_*.onnx``.

    Afterwards the normalizations change nothing; see `a2v.lab.untracing.calibrate`.

    Parameters
    ----------
    networks : Shape, Detail or Painter
        Networks of `a2v.lab.surface.training`, with the sizes of the files.
    folder : path
    stage : "shape", "detail" or "color"

    Raises
    ------
    InputError
        The files are not from a2v, or of networks of other sizes.
    """
    weights: dict[str, np.ndarray] = {}
    for file, names in _NAMES[stage].items():
        weights |= read_weights(Path(folder) / file, names)
    fill(networks, weights, otherwise="give the same --network settings, or leave initial out")
