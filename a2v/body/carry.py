"""Transfer a fitted body to another body model: the same person in the same pose."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.landmarks import JOINT_BONES
from a2v.body.lbfgs import minimize
from a2v.body.parts import PARTS, part_of_bone
from a2v.body.skinning import BodyModel, BodyState, make_body
from a2v.kinematics.so3 import rotmat_to_rotvec
from a2v.types import Body

if TYPE_CHECKING:
    from torch import Tensor

_FITTED = "fitted_"
"""Before the names of the source's parameters in a body that was carried over."""
_HANDS = (PARTS.index("left_hand"), PARTS.index("right_hand"))


@dataclass(frozen=True, eq=False)
class _Unknowns:
    """Rotation vectors (B, 3), shape (S,) and translation (3,): float64 leaves; `free` (B, 1) is 0
    for bones that stay at rest, else 1."""

    rotvecs: Tensor
    shape: Tensor
    translation: Tensor
    free: Tensor

    def state(self, model: BodyModel, vertex_ids: Tensor) -> BodyState:
        return model.forward(
            self.rotvecs * self.free, self.shape, self.translation, vertex_ids=vertex_ids
        )


@dataclass(frozen=True, eq=False)
class _Goal:
    """Targets of the body: joints (n, 3), meters, for its bones (n,), and nearest points for the
    compared vertices (m,)."""

    bones: Tensor
    joints: Tensor
    vertex_ids: Tensor


def carry_over(
    model: BodyModel, source: Body, *, count: int = 1500, rounds: int = 6, steps: int = 20
) -> tuple[Body, float]:
    """Fit a body of `model` to the skin and the joints of `source`.

    First only joints are matched, then the surface as well (nearest points, updated every round, as
    in Eq. 17), by L-BFGS.

    Parameters
    ----------
    model : BodyModel
        Its `joint_bones` name the joints that both models have.
    source : Body
        A body of the default model, such as `fit_body`'s.
    count : int
        Number of compared vertices; they are drawn with a fixed seed.
    rounds, steps : int
        Rounds, and L-BFGS iterations in each.

    Returns
    -------
    body : Body
        Its `parameters` hold those of `source` too (`fitted_parameters`), so that a further fit can
        start from it.
    distance : float
        Mean distance of its vertices from the skin of `source`, meters.
    """
    import torch
    from scipy.spatial import cKDTree

    shared = [source.bone_names.index(JOINT_BONES[joint]) for joint in model.joint_bones]
    goal = _Goal(
        bones=torch.tensor([model.bone(bone) for bone in model.joint_bones.values()]),
        joints=torch.from_numpy(source.bone_transforms[shared, :3, 3].astype(np.float64)),
        vertex_ids=torch.from_numpy(
            np.random.default_rng(0).choice(
                len(model.weights), min(count, len(model.weights)), replace=False
            )
        ),
    )
    skin = source.vertices.astype(np.float64)
    tree = cKDTree(skin)
    unknowns = _start(
        model, torch.from_numpy(source.bone_transforms[0, :3, :3].astype(np.float64)), goal
    )
    leaves = [unknowns.rotvecs, unknowns.shape, unknowns.translation]
    matched: Tensor | None = None
    for round_ in range(rounds):
        if round_:
            with torch.no_grad():
                now = unknowns.state(model, goal.vertex_ids).vertices.numpy()
            matched = torch.from_numpy(skin[tree.query(now, workers=1)[1]])
        minimize(partial(_loss, model, unknowns, goal, matched), leaves, steps=steps, history=100)
    values = [
        (tensor.detach().numpy()).astype(np.float32)
        for tensor in (unknowns.rotvecs * unknowns.free, *leaves[1:])
    ]
    body = make_body(
        model, *values, provenance={"carried over from": source.model, **source.provenance}
    )
    kept = {_FITTED + name: value for name, value in source.parameters.items()}
    body = dataclasses.replace(body, parameters={**body.parameters, **kept})
    return body, float(np.mean(tree.query(body.vertices, workers=1)[0]))


def fitted_parameters(body: Body) -> dict[str, np.ndarray]:
    """Return the parameters of the default model that a fit has found: those of the body itself, or
    of the one that it was carried over from."""
    kept = {
        name.removeprefix(_FITTED): value
        for name, value in body.parameters.items()
        if name.startswith(_FITTED)
    }
    return kept or dict(body.parameters)


def _start(model: BodyModel, root_rotmat: Tensor, goal: _Goal) -> _Unknowns:
    """Return the start: the default shape at rest, rotated by the root's rotation (3, 3).

    Its first joint is at the source's. Fingers stay at rest.
    """
    import torch

    rotvecs = torch.zeros(model.n_bones, 3, dtype=torch.float64)
    rotvecs[0] = rotmat_to_rotvec(root_rotmat)
    rotvecs.requires_grad_(True)
    shape = torch.zeros(model.n_shape, dtype=torch.float64, requires_grad=True)
    first = goal.bones[0]
    with torch.no_grad():
        translation = (
            goal.joints[0] - model.forward(rotvecs, shape, vertex_ids=goal.bones[:1]).joints[first]
        )
    free = torch.ones(model.n_bones, 1, dtype=torch.float64)
    fingers = [
        index
        for index, name in enumerate(model.bone_names)
        if part_of_bone(name) in _HANDS and "wrist" not in name
    ]
    free[fingers] = 0.0
    return _Unknowns(rotvecs, shape, translation.requires_grad_(True), free)


def _loss(model: BodyModel, unknowns: _Unknowns, goal: _Goal, matched: Tensor | None) -> Tensor:
    """Squared distances of joints (standard deviation 1 cm) and matched vertices (m, 3), and weak
    priors.

    The weights were chosen by hand on the tests' model.
    """
    state = unknowns.state(model, goal.vertex_ids)
    total = ((state.joints[goal.bones] - goal.joints) ** 2).sum() / 0.01**2
    if matched is not None:
        square = ((state.vertices - matched) ** 2).sum(dim=-1)
        total = 0.2 * total + 60 * (square / (square + 0.03**2)).mean() * (0.03 / 0.01) ** 2
    bends = (unknowns.rotvecs[1:] ** 2).sum(dim=-1)
    return total + 0.2 * bends.sum() + 0.1 * (unknowns.shape**2).sum()
