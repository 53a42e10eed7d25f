"""A skirt that swings: chains of bones below the hips."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.formats.gltf.springs import (
    Springs,
    Swing,
    add_chains,
    apart,
    around,
    capsule_between,
    weights_between,
)
from a2v.geometry.mesh import piece_of_vertices
from a2v.types import BoolArray, Character, FloatArray, IntArray

CHAINS = 10
"""Number of chains around a skirt."""
JOINTS = 4
"""Number of turning joints of a chain; one more is its end."""
SWING = Swing(stiffness=0.6, gravity=0.2, drag=0.4, radius=0.015)
"""Swing of cloth."""
_LEAST = 0.15
"""Smallest height of a skirt, meters."""
_TUCKED = 0.06
"""Depth of the uppermost joint below the skirt's top, which lies inside the trunk, meters."""
_LEGS = (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot"))
"""Bones with capsules around them, and the bones where these end."""


def hang_skirt(character: Character) -> tuple[Character, Springs | None]:
    """Hang the skirt of a character on VRM's rig on chains of bones below the hips.

    A skirt is a layer separate from the body's mesh that begins near the hips and reaches around
    both legs. Without one the character is returned unchanged, with None.
    """
    skirt = _skirt_of(character)
    names = character.body.bone_names
    if skirt is None or not {"hips", "leftUpperLeg", "rightUpperLeg"} <= set(names):
        return character, None
    hips = names.index("hips")
    points = character.surface.vertices[skirt].astype(np.float64)
    places = _chain_places(points)
    body, bones = add_chains(character.body, "skirt", hips, places)
    weights, owners = character.weights.copy(), character.bones.copy()
    weights[skirt], owners[skirt] = _chain_weights(points, places, bones, hips)
    changed = dataclasses.replace(character, body=body, weights=weights, bones=owners)
    capsules = tuple(
        capsule_between(character, side + start, side + end, ~skirt)
        for side in ("left", "right")
        for start, end in _LEGS
    )
    chains = tuple(map(tuple, bones.tolist()))
    return changed, Springs(name="skirt", chains=chains, capsules=capsules, swing=SWING)


def _skirt_of(character: Character) -> BoolArray | None:
    """Return the vertices (V,) of the skirt; None without one."""
    vertices = character.surface.vertices
    label = piece_of_vertices(len(vertices), character.surface.faces)
    count = int(label.max()) + 1
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


def _chain_places(points: FloatArray) -> FloatArray:
    """Return positions (CHAINS, JOINTS + 1, 3) of the joints on the skirt `points` (n, 3)."""
    heights = np.linspace(points[:, 1].max() - _TUCKED, points[:, 1].min(), JOINTS + 1)
    middle = points.mean(axis=0)
    angle = around(points - middle, CHAINS)
    places = np.zeros((CHAINS, JOINTS + 1, 3))
    for chain in range(CHAINS):
        gap = apart(angle, chain, CHAINS)
        way = 2 * np.pi * chain / CHAINS
        for joint, height in enumerate(heights):
            near = np.exp(-((gap / 0.5) ** 2) - ((points[:, 1] - height) / 0.02) ** 2) + 1e-12
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
    """Return weights and bones (n, 4) of the skirt's vertices. Each follows two joints on each of
    its two nearest chains; at the top, vertices follow the hips."""
    top, low = float(places[0, 0, 1]), float(places[0, -1, 1])
    down = (top - points[:, 1]) / (top - low) * JOINTS
    along = around(points - points.mean(axis=0), CHAINS)
    column = np.floor(along).astype(np.int64)
    sides = (column % CHAINS, (column + 1) % CHAINS, along - column)
    return weights_between(sides, down, bones, hips)
