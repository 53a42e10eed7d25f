"""Meshes of a glTF document: vertices split along seams, primitives by material, skin,
expressions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from a2v.formats.characters import ShadedTargets, encode_texture, linear_colors
from a2v.formats.gltf.document import ARRAY_BUFFER, ELEMENT_BUFFER, Document, smallest_kind
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.normal_map import corner_tangents
from a2v.types import MATERIALS, BoolArray, ByteArray, Character, FloatArray, IntArray, Surface


def split_corners(surface: Surface) -> tuple[IntArray, IntArray, FloatArray | None]:
    """Split vertices along texture seams: source vertex (N,), faces (F, 3) into them, texture
    coordinates (N, 2), v down."""
    faces = surface.faces.astype(np.int64)
    if surface.uv is None:
        return np.arange(len(surface.vertices)), faces, None
    uv = surface.uv.reshape(-1, 2).astype(np.float32)
    keys = np.empty(len(uv), dtype=[("v", "<i8"), ("a", "<f4"), ("b", "<f4")])
    keys["v"], keys["a"], keys["b"] = faces.ravel(), uv[:, 0], uv[:, 1]
    unique, index = np.unique(keys, return_inverse=True)
    coordinates = np.stack([unique["a"], 1 - unique["b"]], axis=-1).astype(np.float32)
    return unique["v"], index.reshape(-1, 3), coordinates


@dataclass(frozen=True, kw_only=True)
class MeshArrays:
    """The arrays of a glTF mesh.

    Attributes
    ----------
    attributes : by glTF's names, (N, ...)
        Attributes of the vertices.
    faces : by material, (F, 3) int64
    targets : by expression, by "POSITION" and "NORMAL"
        Ascending vertices (n,) and their offsets (n, 3).
    """

    attributes: Mapping[str, NDArray[Any]]
    faces: Mapping[str, IntArray]
    targets: Mapping[str, Mapping[str, tuple[IntArray, FloatArray]]]

    def of_material(self, kind: str, *, with_still: bool) -> MeshArrays:
        """Return the part of one material with the expressions that move it; with `with_still` also
        those that move nothing."""
        used, faces = np.unique(self.faces[kind], return_inverse=True)
        number = np.full(len(self.attributes["POSITION"]), -1)
        number[used] = np.arange(len(used))
        own = {
            name: {part: _kept(number, *moved) for part, moved in parts.items()}
            for name, parts in self.targets.items()
        }
        still = {
            name
            for name, parts in self.targets.items()
            if with_still and not any(len(places) for places, _ in parts.values())
        }
        targets = {
            name: parts
            for name, parts in own.items()
            if name in still or any(len(places) for places, _ in parts.values())
        }
        attributes = {name: values[used] for name, values in self.attributes.items()}
        return MeshArrays(
            attributes=attributes, faces={kind: faces.reshape(-1, 3)}, targets=targets
        )


def _kept(number: IntArray, places: IntArray, values: FloatArray) -> tuple[IntArray, FloatArray]:
    left = number[places] >= 0
    return number[places[left]], values[left]


def add_mesh(
    document: Document, thing: Character | Surface, name: str, quality: int, *, apart: bool = False
) -> list[int]:
    """Make a mesh with its materials, and skinning weights and expressions for a character; or,
    `apart`, a mesh for each material.

    Returns the indices of the meshes; one unless `apart`.
    """
    surface = thing.surface if isinstance(thing, Character) else thing
    textures: dict[str, Any] = {}
    if surface.uv is not None and surface.texture is not None:
        textures["baseColorTexture"] = _add_texture(document, "texture", surface.texture, quality)
        if surface.normal_map is not None:
            textures["normalTexture"] = _add_texture(
                document, "normals", surface.normal_map, quality
            )
    arrays = mesh_arrays(thing)
    made = []
    parts = [arrays]
    if apart:
        first = next(iter(arrays.faces))
        parts = [arrays.of_material(kind, with_still=kind == first) for kind in arrays.faces]
    for part in parts:
        named = f"{name}_{next(iter(part.faces))}" if apart else name
        made.append(_add_arrays(document, part, named, textures))
    return made


def mesh_arrays(thing: Character | Surface) -> MeshArrays:
    """Split vertices along the seams of the texture; return their attributes, faces by material and
    expressions."""
    surface = thing.surface if isinstance(thing, Character) else thing
    source, faces, coordinates = split_corners(surface)
    corners = surface.vertices.astype(np.float64)[surface.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    solid = (area > 0) | (np.arange(len(faces)) == 0)
    normals = vertex_normals(surface.vertices.astype(np.float64), surface.faces.astype(np.int64))
    normals[np.linalg.norm(normals, axis=1) < 0.5] = [0, 1, 0]
    attributes: dict[str, NDArray[Any]] = {
        "POSITION": surface.vertices[source].astype(np.float32),
        "NORMAL": normals[source].astype(np.float32),
    }
    if coordinates is not None and surface.texture is not None:
        attributes["TEXCOORD_0"] = coordinates
        if surface.normal_map is not None:
            assert surface.uv is not None
            tangents = np.zeros((len(source), 4), np.float32)
            tangents[faces] = corner_tangents(surface.vertices, surface.faces, surface.uv)
            attributes["TANGENT"] = tangents
    else:
        linear = linear_colors(surface.colors[source])  # COLOR_0 is linear
        levels = np.concatenate(
            [np.round(linear * 65535), np.full((len(linear), 1), 65535)], axis=1
        )
        attributes["COLOR_0"] = levels.astype(np.uint16)
    targets: dict[str, dict[str, tuple[IntArray, FloatArray]]] = {}
    if isinstance(thing, Character):
        bones, weights = thing.bones[source].copy(), thing.weights[source].astype(np.float32)
        weights = weights / weights.sum(axis=1, keepdims=True)
        bones[weights == 0] = 0
        kind_of = np.uint8 if len(thing.body.bone_names) <= 256 else np.uint16
        attributes["JOINTS_0"], attributes["WEIGHTS_0"] = bones.astype(kind_of), weights
        if surface.face is not None:
            targets = _expressions(ShadedTargets(surface), source)
    by_material = {kind: faces[chosen] for kind, chosen in _by_material(surface, solid)}
    return MeshArrays(attributes=attributes, faces=by_material, targets=targets)


def _add_arrays(
    document: Document, arrays: MeshArrays, name: str, textures: Mapping[str, Any]
) -> int:
    """Make a mesh of the arrays: a primitive for each material, all with the same vertices."""
    attributes = {
        key: document.accessor(
            values, target=ARRAY_BUFFER, bounds=key == "POSITION", normalized=key == "COLOR_0"
        )
        for key, values in arrays.attributes.items()
    }
    count = len(arrays.attributes["POSITION"])
    mesh: dict[str, Any] = {"name": name, "primitives": []}
    for kind, faces in arrays.faces.items():
        indices = document.accessor(
            faces.astype(smallest_kind(count)).reshape(-1), target=ELEMENT_BUFFER
        )
        document.json["materials"].append(_material(kind, textures))
        mesh["primitives"].append(
            {
                "attributes": attributes,
                "indices": indices,
                "material": len(document.json["materials"]) - 1,
                "mode": 4,
            }
        )
    if arrays.targets:
        targets = [
            {part: _add_offsets(document, count, *moved) for part, moved in parts.items()}
            for parts in arrays.targets.values()
        ]
        for primitive in mesh["primitives"]:
            primitive["targets"] = targets
        mesh["weights"] = [0.0] * len(targets)
        mesh["extras"] = {"targetNames": list(arrays.targets)}
    document.json["meshes"].append(mesh)
    return len(document.json["meshes"]) - 1


def _add_offsets(document: Document, count: int, places: IntArray, values: FloatArray) -> int:
    if len(places):
        return document.sparse_accessor(count, places, values)
    return document.sparse_accessor(count, np.zeros(1, np.int64), np.zeros((1, 3)))


_ROUGHNESS: Mapping[str, float] = MappingProxyType(
    {"surface": 0.9, "skin": 0.6, "hair": 0.7, "cloth": 0.9, "eyes": 0.1, "mouth": 0.4}
)
"""Roughness by the name of the material."""


def _material(name: str, textures: Mapping[str, Any]) -> dict[str, Any]:
    """Make a material with the given textures."""
    rough: dict[str, Any] = {
        "metallicFactor": 0.0,
        "roughnessFactor": _ROUGHNESS[name],
    }
    if "baseColorTexture" in textures:
        rough["baseColorTexture"] = textures["baseColorTexture"]
    material: dict[str, Any] = {"name": name, "pbrMetallicRoughness": rough}
    return material | (
        {"normalTexture": textures["normalTexture"]} if "normalTexture" in textures else {}
    )


def _by_material(surface: Surface, solid: BoolArray) -> list[tuple[str, IntArray]]:
    """Return the names of materials and the `solid` faces (n,) of each; one material if the surface
    has none."""
    if surface.materials is None:
        return [("surface", np.flatnonzero(solid))]
    found = [
        (name, np.flatnonzero(solid & (surface.materials == number)))
        for number, name in enumerate(MATERIALS)
    ]
    return [(name, chosen) for name, chosen in found if len(chosen)]


def _add_texture(document: Document, name: str, image: ByteArray, quality: int) -> dict[str, int]:
    """Embed a picture (H, W, 3); return a material's reference to it."""
    data, kind = encode_texture(image, quality)
    document.json.setdefault("images", []).append(
        {"name": name, "mimeType": kind, "bufferView": document.view(data)}
    )
    document.json["samplers"] = [
        {"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}
    ]
    document.json.setdefault("textures", []).append(
        {"source": len(document.json["images"]) - 1, "sampler": 0}
    )
    return {"index": len(document.json["textures"]) - 1}


def _expressions(
    expressions: ShadedTargets, source: IntArray
) -> dict[str, dict[str, tuple[IntArray, FloatArray]]]:
    """Return `MeshArrays.targets` of a mesh whose vertices (N,) are those of the surface in
    `source`."""
    order = np.argsort(source, kind="stable")
    targets: dict[str, dict[str, tuple[IntArray, FloatArray]]] = {}
    for name in expressions.face.names:
        vertices, offsets, turns = expressions(name)
        first, last = (
            np.searchsorted(source[order], vertices, side=side) for side in ("left", "right")
        )
        copies = np.repeat(np.arange(len(vertices)), last - first)
        at = np.repeat(
            first - np.concatenate([[0], np.cumsum(last - first)[:-1]]), last - first
        ) + np.arange(len(copies))
        ascending = np.argsort(order[at])
        places, copies = order[at][ascending], copies[ascending]
        targets[name] = {}
        for attribute, values in (("POSITION", offsets[copies]), ("NORMAL", turns[copies])):
            own = np.abs(values).max(axis=1) > 0
            targets[name][attribute] = places[own], values[own]
    return targets
