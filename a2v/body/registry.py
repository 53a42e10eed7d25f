"""The body models by name.

To add one: write a class that implements `BodyModel` in a new file, add the names of its bones to
`a2v.body.parts`, and add it to `MODELS`. The fit runs on Anny. Its result is carried over to
the new model through the `joint_bones` of that model (`a2v.body.carry`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Literal, overload

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.anny_data import load_anny_data
from a2v.body.skinning import BodyModel
from a2v.body.smpl import SmplModel
from a2v.errors import InputError
from a2v.types import FloatArray


@lru_cache(maxsize=1)
def _anny() -> AnnyModel:
    return AnnyModel(load_anny_data())


MODELS: Mapping[str, Callable[[], BodyModel]] = {"anny": _anny}
"""Functions that make the models, by the names that `load_body_model` accepts."""
MODEL_SUFFIXES = (".npz", ".pkl")
"""Suffix of files of body models."""


@overload
def load_body_model(name: Literal["anny"] = "anny") -> AnnyModel: ...
@overload
def load_body_model(name: str) -> BodyModel: ...
def load_body_model(name: str = "anny") -> BodyModel:
    """Load a body model: "anny", or the user's own file of an SMPL, SMPL-H or SMPL-X model
    (``.npz``; see `a2v.body.smpl`).

    Later calls return the same Anny. The first call on a machine takes half a minute (see
    `a2v.body.anny_data`), later ones a second, mainly for torch.

    Raises
    ------
    InputError
        The name is unknown, or the file is not such a model.
    """
    if name in MODELS:
        return MODELS[name]()
    if not name.lower().endswith(MODEL_SUFFIXES):
        raise InputError(
            f"unknown body model '{name}'; choose from {', '.join(MODELS)}, or give an SMPL "
            "model's .npz file"
        )
    return SmplModel.load(name)


@lru_cache(maxsize=1)
def default_rest() -> FloatArray:
    """Return Anny's vertices (V, 3) float64 of the default body at rest, meters. They are cached
    and cannot be changed."""
    import torch

    model = load_body_model("anny")
    rest = model.rest(torch.from_numpy(model.shape_default))[0].numpy().astype(np.float64)
    rest.setflags(write=False)
    return np.asarray(rest)
