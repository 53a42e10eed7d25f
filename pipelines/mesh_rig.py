"""Bones for a user's mesh that has none: our body is fitted to it, and its weights are carried
over."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from a2v.body import load_body_model
from a2v.body.on_mesh import carried_weights, fit_mesh
from a2v.formats.gltf.rigging import Bones, rig_glb
from a2v.types import FloatArray, IntArray


def rig_mesh(path: Path, target: Path, *, name: Path) -> None:
    """Write a glTF of a mesh in T or A pose with bones and skins; messages call it `name`.

    Raises
    ------
    InputError
        The file cannot be read, or our body does not fit its mesh.
    """

    def rig(vertices: FloatArray) -> tuple[Bones, FloatArray, IntArray]:
        fit = fit_mesh(load_body_model(), vertices)
        placed = fit.unit * (vertices @ fit.turn.T) + fit.shift
        weights, owners = carried_weights(fit.body, placed)
        heads = (fit.body.bone_transforms[:, :3, 3].astype(np.float64) - fit.shift) / fit.unit
        transforms = np.tile(np.eye(4), (len(heads), 1, 1))
        transforms[:, :3, :3] = fit.turn.T @ fit.body.bone_transforms[:, :3, :3].astype(np.float64)
        transforms[:, :3, 3] = heads @ fit.turn
        return Bones(fit.body.bone_names, fit.body.bone_parents, transforms), weights, owners

    rig_glb(path, target, rig, name=name)
