"""Swinging chains of bones: added to a character, and written as VRM 1.0 and 0.x."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.types import Body, BoolArray, Character, FloatArray, IntArray

END = 0.03
"""Length of the bone at the end of a chain, meters."""


@dataclass(frozen=True, kw_only=True)
class Capsule:
    """A solid that joints cannot enter.

    Attributes
    ----------
    bone : int
    tail : (3,) float64
        The other end relative to the bone's head, meters, in the world's axes at rest, like all
        bones of VRM's rig.
    radius : float
        Meters.
    """

    bone: int
    tail: FloatArray
    radius: float


@dataclass(frozen=True, kw_only=True)
class Swing:
    """Physics of the joints of a chain, in VRM's units.

    Attributes
    ----------
    stiffness : float
        Strength with which a joint turns back to its rest pose.
    gravity : float
        VRM's gravityPower.
    drag : float
        VRM's dragForce: with 0 the chain keeps swinging, with 1 it does not swing.
    radius : float
        Radius of a joint in collisions with the capsules, meters.
    """

    stiffness: float
    gravity: float
    drag: float
    radius: float


@dataclass(frozen=True, kw_only=True)
class Springs:
    """Chains of one garment or of the hair.

    Attributes
    ----------
    name : str
        Prefix of the bones' names.
    chains : tuple of tuple of int
        Bones from the uppermost to the end.
    capsules : tuple of Capsule
    swing : Swing
    """

    name: str
    chains: tuple[tuple[int, ...], ...]
    capsules: tuple[Capsule, ...]
    swing: Swing


def add_chains(body: Body, name: str, parent: int, places: FloatArray) -> tuple[Body, IntArray]:
    """Add chains of bones with the world's axes.

    Parameters
    ----------
    body : Body
    name : str
    parent : int
        Parent bone of all chains.
    places : (C, J + 1, 3) float64
        Joints of each chain from the uppermost to the end, meters.

    Returns
    -------
    Body
    (C, J + 1) int64
        The new bones.
    """
    count, first = places[..., 0].size, len(body.bone_names)
    bones = np.arange(first, first + count).reshape(places.shape[:2])
    parents = np.concatenate([np.full((len(bones), 1), parent), bones[:, :-1]], axis=1)
    transforms = np.tile(np.eye(4, dtype=np.float32), (count, 1, 1))
    transforms[:, :3, 3] = places.reshape(-1, 3)
    tails = np.concatenate([places[:, 1:], places[:, -1:] - [0, END, 0]], axis=1)
    names = (f"{name}_{chain}_{joint}" for chain, joint in np.ndindex(*bones.shape))
    more = np.zeros((len(body.weights), count), np.float32)
    changed = dataclasses.replace(
        body,
        bone_names=(*body.bone_names, *names),
        bone_parents=np.concatenate([body.bone_parents, parents.ravel()]),
        bone_transforms=np.concatenate([body.bone_transforms, transforms]),
        rest_transforms=np.concatenate([body.rest_transforms, transforms]),
        bone_tails=np.concatenate([body.bone_tails, tails.reshape(-1, 3).astype(np.float32)]),
        weights=np.concatenate([body.weights, more], axis=1),
    )
    return changed, bones


def around(away: FloatArray, chains: int) -> FloatArray:
    """Return the direction (n,) of points at `away` (n, 3) from an upright axis, in widths of one
    of the `chains` chains.

    It is 0 in front and grows toward the person's left.
    """
    return np.asarray(np.arctan2(away[:, 0], away[:, 2]) / (2 * np.pi) * chains % chains)


def apart(along: FloatArray, chain: int, chains: int) -> FloatArray:
    """Return the distances (n,) of directions `along` (n,), as of `around`, from a chain."""
    return np.asarray(np.abs((along - chain + chains / 2) % chains - chains / 2))


def weights_between(
    chains: tuple[IntArray, IntArray, FloatArray], down: FloatArray, bones: IntArray, top: int
) -> tuple[FloatArray, IntArray]:
    """Return weights and bones (n, 4) of vertices that follow two chains each.

    Parameters
    ----------
    chains : two (n,) int64, (n,) float64
        The chains on both sides of each vertex, and the weight of the second one.
    down : (n,) float64
        Position of a vertex below the first joint, in joints. A vertex at a whole number plus one
        half follows only one joint.
    bones : (C, J + 1) int64
    top : int
        The bone of vertices above the first joint.
    """
    joints = bones.shape[1] - 1
    inside = np.clip(down - 0.5, -1, joints - 1)
    row = np.floor(inside).astype(np.int64)
    below = np.clip(inside - row, 0, 1)
    owners = np.concatenate([np.full((len(bones), 1), top), bones[:, :joints]], axis=1)
    first, second, across = chains
    weights, names = [], []
    for chain, share in ((first, 1 - across), (second, across)):
        for step, part in ((0, 1 - below), (1, below)):
            weights.append(share * part)
            names.append(owners[chain, np.minimum(row + 1 + step, joints)])
    return strongest(np.stack(weights, axis=1), np.stack(names, axis=1))


def strongest(weights: FloatArray, bones: IntArray) -> tuple[FloatArray, IntArray]:
    """Return the four largest of weights (n, k) and their bones (n, k), as float32 with sums of
    one, and int32.

    Weights of repeated bones are summed first.
    """
    four, whose = weights.copy(), bones
    for later in range(1, four.shape[1]):
        for earlier in range(later):
            same = (whose[:, later] == whose[:, earlier]) & (four[:, later] > 0)
            four[same, earlier] += four[same, later]
            four[same, later] = 0
    order = np.argsort(-four, axis=1, kind="stable")[:, :4]
    four = np.take_along_axis(four, order, axis=1)
    four = four / np.maximum(four.sum(axis=1, keepdims=True), 1e-9)
    chosen = np.where(four > 0, np.take_along_axis(whose, order, axis=1), 0)
    return four.astype(np.float32), chosen.astype(np.int32)


def capsule_between(
    character: Character, start: str, end: str, own: BoolArray, *, usual: float = 0.05
) -> Capsule:
    """Return a capsule from one bone to another, as thick as the skin that the first one moves.

    Parameters
    ----------
    character : Character
    start, end : str
        Names of bones.
    own : (V,) bool
        Vertices that count as skin.
    usual : float
        Radius if the bone moves no vertex, meters.
    """
    names = character.body.bone_names
    heads = character.body.bone_transforms[:, :3, 3].astype(np.float64)
    bone = names.index(start)
    skin = character.surface.vertices[own & (character.bones[:, 0] == bone)].astype(np.float64)
    tail = heads[names.index(end)] - heads[bone]
    radius = float(np.median(from_line(skin - heads[bone], tail))) if len(skin) else usual
    return Capsule(bone=bone, tail=tail, radius=round(radius, 4))


def to_segment(points: FloatArray, tail: FloatArray) -> FloatArray:
    """Return the distances (n,) of points (n, 3) from the segment from the origin to `tail`,
    meters."""
    along = np.clip(points @ tail / float(tail @ tail), 0, 1)
    return np.asarray(np.linalg.norm(points - np.outer(along, tail), axis=1))


def from_line(points: FloatArray, tail: FloatArray) -> FloatArray:
    """Return the distances (n,) of points (n, 3) from the line through the origin and `tail`,
    meters."""
    along = points @ tail / float(tail @ tail)
    return np.asarray(np.linalg.norm(points - np.outer(along, tail), axis=1))


def spring_extension(springs: tuple[Springs, ...]) -> dict[str, Any]:
    """Return VRMC_springBone of VRM 1.0."""
    colliders: list[dict[str, Any]] = []
    groups: list[dict[str, Any]] = []
    chains: list[dict[str, Any]] = []
    for number, one in enumerate(springs):
        first = len(colliders)
        colliders += [
            {
                "node": capsule.bone,
                "shape": {
                    "capsule": {
                        "offset": [0.0, 0.0, 0.0],
                        "radius": capsule.radius,
                        "tail": _rounded(capsule.tail),
                    }
                },
            }
            for capsule in one.capsules
        ]
        groups.append(
            {"name": f"{one.name}_colliders", "colliders": list(range(first, len(colliders)))}
        )
        joint = {
            "hitRadius": one.swing.radius,
            "stiffness": one.swing.stiffness,
            "gravityPower": one.swing.gravity,
            "gravityDir": [0.0, -1.0, 0.0],
            "dragForce": one.swing.drag,
        }
        chains += [
            {
                "name": f"{one.name}_{chain}",
                "joints": [{"node": bone, **joint} for bone in bones],
                "colliderGroups": [number],
            }
            for chain, bones in enumerate(one.chains)
        ]
    return {
        "specVersion": "1.0",
        "colliders": colliders,
        "colliderGroups": groups,
        "springs": chains,
    }


def secondary_animation(springs: tuple[Springs, ...]) -> dict[str, Any]:
    """Return the springs of VRM 0.x, which has only spheres, in Unity's axes (z is negated)."""
    groups: list[dict[str, Any]] = []
    chains: list[dict[str, Any]] = []
    for one in springs:
        first = len(groups)
        for capsule in one.capsules:
            count = max(2, int(np.ceil(np.linalg.norm(capsule.tail) / (0.8 * capsule.radius))))
            centers = [share * capsule.tail * [1, 1, -1] for share in np.linspace(0, 1, count)]
            spheres = [
                {
                    "offset": dict(zip("xyz", _rounded(center), strict=True)),
                    "radius": capsule.radius,
                }
                for center in centers
            ]
            groups.append({"node": capsule.bone, "colliders": spheres})
        chains.append(
            {
                "comment": one.name,
                "stiffiness": one.swing.stiffness,  # the format's own spelling
                "gravityPower": one.swing.gravity,
                "gravityDir": {"x": 0.0, "y": -1.0, "z": 0.0},
                "dragForce": one.swing.drag,
                "center": -1,
                "hitRadius": one.swing.radius,
                "bones": [chain[0] for chain in one.chains],
                "colliderGroups": list(range(first, len(groups))),
            }
        )
    return {"boneGroups": chains, "colliderGroups": groups}


def _rounded(values: FloatArray) -> list[float]:
    return [round(float(value), 5) for value in values]
