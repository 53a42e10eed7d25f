"""Fit the body model to a mesh of a person without bones, in T or A pose, and carry its skinning
weights over."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from a2v.body.lbfgs import minimize
from a2v.body.parts import PARTS, part_of_bone
from a2v.body.skin import skin_vertices
from a2v.body.skinning import BodyModel, make_body
from a2v.errors import InputError
from a2v.geometry.neighbors import shares_around
from a2v.types import Body, FloatArray, IntArray

HEIGHT = 1.7
"""Height of the mesh in the fit, meters."""
LARGEST_MEAN = 0.015
"""Largest mean distance of the mesh from the fitted body and back, as a share of its height."""
LARGEST_ALONE = 0.13
"""Largest distance of all but 2 % of the body's skin from the mesh, as a share of its height."""
_POSES = (0.0, 20.0, 45.0, 65.0)
"""Angles of the arms below the horizontal at which the fit may start, degrees."""
_REST = 45.0
"""That of the model at rest."""
_SAMPLES = 1500
_ROUNDS = 10
_STEPS = 12
_WIDTHS = (0.15, 0.06)
"""Distance at which a match counts half, in the first and the last rounds, meters."""
_LEAST_WEIGHT = 1e-3
"""Smaller weights are dropped."""
_FIXED = {PARTS.index(f"{side}_hand") for side in ("left", "right")}


@dataclass(frozen=True)
class MeshFit:
    """A body fitted to a mesh.

    Attributes
    ----------
    body : Body
        In the pose of the mesh: meters, y up, facing +z, soles on y = 0.
    unit : float
        Meters per unit of the mesh.
    turn : (3, 3) float64
        The body's axes from the mesh's.
    shift : (3,) float64
        ``body = unit * (turn @ mesh) + shift``.
    distance : float
        Mean distance of mesh and body, meters.
    """

    body: Body
    unit: float
    turn: FloatArray
    shift: FloatArray
    distance: float


def fit_mesh(model: BodyModel, vertices: FloatArray) -> MeshFit:
    """Fit the body to the vertices (n, 3) of a mesh, y up, any unit.

    Arms and legs apart, about T or A pose. Facing is that of the feet. Nearest points in both
    directions are matched in rounds (as Eq. 17), by L-BFGS over pose, shape and size.

    Raises
    ------
    InputError
        The mesh has no size, or the fitted body does not resemble it.
    """
    points = np.asarray(vertices, np.float64)
    size = float(np.ptp(points[:, 1])) if len(points) else 0.0
    if size < 1e-9 or not np.isfinite(points).all():
        raise InputError("the mesh has no height; expected a person who stands along y")
    turn = _facing(points)
    unit = HEIGHT / size
    placed = unit * (points @ turn.T)
    shift = -np.array([np.median(placed[:, 0]), placed[:, 1].min(), np.median(placed[:, 2])])
    placed = placed + shift
    body, distance, alone = _fitted(model, placed)
    if distance > LARGEST_MEAN * HEIGHT or alone > LARGEST_ALONE * HEIGHT:
        raise InputError(
            f"the body does not fit the mesh: {100 * distance / HEIGHT:.1f} % of its height apart "
            f"on average, {100 * alone / HEIGHT:.0f} % at the worst place (at most "
            f"{100 * LARGEST_MEAN:.1f} and {100 * LARGEST_ALONE:.0f}); expected one person in T "
            "or A pose, arms and legs apart, standing along y"
        )
    return MeshFit(body=body, unit=unit, turn=turn, shift=shift, distance=distance)


