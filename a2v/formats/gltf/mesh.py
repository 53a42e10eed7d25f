"""Meshes of a glTF document: vertices split along seams, a primitive for each material, skinning weights, expressions."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from a2v.formats.characters import ShadedTargets, encode_texture, linear_colors
from a2v.formats.gltf.document import ARRAY_BUFFER, ELEMENT_BUFFER, Document, smallest_kind
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.normal_map import corner_tangents
from a2v.types import MATERIALS, BoolArray, ByteArray, Character, FloatArray, IntArray, Surface


def split_corners(surface: Surface) -> tuple[IntArray, IntArray, FloatArray | None]:
    """Vertices split along texture seams: source vertex (N,), faces (F, 3) into them, texture coordinates (N, 2), v down."""
    faces = surface.faces.astype(np.int64)
    if surface.uv is None:
        return np.arange(len(surface.vertices)), faces, None
    uv = surface.uv.reshape(-1, 2).astype(np.float32)
    keys = np.empty(len(uv), dtype=[("v", "<i8"), ("a", "<f4"), ("b", "<f4")])
    keys["v"], keys["a"], keys["b"] = faces.ravel(), uv[:, 0], uv[:, 1]
    unique, index = np.unique(keys, return_inverse=True)
    coordinates = np.stack([unique["a"], 1 - unique["b"]], axis=-1).astype(np.float32)
    return unique["v"], index.reshape(-1, 3), coordinates


def add_mesh(document: Document, thing: Character | Surface, name: str, quality: int) -> int:
    """Make a mesh with its material, and skinning weights for a character; returns its index."""
    surface = thing.surface if isinstance(thing, Character) else thing
    source, faces, coordinates = split_corners(surface)
    corners = surface.vertices.astype(np.float64)[surface.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    corner_index, solid = faces, (area > 0) | (np.arange(len(faces)) == 0)
    normals = vertex_normals(surface.vertices.astype(np.float64), surface.faces.astype(np.int64))
    normals[np.linalg.norm(normals, axis=1) < 0.5] = [0, 1, 0]
    attributes = {
        "POSITION": document.accessor(surface.vertices[source].astype(np.float32), target=ARRAY_BUFFER, bounds=True),
        "NORMAL": document.accessor(normals[source].astype(np.float32), target=ARRAY_BUFFER),
    }
    textures: dict[str, Any] = {}
    if coordinates is not None and surface.texture is not None:
        attributes["TEXCOORD_0"] = document.accessor(coordinates, target=ARRAY_BUFFER)
        textures["baseColorTexture"] = _add_texture(document, "texture", surface.texture, quality)
        if surface.normal_map is not None:
            assert surface.uv is not None
            tangents = np.zeros((len(source), 4), np.float32)
            tangents[corner_index] = corner_tangents(surface.vertices, surface.faces, surface.uv)
            attributes["TANGENT"] = document.accessor(tangents, target=ARRAY_BUFFER)
            textures["normalTexture"] = _add_texture(document, "normals", surface.normal_map, quality)
    else:
        linear = linear_colors(surface.colors[source])  # COLOR_0 is linear
        levels = np.concatenate([np.round(linear * 65535), np.full((len(linear), 1), 65535)], axis=1).astype(np.uint16)
        attributes["COLOR_0"] = document.accessor(levels, target=ARRAY_BUFFER, normalized=True)
    if isinstance(thing, Character):
        bones, weights = thing.bones[source].copy(), thing.weights[source].astype(np.float32)
        weights = weights / weights.sum(axis=1, keepdims=True)
        bones[weights == 0] = 0
        kind_of = np.uint8 if len(thing.body.bone_names) <= 256 else np.uint16
        attributes["JOINTS_0"] = document.accessor(bones.astype(kind_of), target=ARRAY_BUFFER)
        attributes["WEIGHTS_0"] = document.accessor(weights, target=ARRAY_BUFFER)
    primitives = []
    for kind, chosen in _by_material(surface, solid):
        indices = document.accessor(faces[chosen].astype(smallest_kind(len(source))).reshape(-1), target=ELEMENT_BUFFER)
        document.json["materials"].append(_material(kind, textures))
        primitives.append({"attributes": attributes, "indices": indices, "material": len(document.json["materials"]) - 1, "mode": 4})
    document.json["meshes"].append({"name": name, "primitives": primitives})
    if isinstance(thing, Character) and surface.face is not None:
        _add_expressions(document.json["meshes"][-1], document, ShadedTargets(surface), source)
    return len(document.json["meshes"]) - 1


_ROUGHNESS: Mapping[str, float] = MappingProxyType({"surface": 0.9, "skin": 0.6, "hair": 0.7, "cloth": 0.9, "eyes": 0.1, "mouth": 0.4})
"""By name of the material."""


def _material(name: str, textures: Mapping[str, Any]) -> dict[str, Any]:
    """A material with those of the textures that there are."""
    rough: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": _ROUGHNESS[name], "baseColorFactor": [1, 1, 1, 1]}
    if "baseColorTexture" in textures:
        rough["baseColorTexture"] = textures["baseColorTexture"]
    material: dict[str, Any] = {"name": name, "pbrMetallicRoughness": rough}
    return material | ({"normalTexture": textures["normalTexture"]} if "normalTexture" in textures else {})


def _by_material(surface: Surface, solid: BoolArray) -> list[tuple[str, IntArray]]:
    """Names of materials and the `solid` faces (n,) of each; one where the surface tells none."""
    if surface.materials is None:
        return [("surface", np.flatnonzero(solid))]
    found = [(name, np.flatnonzero(solid & (surface.materials == number))) for number, name in enumerate(MATERIALS)]
    return [(name, chosen) for name, chosen in found if len(chosen)]


def _add_texture(document: Document, name: str, image: ByteArray, quality: int) -> dict[str, int]:
    """Embed a picture (H, W, 3); what a material says to use it."""
    data, kind = encode_texture(image, quality)
    document.json.setdefault("images", []).append({"name": name, "mimeType": kind, "bufferView": document.view(data)})
    document.json["samplers"] = [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}]
    document.json.setdefault("textures", []).append({"source": len(document.json["images"]) - 1, "sampler": 0})
    return {"index": len(document.json["textures"]) - 1}


def _add_expressions(mesh: dict[str, Any], document: Document, expressions: ShadedTargets, source: IntArray) -> None:
    """Give a mesh, whose vertices (N,) are those of the surface in `source`, a morph target for each expression."""
    order = np.argsort(source, kind="stable")
    targets = []
    for name in expressions.face.names:
        vertices, offsets, turns = expressions(name)
        first, last = (np.searchsorted(source[order], vertices, side=side) for side in ("left", "right"))
        copies = np.repeat(np.arange(len(vertices)), last - first)
        at = np.repeat(first - np.concatenate([[0], np.cumsum(last - first)[:-1]]), last - first) + np.arange(len(copies))
        ascending = np.argsort(order[at])
        places, copies = order[at][ascending], copies[ascending]
        target = {}
        for attribute, values in (("POSITION", offsets[copies]), ("NORMAL", turns[copies])):
            own = np.abs(values).max(axis=1) > 0
            if own.any():
                target[attribute] = document.sparse_accessor(len(source), places[own], values[own])
            else:
                target[attribute] = document.sparse_accessor(len(source), np.zeros(1, np.int64), np.zeros((1, 3)))
        targets.append(target)
    for primitive in mesh["primitives"]:
        primitive["targets"] = targets
    mesh["weights"] = [0.0] * len(targets)
    mesh["extras"] = {"targetNames": list(expressions.face.names)}
