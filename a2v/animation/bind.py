"""Bind a reconstructed surface to the fitted body (Eq. 19): anchors, displacements, skinning
weights."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.geometry.mesh import Cholesky, cotangent_weights, laplacian, vertex_areas, vertex_normals
from a2v.types import Body, BoolArray, Character, FloatArray, IntArray, Surface

_SHARPNESS = 0.01
"""Cost in meters that makes a body part e times less likely."""
_NEVER = 0.15
"""A part whose cost exceeds that of the nearest part by more than this, meters, is not considered.
"""


@dataclass(frozen=True)
class BindSettings:
    """Settings of the match between vertices of the surface and the body.

    Attributes
    ----------
    neighbors : int
        Nearest vertices of the body considered for each vertex of the surface.
    normal_weight : float
        Cost of opposite normals, as a distance in meters.
    part_smoothing : float
        Distance in meters over which the evidence for body parts is diffused along the surface
        before parts are chosen.
    weight_smoothing : float
        Distance in meters over which skinning weights are smoothed along the surface.
    far : float
        Distance in meters from the body at which a vertex counts as loose (hair, skirts). A loose
        vertex takes its weights from the surrounding surface rather than from its nearest body
        vertex.
    """

    neighbors: int = 24
    normal_weight: float = 0.04
    part_smoothing: float = 0.02
    weight_smoothing: float = 0.015
    far: float = 0.06


def skin_of(body: Body) -> Character:
    """Return the body's own skin as a gray character, for clips that need a rig but no person.

    The four largest weights of each vertex are kept.
    """
    weights, bones = _four_largest(body.weights)
    colors = np.full(body.vertices.shape, 0.6, np.float32)
    return Character(
        surface=Surface(vertices=body.vertices, faces=body.faces, colors=colors),
        body=body,
        weights=weights.astype(np.float32),
        bones=bones.astype(np.int32),
        anchors=np.arange(len(body.vertices), dtype=np.int32),
        parts=body.parts,
    )


def _four_largest(weights: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the four largest of weights (V, B) of each vertex, (V, 4), largest first, with sum 1,
    and their bones (V, 4)."""
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    largest = np.take_along_axis(weights, bones, axis=1).astype(np.float64)
    return largest / largest.sum(axis=1, keepdims=True), bones


def bind(
    surface: Surface,
    body: Body,
    *,
    parts: IntArray | None = None,
    settings: BindSettings = BindSettings(),
) -> Character:
    """Bind `surface` to `body`.

    1. Each vertex of the surface is compared with its nearest body vertices. The cost is the
       distance plus the disagreement of the normals.
    2. The cost of each body part is diffused along the surface; the part of the lowest cost is
       chosen, so that a hand on the hip stays part of the arm. Given `parts` skip this.
    3. The body vertex *of that part* with the lowest cost is the anchor (paper, Eq. 19).
    4. Skinning weights come from the anchors and are smoothed by a diffusion: close vertices with
       agreeing normals keep theirs, loose vertices take those around them. The four largest weights
       are kept. Vertices that come from the body (``surface.twins``, ``surface.face``) keep the
       body's weights.

    Parameters
    ----------
    surface : Surface
        In the pose and frame of `body`.
    body : Body
    parts : (V,) int or None
        Body part of each vertex of the surface (an index into `a2v.body.PARTS`) where known, -1
        where not.
    settings : BindSettings

    Returns
    -------
    Character
        With anchors, parts and the four largest weights of each vertex.

    Raises
    ------
    InputError
        The surface is empty or far from the body.
    """
    vertices, faces = surface.vertices.astype(np.float64), surface.faces.astype(np.int64)
    body_vertices = body.vertices.astype(np.float64)
    tree_distance = _distances(vertices, faces, body_vertices)
    normals, body_normals = (
        vertex_normals(vertices, faces),
        vertex_normals(body_vertices, body.faces.astype(np.int64)),
    )
    present = np.unique(body.parts.astype(np.int64))
    asked = (
        np.zeros((len(vertices), len(present)), bool)
        if parts is None
        else np.asarray(parts)[:, None] == present
    )
    cost, best = _of_each_part(
        vertices, normals, body, body_normals, tree_distance, asked, settings
    )
    area, stiffness = (
        vertex_areas(vertices, faces) + 1e-12,
        laplacian(cotangent_weights(vertices, faces)),
    )
    chosen = _choose_parts(cost, area, stiffness, settings)
    if parts is not None:
        chosen = _with_known_parts(chosen, np.asarray(parts), present)
    rows = np.arange(len(vertices))
    anchors, price = best[rows, chosen], cost[rows, chosen]
    trust = (0.05 + 0.95 * np.clip((normals * body_normals[anchors]).sum(axis=1), 0, 1)) * np.exp(
        -((price / settings.far) ** 2)
    ) + 1e-3
    weights, bones = _skin(anchors, body, area * trust, stiffness, settings)
    bound = Character(
        surface=surface,
        body=body,
        weights=weights.astype(np.float32),
        bones=bones.astype(np.int32),
        anchors=anchors.astype(np.int32),
        parts=present[chosen].astype(np.int8),
        provenance={
            "bind": {name: getattr(settings, name) for name in settings.__dataclass_fields__}
        },
    )
    return _with_own_parts(bound)