def carried_weights(body: Body, vertices: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return weights (n, 4), largest first, and bones (n, 4) of vertices (n, 3) near a body's skin:
    shares of the nearest vertices' weights."""
    outer = skin_vertices(len(body.vertices), body.faces)
    nearest, shares = shares_around(body.vertices[outer].astype(np.float64), vertices, count=6)
    dense = np.einsum("nk,nkb->nb", shares, body.weights[outer].astype(np.float64)[nearest])
    bones = np.argsort(-dense, axis=1, kind="stable")[:, :4]
    weights = np.take_along_axis(dense, bones, axis=1)
    weights[weights < _LEAST_WEIGHT] = 0
    bones = np.where(weights > 0, bones, 0)
    return weights / weights.sum(axis=1, keepdims=True), bones


def _facing(points: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) about y after which the arms lie along x and the toes point to
    +z."""
    flat = points[:, [0, 2]] - np.median(points[:, [0, 2]], axis=0)
    low, high = points[:, 1].min(), points[:, 1].max()
    share = (points[:, 1] - low) / (high - low)
    upper = flat[(share > 0.5) & (share < 0.85)]
    along_z = np.ptp(upper[:, 1]) > np.ptp(upper[:, 0]) if len(upper) > 2 else False
    turn = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]) if along_z else np.eye(3)
    depth = (points @ turn.T)[:, 2]
    soles, shins = depth[share < 0.04], depth[(share > 0.08) & (share < 0.2)]
    if len(soles) > 2 and len(shins) > 2:
        middle = 0.5 * (shins.min() + shins.max())
        if soles.max() - middle < middle - soles.min():
            turn = np.diag([-1.0, 1, -1]) @ turn
    return turn


def _fitted(model: BodyModel, points: FloatArray) -> tuple[Body, float, float]:
    """Return the body fitted to points (n, 3) in meters, the mean distance, and the distance of all
    but 2 % of its skin from the points."""
    import torch
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(0)
    if len(points) > 20_000:
        points = points[rng.choice(len(points), 20_000, replace=False)]
    rest = make_body(model, grounded=True)
    outer = skin_vertices(len(rest.vertices), rest.faces)
    ids = torch.from_numpy(rng.choice(outer, min(_SAMPLES, len(outer)), replace=False))
    wide = float(np.ptp(points[:, 0]) / np.ptp(points[:, 1]))
    start = min(_POSES, key=lambda angle: abs(_width(model, angle) - wide))
    rotvecs = torch.from_numpy(_arms(model, start))
    first = rotvecs.clone()
    free = torch.tensor(
        [
            [0.0 if part_of_bone(name) in _FIXED and "wrist" not in name else 1.0]
            for name in model.bone_names
        ],
        dtype=torch.float64,
    )
    shape = torch.from_numpy(np.asarray(model.shape_default, np.float64).copy())
    default = shape.clone()
    bounds = torch.from_numpy(np.asarray(model.shape_bounds, np.float64))
    spread = (bounds[:, 1] - bounds[:, 0]).clamp(min=1e-3)
    tall = float(np.ptp(rest.vertices[:, 1]))
    scale = torch.tensor([np.log(np.ptp(points[:, 1]) / tall)])
    with torch.no_grad():
        now = model.forward(rotvecs, shape, vertex_ids=ids).vertices * scale.exp()
    move = torch.from_numpy(
        np.array([0.0, points[:, 1].min() - float(now[:, 1].min()), 0.0])
        + (points.mean(0) - now.numpy().mean(0)) * (1, 0, 1)
    )
    leaves = [leaf.requires_grad_(True) for leaf in (rotvecs, shape, scale, move)]
    tree = cKDTree(points)
    sampled = points[rng.choice(len(points), min(_SAMPLES, len(points)), replace=False)]

    def skin() -> torch.Tensor:
        turned = first + (rotvecs - first) * free
        made = model.forward(turned, shape, vertex_ids=ids).vertices
        return made * scale.exp() + move

    target = torch.from_numpy(sampled)

    def loss(to_mesh: torch.Tensor, to_body: torch.Tensor, width: float) -> torch.Tensor:
        made = skin()
        square = ((made - to_mesh) ** 2).sum(-1)
        back = ((made[to_body] - target) ** 2).sum(-1)
        robust = (square / (square + width**2)).mean() + (back / (back + width**2)).mean()
        pose = ((rotvecs - first) ** 2).sum() / 0.3**2
        build = (((shape - default) / spread) ** 2).sum()
        below, over = (bounds[:, 0] - shape).clamp(min=0), (shape - bounds[:, 1]).clamp(min=0)
        return 100 * robust + 0.02 * pose + 0.05 * build + 10 * (below**2 + over**2).sum()

    for round_ in range(_ROUNDS):
        with torch.no_grad():
            made = skin().numpy()
        to_mesh = torch.from_numpy(points[tree.query(made)[1]])
        to_body = torch.from_numpy(cKDTree(made).query(sampled)[1])
        width = _WIDTHS[round_ >= _ROUNDS // 2]
        minimize(partial(loss, to_mesh, to_body, width), leaves, steps=_STEPS, history=50)
    with torch.no_grad():
        turned = (first + (rotvecs - first) * free).numpy()
        factor = float(scale.exp())
        body = make_body(model, turned.astype(np.float32), shape.numpy().astype(np.float32))
    return _scaled(body, factor, move.detach().numpy(), points)


def _scaled(
    body: Body, factor: float, move: FloatArray, points: FloatArray
) -> tuple[Body, float, float]:
    from scipy.spatial import cKDTree

    def placed(transforms: FloatArray) -> FloatArray:
        made = transforms.astype(np.float64).copy()
        made[:, :3, 3] = factor * made[:, :3, 3] + move
        return np.asarray(made.astype(np.float32))

    body = replace(
        body,
        vertices=(factor * body.vertices + move).astype(np.float32),
        bone_transforms=placed(body.bone_transforms),
        rest_transforms=placed(body.rest_transforms),
        bone_tails=(factor * body.bone_tails + move).astype(np.float32),
    )
    outer = skin_vertices(len(body.vertices), body.faces)
    skin = body.vertices[outer].astype(np.float64)
    there, back = cKDTree(points).query(skin)[0], cKDTree(skin).query(points)[0]
    return body, float((there.mean() + back.mean()) / 2), float(np.quantile(there, 0.98))


def _arms(model: BodyModel, angle: float) -> FloatArray:
    """Return rotation vectors (B, 3) float64 with the arms `angle` degrees below the horizontal."""
    rotvecs = np.zeros((model.n_bones, 3))
    for bone, sign in (("upperarm01.L", 1.0), ("upperarm01.R", -1.0)):
        rotvecs[model.bone(bone), 2] = sign * np.deg2rad(_REST - angle)
    return rotvecs


def _width(model: BodyModel, angle: float) -> float:
    """Return width over height of the model with arms at an angle."""
    body = make_body(model, _arms(model, angle).astype(np.float32))
    return float(np.ptp(body.vertices[:, 0]) / np.ptp(body.vertices[:, 1]))
