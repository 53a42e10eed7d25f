"""Chains of bones that swing, for a skirt: on top of a character, and as VRM 1.0 and 0.x say
them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.types import BoolArray, Character, FloatArray, IntArray

CHAINS = 10
"""Around a skirt."""
JOINTS = 4
"""Of a chain that turn; one more is its end."""
_LEAST = 0.15
"""A layer that is lower, meters, is no skirt."""
_TUCKED = 0.06
"""The uppermost joint is so far below the skirt's top, which lies within the trunk, meters."""
_HIT = 0.015
"""Radius of a joint against the legs, meters."""
STIFFNESS = 0.6
"""How strongly a joint turns back to its rest, VRM's unit."""
GRAVITY = 0.2
"""VRM's gravityPower."""
DRAG = 0.4
"""VRM's dragForce: 0 swings on, 1 does not swing."""
_LEGS = (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot"))
"""Bones with capsules around them, and the bones that these reach to."""


@dataclass(frozen=True, kw_only=True)
class Capsule:
    """What joints do not enter.

    Attributes
    ----------
    bone : int
    tail : (3,) float64
        The other end, from the bone's head, meters; axes of the world at rest, as all bones of
        VRM's rig.
    radius : float
        Meters.
    """

    bone: int
    tail: FloatArray
    radius: float


@dataclass(frozen=True, kw_only=True)
class Springs:
    """Chains that swing, and what they meet.

    Attributes
    ----------
    chains : tuple of tuple of int
        Bones from the uppermost to the end.
    capsules : tuple of Capsule
    """

    chains: tuple[tuple[int, ...], ...]
    capsules: tuple[Capsule, ...]


def with_springs(character: Character) -> tuple[Character, Springs | None]:
    """A character on VRM's rig whose skirt hangs on chains of bones below the hips; as it was, and
    None, where it wears none.

    A skirt is a layer of its own, apart from the body's mesh, that begins about the hips and
    reaches around both legs.
    """
    skirt = _skirt_of(character)
    names = character.body.bone_names
    if skirt is None or not {"hips", "leftUpperLeg", "rightUpperLeg"} <= set(names):
        return character, None
    hips, first = names.index("hips"), len(names)
    places = _chain_places(character.surface.vertices[skirt].astype(np.float64))
    bones = np.arange(first, first + places[..., 0].size).reshape(places.shape[:2])
    weights, owners = character.weights.copy(), character.bones.copy()
    weights[skirt], owners[skirt] = _chain_weights(
        character.surface.vertices[skirt].astype(np.float64), places, bones, hips
    )
    parents = np.concatenate([np.full((len(bones), 1), hips), bones[:, :-1]], axis=1)
    transforms = np.tile(np.eye(4, dtype=np.float32), (bones.size, 1, 1))
    transforms[:, :3, 3] = places.reshape(-1, 3)
    body = character.body
    tails = (
        np.concatenate([places[:, 1:], places[:, -1:] - [0, 0.03, 0]], axis=1)
        .reshape(-1, 3)
        .astype(np.float32)
    )
    body = dataclasses.replace(
        body,
        bone_names=(
            *names,
            *(
                f"skirt_{chain}_{joint}"
                for chain in range(len(bones))
                for joint in range(bones.shape[1])
            ),
        ),
        bone_parents=np.concatenate([body.bone_parents, parents.ravel()]),
        bone_transforms=np.concatenate([body.bone_transforms, transforms]),
        rest_transforms=np.concatenate([body.rest_transforms, transforms]),
        bone_tails=np.concatenate([body.bone_tails, tails]),
        weights=np.concatenate(
            [body.weights, np.zeros((len(body.weights), bones.size), np.float32)], axis=1
        ),
    )
    changed = dataclasses.replace(character, body=body, weights=weights, bones=owners)
    return changed, Springs(
        chains=tuple(map(tuple, bones.tolist())), capsules=_capsules(character, ~skirt)
    )


def spring_extension(springs: Springs) -> dict[str, Any]:
    """VRMC_springBone of VRM 1.0."""
    colliders = [
        {
            "node": one.bone,
            "shape": {
                "capsule": {
                    "offset": [0.0, 0.0, 0.0],
                    "radius": one.radius,
                    "tail": _rounded(one.tail),
                }
            },
        }
        for one in springs.capsules
    ]
    joint = {
        "hitRadius": _HIT,
        "stiffness": STIFFNESS,
        "gravityPower": GRAVITY,
        "gravityDir": [0.0, -1.0, 0.0],
        "dragForce": DRAG,
    }
    return {
        "specVersion": "1.0",
        "colliders": colliders,
        "colliderGroups": [{"name": "legs", "colliders": list(range(len(colliders)))}],
        "springs": [
            {
                "name": f"skirt_{number}",
                "joints": [{"node": bone, **joint} for bone in chain],
                "colliderGroups": [0],
            }
            for number, chain in enumerate(springs.chains)
        ],
    }


def secondary_animation(springs: Springs | None) -> dict[str, Any]:
    """The same of VRM 0.x, which has spheres alone; Unity's axes, where z is turned around."""
    if springs is None:
        return {"boneGroups": [], "colliderGroups": []}
    groups = []
    for one in springs.capsules:
        count = max(2, int(np.ceil(np.linalg.norm(one.tail) / (0.8 * one.radius))))
        centers = [share * one.tail * [1, 1, -1] for share in np.linspace(0, 1, count)]
        spheres = [
            {"offset": dict(zip("xyz", _rounded(center), strict=True)), "radius": one.radius}
            for center in centers
        ]
        groups.append({"node": one.bone, "colliders": spheres})
    bones = {
        "comment": "skirt",
        "stiffiness": STIFFNESS,  # the format's own spelling
        "gravityPower": GRAVITY,
        "gravityDir": {"x": 0.0, "y": -1.0, "z": 0.0},
        "dragForce": DRAG,
        "center": -1,
        "hitRadius": _HIT,
        "bones": [chain[0] for chain in springs.chains],
        "colliderGroups": list(range(len(groups))),
    }
    return {"boneGroups": [bones], "colliderGroups": groups}


def _rounded(values: FloatArray) -> list[float]:
    return [round(float(value), 5) for value in values]


def _skirt_of(character: Character) -> BoolArray | None:
    """Vertices (V,) of the skirt, None without one."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    faces, vertices = character.surface.faces, character.surface.vertices
    edges = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = coo_matrix(
        (np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(vertices), len(vertices))
    )
    count, label = connected_components(graph, directed=False)
    names = character.body.bone_names
    if count < 2 or "hips" not in names:
        return None
    hips = float(character.body.bone_transforms[names.index("hips"), 1, 3])
    largest = int(np.bincount(label).argmax())
    skirt = np.zeros(len(vertices), bool)
    for part in range(count):
        own = vertices[label == part]
        around = own[:, 0].min() < -0.05 and own[:, 0].max() > 0.05
        if (
            part != largest
            and float(np.ptp(own[:, 1])) > _LEAST
            and abs(float(own[:, 1].max()) - hips) < 0.2
            and around
        ):
            skirt |= label == part
    return skirt if skirt.any() else None


def _angle(points: FloatArray, middle: FloatArray) -> FloatArray:
    """0 before, growing to the person's left, in chains' widths (n,)."""
    away = points - middle
    return np.asarray(np.arctan2(away[:, 0], away[:, 2]) / (2 * np.pi) * CHAINS % CHAINS)


def _chain_places(points: FloatArray) -> FloatArray:
    """Places (CHAINS, JOINTS + 1, 3) of the joints on the skirt `points` (n, 3)."""
    heights = np.linspace(points[:, 1].max() - _TUCKED, points[:, 1].min(), JOINTS + 1)
    middle = points.mean(axis=0)
    angle = _angle(points, middle)
    places = np.zeros((CHAINS, JOINTS + 1, 3))
    for chain in range(CHAINS):
        apart = np.abs((angle - chain + CHAINS / 2) % CHAINS - CHAINS / 2)
        way = 2 * np.pi * chain / CHAINS
        for joint, height in enumerate(heights):
            near = np.exp(-((apart / 0.5) ** 2) - ((points[:, 1] - height) / 0.02) ** 2) + 1e-12
            radius = float(near @ np.linalg.norm((points - middle)[:, [0, 2]], axis=1) / near.sum())
            places[chain, joint] = [
                middle[0] + radius * np.sin(way),
                height,
                middle[2] + radius * np.cos(way),
            ]
    return places


def _chain_weights(
    points: FloatArray, places: FloatArray, bones: IntArray, hips: int
) -> tuple[FloatArray, IntArray]:
    """Weights and bones (n, 4) of the skirt: of two chains beside each other and two joints below
    each other, of the hips at the top."""
    top, low = float(places[0, 0, 1]), float(places[0, -1, 1])
    down = (top - points[:, 1]) / (
        top - low
    ) * JOINTS - 0.5  # a joint moves what lies between it and the next
    along = _angle(points, points.mean(axis=0))
    column, row = (
        np.floor(along).astype(np.int64),
        np.floor(np.clip(down, -1, JOINTS - 1)).astype(np.int64),
    )
    across, below = along - column, np.clip(np.clip(down, -1, JOINTS - 1) - row, 0, 1)
    with_hips = np.concatenate(
        [np.full((CHAINS, 1), hips), bones[:, :JOINTS]], axis=1
    )  # row -1 is the hips
    weights, owners = [], []
    for side, share in ((0, 1 - across), (1, across)):
        for step, part in ((0, 1 - below), (1, below)):
            weights.append(share * part)
            owners.append(with_hips[(column + side) % CHAINS, np.minimum(row + 1 + step, JOINTS)])
    four, whose = np.stack(weights, axis=1), np.stack(owners, axis=1)
    for later in range(1, 4):  # the hips may stand there more than once
        for earlier in range(later):
            same = (whose[:, later] == whose[:, earlier]) & (four[:, later] > 0)
            four[same, earlier] += four[same, later]
            four[same, later] = 0
    order = np.argsort(-four, axis=1, kind="stable")
    four = np.take_along_axis(four, order, axis=1)
    return four.astype(np.float32), np.where(
        four > 0, np.take_along_axis(whose, order, axis=1), 0
    ).astype(np.int32)


def _capsules(character: Character, own: BoolArray) -> tuple[Capsule, ...]:
    """Around thighs and shins, as thick as the skin (`own` (V,)) that each moves."""
    names, capsules = character.body.bone_names, []
    heads = character.body.bone_transforms[:, :3, 3].astype(np.float64)
    for side in ("left", "right"):
        for bone, end in (
            (names.index(side + bone), names.index(side + end)) for bone, end in _LEGS
        ):
            skin = character.surface.vertices[own & (character.bones[:, 0] == bone)].astype(
                np.float64
            )
            tail = heads[end] - heads[bone]
            capsules.append(
                Capsule(bone=bone, tail=tail, radius=round(_thickness(skin - heads[bone], tail), 4))
            )
    return tuple(capsules)


def _thickness(points: FloatArray, tail: FloatArray) -> float:
    """Median distance of points (n, 3) from the line to `tail`, meters."""
    if not len(points):
        return 0.05
    along: Sequence[float] | FloatArray = points @ tail / float(tail @ tail)
    return float(np.median(np.linalg.norm(points - np.outer(along, tail), axis=1)))