def _distances(vertices: FloatArray, faces: IntArray, body_vertices: FloatArray) -> FloatArray:
    """Return the distance (V,) of each vertex of a surface from the nearest vertex of the body,
    meters.

    An empty or distant surface is an `InputError`.
    """
    from scipy.spatial import cKDTree

    if len(vertices) == 0 or len(faces) == 0:
        raise InputError("the surface is empty; reconstruct it first")
    distances = np.asarray(cKDTree(body_vertices).query(vertices)[0])
    if (away := float(np.median(distances))) > 0.5:
        raise InputError(
            f"the surface is {away:.2f} m away from the body; fit the body to it first"
        )
    return distances


def _with_own_parts(character: Character) -> Character:
    """Return the character with the body's weights on hands and face that come from the body."""
    surface = character.surface
    if surface.twins is not None:
        own = np.flatnonzero(surface.twins >= 0)
        character = _with_twins(character, own, surface.twins[own])
    return (
        character
        if surface.face is None
        else _with_twins(character, surface.face.patch, surface.face.twins)
    )


def _with_twins(character: Character, own: IntArray, twins: IntArray) -> Character:
    """Return the character with the body's own weights where its surface is a copy of the body's.

    Its vertices `own` (K,) are the body's `twins` (K,).
    """
    body = character.body
    weights, bones = character.weights.copy(), character.bones.copy()
    anchors, parts = character.anchors.copy(), character.parts.copy()
    weights[own], bones[own] = _four_largest(body.weights[twins])
    anchors[own], parts[own] = twins, body.parts[twins]
    return dataclasses.replace(
        character, weights=weights, bones=bones, anchors=anchors, parts=parts
    )


def _of_each_part(
    vertices: FloatArray,
    normals: FloatArray,
    body: Body,
    body_normals: FloatArray,
    distance: FloatArray,
    asked: BoolArray,
    settings: BindSettings,
) -> tuple[FloatArray, IntArray]:
    """Find the vertex of each of the body's P parts with the lowest cost for each of `vertices` (V,
    3): its cost (V, P), meters, and its index (V, P).

    `distance` (V,) is the distance to the nearest vertex of any part. Parts that are too far away
    to be chosen have an infinite cost, unless `asked` (V, P) requests them.
    """
    targets = body.vertices.astype(np.float64)
    cost, best = np.full(asked.shape, np.inf), np.zeros(asked.shape, np.int64)
    limit = distance + settings.normal_weight + _NEVER
    for column, part in enumerate(np.unique(body.parts)):
        own = np.flatnonzero(body.parts == part)
        rows = np.flatnonzero(asked[:, column] | (_box_distance(vertices, targets[own]) < limit))
        if len(rows):
            cost[rows, column], index = _nearest(
                vertices[rows], normals[rows], targets[own], body_normals[own], settings
            )
            best[rows, column] = own[index]
    return cost, best


