"""Hair of a given length on a character of the tests."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v import Character
from a2v.types import MATERIALS


def head_of(character: Character) -> np.ndarray:
    """Place of the head's bone (3,), meters."""
    bone = character.body.bone_names.index("head")
    return np.asarray(character.body.bone_transforms[bone, :3, 3], np.float64)


def with_hair(character: Character, *, length: float) -> Character:
    """A character on VRM's rig with black hair of `length` meters; all else is light.

    The length is measured from the base of the skull downwards.
    """
    surface, skull = character.surface, head_of(character)
    places = surface.vertices.astype(np.float64)
    black = (places[:, 1] > skull[1] - length) & (np.abs(places[:, 0]) < 0.16)
    black &= places[:, 2] < skull[2] + 0.01
    colors = np.where(black[:, None], 0.08, [0.8, 0.6, 0.55]).astype(np.float32)
    on_head = black & (places[:, 1] > skull[1])
    materials = np.full(len(surface.faces), MATERIALS.index("cloth"), np.uint8)
    materials[on_head[surface.faces].all(axis=1)] = MATERIALS.index("hair")
    changed = dataclasses.replace(
        surface, colors=colors, uv=None, texture=None, normal_map=None, materials=materials
    )
    return dataclasses.replace(character, surface=changed)
