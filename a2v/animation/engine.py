"""Prepare characters for game engines and phones: few triangles, normal map, smaller texture."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.geometry.normal_map import bake_normal_map
from a2v.geometry.simplify import simplify
from a2v.types import Character, FloatArray, Surface

FACE = 300.0
"""Weight of shape errors on the body's own face and wherever expressions move it; clothes have 1.
"""
HEAD = 3.0
"""Weight of shape errors elsewhere on the head."""
HANDS = 4.0
"""Weight of shape errors on hands."""


@dataclass(frozen=True)
class EngineSettings:
    """Settings of exported files.

    Attributes
    ----------
    triangles : int
        Largest number of triangles; 0 keeps all.
    texture : int
        Width and height of the texture, texels: 1024, 2048 or 4096.
    normal_map : int
        Width and height of the map that holds the detail lost by simplification; 0 for none.
    one_material : bool
        One material instead of one for each of skin, hair, cloth, eyes and mouth.
    """

    triangles: int = 30_000
    texture: int = 2048
    normal_map: int = 1024
    one_material: bool = False

    def __post_init__(self) -> None:
        if self.triangles and not 1000 <= self.triangles <= 1_000_000:
            raise InputError(
                f"triangles is {self.triangles}; expected 0 for all, or 1000 to 1000000 (8000, "
                "20000 and 30000 are usual)"
            )
        if self.texture not in (512, 1024, 2048, 4096):
            raise InputError(f"texture is {self.texture}; choose from 512, 1024, 2048, 4096")
        if self.normal_map not in (0, 512, 1024, 2048, 4096):
            raise InputError(
                f"normal_map is {self.normal_map}; choose from 0, 512, 1024, 2048, 4096"
            )


def engine_ready(character: Character, settings: EngineSettings = EngineSettings()) -> Character:
    """Reduce a character's triangles and texture; the lost detail goes into a normal map.

    The remaining vertices keep their positions, weights and expressions exactly. If the character
    has few enough triangles, only the size of its texture changes.

    Parameters
    ----------
    character : Character
        Any; its expressions are kept.
    settings : EngineSettings
    """
    surface, small = character.surface, character
    if settings.triangles and len(surface.faces) > settings.triangles:
        small = with_triangles(character, settings.triangles)
        if settings.normal_map and surface.uv is not None and small.surface.uv is not None:
            fine, coarse = (
                (surface.vertices, surface.faces, surface.uv),
                (small.surface.vertices, small.surface.faces, small.surface.uv),
            )
            baked = bake_normal_map(fine, coarse, size=settings.normal_map)
            small = dataclasses.replace(
                small, surface=dataclasses.replace(small.surface, normal_map=baked)
            )
    return dataclasses.replace(small, surface=_with_texture(small.surface, settings.texture))


def with_triangles(character: Character, triangles: int) -> Character:
    """A character of at most `triangles` triangles, or the fewest that keep the borders of its
    texture's charts; see `simplify`."""
    surface = character.surface
    result = simplify(
        surface.vertices, surface.faces, triangles, uv=surface.uv, importance=_importance(character)
    )
    kept = result.kept
    number = np.full(len(surface.vertices), -1)
    number[kept] = np.arange(len(kept))
    simple = dataclasses.replace(
        surface,
        vertices=surface.vertices[kept],
        faces=result.faces,
        colors=surface.colors[kept],
        uv=None if surface.uv is None else surface.uv.reshape(-1, 2)[result.corners],
        visible=None if surface.visible is None else surface.visible[kept],
        twins=None if surface.twins is None else surface.twins[kept],
        face=None if surface.face is None else surface.face.kept(number),
        standing=None,
        materials=None if surface.materials is None else surface.materials[result.origin],
    )
    return dataclasses.replace(
        character,
        surface=simple,
        weights=character.weights[kept],
        bones=character.bones[kept],
        anchors=character.anchors[kept],
        parts=character.parts[kept],
    )


def _importance(character: Character) -> FloatArray:
    """Weight of shape errors around each vertex (V,)."""
    weight = np.array([_bone_weight(name) for name in character.body.bone_names])[
        character.bones[:, 0]
    ]
    if character.surface.face is not None:
        weight[character.surface.face.patch] = FACE
        weight[character.surface.face.vertices] = FACE
    return np.asarray(weight)


def _bone_weight(name: str) -> float:
    """Return the weight of shape errors around the vertices that the bone moves most."""
    stem = name.removeprefix("left_").removeprefix("right_")
    return (
        HEAD
        if stem.startswith(("head", "jaw", "eye"))
        else HANDS
        if stem.startswith(("finger", "metacarpal", "wrist", "hand"))
        else 1.0
    )


def coarser(character: Character, triangles: int, texture: int = 4096) -> Character:
    """Return a copy with fewer triangles and the same textures, at most `texture` texels a side; it
    keeps the normal map of the finer character."""
    small = engine_ready(
        character, EngineSettings(triangles=triangles, normal_map=0, texture=texture)
    )
    return dataclasses.replace(
        small, surface=dataclasses.replace(small.surface, normal_map=character.surface.normal_map)
    )


def _with_texture(surface: Surface, size: int) -> Surface:
    """A surface whose texture has at most `size` texels a side."""
    import cv2

    if surface.texture is None or surface.texture.shape[0] <= size:
        return surface
    return dataclasses.replace(
        surface, texture=cv2.resize(surface.texture, (size, size), interpolation=cv2.INTER_AREA)
    )