def _nearest(
    vertices: FloatArray,
    normals: FloatArray,
    targets: FloatArray,
    target_normals: FloatArray,
    settings: BindSettings,
) -> tuple[FloatArray, IntArray]:
    """Find the target of the lowest cost among a part's `targets` (N, 3) for each of `vertices` (V,
    3): its cost (V,) in meters and its index (V,)."""
    from scipy.spatial import cKDTree

    found = cKDTree(targets).query(vertices, k=min(settings.neighbors, len(targets)))
    distance, index = (np.reshape(values, (len(vertices), -1)) for values in found)
    agreement = np.einsum("va,vka->vk", normals, target_normals[index])
    total = distance + settings.normal_weight * 0.5 * (1 - agreement)
    pick, rows = total.argmin(axis=1), np.arange(len(vertices))
    return total[rows, pick], index[rows, pick]


def _box_distance(vertices: FloatArray, targets: FloatArray) -> FloatArray:
    """Return the distance (V,) of `vertices` (V, 3) to the box around `targets` (N, 3): a lower
    bound of the distance to the targets."""
    outside = np.maximum(
        np.maximum(targets.min(axis=0) - vertices, vertices - targets.max(axis=0)), 0
    )
    return np.asarray(np.linalg.norm(outside, axis=1))


def _with_known_parts(chosen: IntArray, known: IntArray, present: IntArray) -> IntArray:
    """Return the columns (V,) of the `known` parts (V,) among the parts `present`. Vertices whose
    part is unknown (-1) or not present keep their `chosen` column."""
    lookup = np.searchsorted(present, np.clip(known, present[0], present[-1]))
    return np.where((known >= 0) & (present[lookup] == known), lookup, chosen)


def _choose_parts(
    cost: FloatArray, area: FloatArray, stiffness: Any, settings: BindSettings
) -> IntArray:
    """Return the column (V,) of the part with the largest probability after diffusion along the
    surface."""
    from scipy.sparse import diags

    sharp = np.exp(-(cost - cost.min(axis=1, keepdims=True)) / _SHARPNESS)
    probability = sharp / sharp.sum(axis=1, keepdims=True)
    system = Cholesky(diags(area) + settings.part_smoothing**2 * stiffness)
    return system.solve(area[:, None] * probability).argmax(axis=1)  # type: ignore[no-any-return]


def _skin(
    anchors: IntArray, body: Body, mass: FloatArray, stiffness: Any, settings: BindSettings
) -> tuple[FloatArray, IntArray]:
    """Return the largest four weights (V, 4) and their bones (V, 4): those of the body at the
    `anchors`, smoothed over the surface. A vertex with a small `mass` (V,) is smoothed more."""
    from scipy.sparse import diags

    used = np.flatnonzero(body.weights[np.unique(anchors)].max(axis=0) > 0)
    start = body.weights[anchors][:, used].astype(np.float64)
    smooth = Cholesky(diags(mass) + settings.weight_smoothing**2 * stiffness).solve(
        mass[:, None] * start
    )
    smooth = np.maximum(smooth, 0)
    four = min(4, len(used))
    order = np.argsort(-smooth, axis=1, kind="stable")[:, :four]
    weights = np.take_along_axis(smooth, order, axis=1)
    bones = used[order]
    if four < 4:
        weights = np.pad(weights, ((0, 0), (0, 4 - four)))
        bones = np.pad(bones, ((0, 0), (0, 4 - four)))
    weights[weights < 1e-3] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    return weights, np.where(weights > 0, bones, 0)
