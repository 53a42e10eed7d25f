"""Characters as binary glTF 2.0, skinned or with morph targets."""

from __future__ import annotations

import json
import os
import struct
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.characters import (
    Clips,
    ShadedTargets,
    Strengths,
    check_clips,
    encode_texture,
    linear_colors,
    parent_from_bone,
    strength_tables,
)
from a2v.geometry.mesh import vertex_normals
from a2v.io import atomic_path
from a2v.kinematics import rotmat_to_quat
from a2v.kinematics.resample import continuous
from a2v.types import Body, Character, FloatArray, IntArray, Surface
from a2v.version import __version__

MAX_MORPH_BYTES = 2 << 30

_ARRAY_BUFFER, _ELEMENT_BUFFER = 34962, 34963
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_COMPONENTS = {np.dtype(np.float32): 5126, np.dtype(np.uint32): 5125, np.dtype(np.uint16): 5123, np.dtype(np.uint8): 5121}


class Document:
    """A glTF document under construction: JSON plus one binary buffer."""

    def __init__(self, name: str):
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"a2v {__version__}"},
            "scene": 0,
            "scenes": [{"name": name, "nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
            "materials": [],
        }
        self.blob = bytearray()

    def view(self, data: bytes, target: int | None = None) -> int:
        """Append bytes as a buffer view; its index."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        entry: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)}
        if target is not None:
            entry["target"] = target
        self.blob += data
        self.json["bufferViews"].append(entry)
        return len(self.json["bufferViews"]) - 1

    def accessor(self, array: np.ndarray, *, target: int | None = None, bounds: bool = False, normalized: bool = False) -> int:
        """Append an array (N, ...) of a component type that glTF knows; the index of its accessor."""
        array = np.ascontiguousarray(array)
        flat = array.reshape(len(array), -1)
        entry: dict[str, Any] = {
            "bufferView": self.view(array.tobytes(), target),
            "componentType": _COMPONENTS[array.dtype],
            "count": len(array),
            "type": _TYPES[flat.shape[1]],
        }
        if normalized:
            entry["normalized"] = True
        if bounds:
            entry["min"], entry["max"] = flat.min(axis=0).tolist(), flat.max(axis=0).tolist()
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def sparse_accessor(self, count: int, indices: IntArray, values: FloatArray) -> int:
        """Append vectors (count, 3) that are zero but for `values` (n, 3) float32 at ascending `indices` (n,), n >= 1; the accessor's index."""
        values = np.ascontiguousarray(values, np.float32)
        whole = np.concatenate([values, np.zeros((int(len(values) < count), 3), np.float32)])
        entry = {
            "componentType": _COMPONENTS[np.dtype(np.float32)],
            "count": count,
            "type": "VEC3",
            "min": whole.min(axis=0).tolist(),
            "max": whole.max(axis=0).tolist(),
            "sparse": {
                "count": len(indices),
                "indices": {
                    "bufferView": self.view(indices.astype(np.uint32).tobytes()),
                    "componentType": _COMPONENTS[np.dtype(np.uint32)],
                },
                "values": {"bufferView": self.view(values.tobytes())},
            },
        }
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def node(self, **values: Any) -> int:
        """Append a node; its index."""
        self.json["nodes"].append(values)
        return len(self.json["nodes"]) - 1

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file, atomically."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.json, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        with atomic_path(path) as temporary, open(temporary, "wb") as stream:
            stream.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(self.blob)))
            stream.write(struct.pack("<I4s", len(text), b"JSON") + text)
            stream.write(struct.pack("<I4s", len(self.blob), b"BIN\0"))
            stream.write(self.blob)


def write_glb(
    path: str | os.PathLike[str],
    character: Character,
    clips: Clips | None = None,
    *,
    name: str = "character",
    jpeg_quality: int = 92,
    expressions: Strengths | None = None,
) -> None:
    """Write a textured (or vertex-coloured), skinned and animated glTF 2.0 binary; expressions are morph targets.

    The mesh stands in the bind pose (the photo's); every clip is one animation: rotations of the bones that move, the root's
    path, one sampler of keys a frame, linear interpolation.

    Parameters
    ----------
    path : path
        Written atomically.
    character : Character
    clips : Clips or None
    name : str
        Name of the scene's root.
    jpeg_quality : int
        Quality of the embedded texture, 1 to 100; 0 embeds PNG.
    expressions : Strengths or None
        What the face does in the clips.

    Raises
    ------
    InputError
        A clip has the wrong shape, is not finite or has no frames; unknown expressions.
    """
    document = skinned_document(character, clips, name=name, jpeg_quality=jpeg_quality)
    _animate_face(document, character, clips or {}, expressions or {})
    document.write(path)


def _animate_face(document: Document, character: Character, clips: Clips, expressions: Strengths) -> None:
    """Add the strengths of expressions to the animations of a `skinned_document`."""
    tables = strength_tables(character.surface.face, clips, expressions)
    for animation in document.json.get("animations", []):
        if animation["name"] not in tables:
            continue
        table = tables[animation["name"]]
        times = document.accessor((np.arange(len(table)) / clips[animation["name"]][1]).astype(np.float32), bounds=True)
        animation["samplers"].append({"input": times, "output": document.accessor(table.reshape(-1)), "interpolation": "LINEAR"})
        target = {"node": len(character.body.bone_names), "path": "weights"}
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})


def skinned_document(character: Character, clips: Clips | None, *, name: str, jpeg_quality: int) -> Document:
    """What `write_glb` writes: nodes 0 to B - 1 are the bones in their order, the next one is the skinned mesh."""
    body = character.body
    checked = check_clips(clips, len(body.bone_names))
    document = Document(name)
    mesh = _add_mesh(document, character, name, jpeg_quality)
    bind = body.bone_transforms.astype(np.float64)
    local = parent_from_bone(bind[None], body.bone_parents)[0]
    roots = add_bones(document, body, local)
    inverse = np.linalg.inv(bind)
    inverse[:, 3] = [0, 0, 0, 1]
    document.json["skins"] = [
        {
            "name": body.model,
            "joints": list(range(len(bind))),
            "skeleton": roots[0],
            "inverseBindMatrices": document.accessor(np.swapaxes(inverse, 1, 2).astype(np.float32).reshape(len(bind), 16)),
        }
    ]
    skinned = document.node(name=name, mesh=mesh, skin=0)
    document.json["scenes"][0]["nodes"] = [*roots, skinned]
    if checked:
        document.json["animations"] = [add_animation(document, key, *clip, body.bone_parents, local) for key, clip in checked.items()]
    return document


def add_bones(document: Document, body: Body, local: FloatArray) -> list[int]:
    """Make a node of every bone, in their order from node 0 on, at its place `local` (B, 4, 4) in its parent; returns the roots."""
    children: list[list[int]] = [[] for _ in body.bone_names]
    for bone, parent in enumerate(body.bone_parents.tolist()):
        if parent >= 0:
            children[parent].append(bone)
    for bone, name in enumerate(body.bone_names):
        values: dict[str, Any] = {
            "name": name,
            "translation": _floats(local[bone, :3, 3]),
            "rotation": _floats(_xyzw(local[bone : bone + 1, :3, :3])[0]),
        }
        if children[bone]:
            values["children"] = children[bone]
        document.node(**values)
    return [bone for bone, parent in enumerate(body.bone_parents.tolist()) if parent < 0]


def write_morph_glb(
    path: str | os.PathLike[str],
    surface: Surface,
    frames: FloatArray,
    fps: float,
    *,
    name: str = "character",
    clip: str = "action",
    jpeg_quality: int = 92,
) -> None:
    """Write the exact deformation as a glTF 2.0 binary with one morph target a frame (no bones).

    Parameters
    ----------
    path : path
        Written atomically.
    surface : Surface
        Faces, colours and the base shape.
    frames : (T, V, 3) float
        Vertices of every frame, metres (such as `ArapDeformer`'s).
    fps : float

    Raises
    ------
    InputError
        Wrong shape, not finite, or more than 2 GiB (12 bytes a vertex and frame).
    """
    frames = np.asarray(frames, dtype=np.float32)
    if frames.ndim != 3 or frames.shape[1:] != surface.vertices.shape or len(frames) == 0 or not np.isfinite(frames).all():
        raise InputError(f"frames have shape {frames.shape}; expected (T, {len(surface.vertices)}, 3) finite numbers")
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"fps is {fps}; expected a positive number")
    if frames.nbytes > MAX_MORPH_BYTES:
        raise InputError(
            f"{len(frames)} frames of {frames.shape[1]} vertices need {frames.nbytes >> 20} MiB; use fewer frames or a smaller mesh"
        )
    document = Document(name)
    source, _, _ = _corners(surface)
    mesh = _add_mesh(document, surface, name, jpeg_quality)
    base = surface.vertices[source]
    targets = [{"POSITION": document.accessor(frame[source] - base, target=_ARRAY_BUFFER, bounds=True)} for frame in frames]
    document.json["meshes"][mesh]["primitives"][0]["targets"] = targets
    document.json["meshes"][mesh]["weights"] = [0.0] * len(frames)
    node = document.node(name=name, mesh=mesh)
    document.json["scenes"][0]["nodes"] = [node]
    times = document.accessor((np.arange(len(frames)) / fps).astype(np.float32), bounds=True)
    weights = document.accessor(np.eye(len(frames), dtype=np.float32).reshape(-1))
    document.json["animations"] = [
        {
            "name": clip,
            "samplers": [{"input": times, "output": weights, "interpolation": "LINEAR"}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "weights"}}],
        }
    ]
    document.write(path)


def _corners(surface: Surface) -> tuple[IntArray, IntArray, FloatArray | None]:
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


def _add_mesh(document: Document, thing: Character | Surface, name: str, quality: int) -> int:
    """Make a mesh with its material, and skinning weights for a character; returns its index."""
    surface = thing.surface if isinstance(thing, Character) else thing
    source, faces, coordinates = _corners(surface)
    corners = surface.vertices.astype(np.float64)[surface.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    faces = faces[(area > 0) | (np.arange(len(faces)) == 0)]
    normals = vertex_normals(surface.vertices.astype(np.float64), surface.faces.astype(np.int64))
    normals[np.linalg.norm(normals, axis=1) < 0.5] = [0, 1, 0]
    attributes = {
        "POSITION": document.accessor(surface.vertices[source].astype(np.float32), target=_ARRAY_BUFFER, bounds=True),
        "NORMAL": document.accessor(normals[source].astype(np.float32), target=_ARRAY_BUFFER),
    }
    material: dict[str, Any] = {
        "name": "surface",
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.9, "baseColorFactor": [1, 1, 1, 1]},
    }
    if coordinates is not None and surface.texture is not None:
        attributes["TEXCOORD_0"] = document.accessor(coordinates, target=_ARRAY_BUFFER)
        data, kind = encode_texture(surface.texture, quality)
        document.json["images"] = [{"name": "texture", "mimeType": kind, "bufferView": document.view(data)}]
        document.json["samplers"] = [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}]
        document.json["textures"] = [{"source": 0, "sampler": 0}]
        material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    else:
        linear = linear_colors(surface.colors[source])  # COLOR_0 is linear
        levels = np.concatenate([np.round(linear * 65535), np.full((len(linear), 1), 65535)], axis=1).astype(np.uint16)
        attributes["COLOR_0"] = document.accessor(levels, target=_ARRAY_BUFFER, normalized=True)
    if isinstance(thing, Character):
        bones, weights = thing.bones[source].copy(), thing.weights[source].astype(np.float32)
        weights = weights / weights.sum(axis=1, keepdims=True)
        bones[weights == 0] = 0
        kind_of = np.uint8 if len(thing.body.bone_names) <= 256 else np.uint16
        attributes["JOINTS_0"] = document.accessor(bones.astype(kind_of), target=_ARRAY_BUFFER)
        attributes["WEIGHTS_0"] = document.accessor(weights, target=_ARRAY_BUFFER)
    document.json["materials"].append(material)
    indices = document.accessor(faces.astype(np.uint32).reshape(-1), target=_ELEMENT_BUFFER)
    document.json["meshes"].append({"name": name, "primitives": [{"attributes": attributes, "indices": indices, "material": 0, "mode": 4}]})
    if isinstance(thing, Character) and surface.face is not None:
        _add_expressions(document.json["meshes"][-1], document, ShadedTargets(surface), source)
    return len(document.json["meshes"]) - 1


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
    mesh["primitives"][0]["targets"] = targets
    mesh["weights"] = [0.0] * len(targets)
    mesh["extras"] = {"targetNames": list(expressions.face.names)}


def add_animation(document: Document, name: str, transforms: FloatArray, fps: float, parents: IntArray, bind: FloatArray) -> dict[str, Any]:
    """An animation of bone transforms (T, B, 4, 4): channels for bones that leave their place `bind` (B, 4, 4) in their parent."""
    local = parent_from_bone(transforms, parents)
    times = document.accessor((np.arange(len(local)) / fps).astype(np.float32), bounds=True)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []

    def channel(bone: int, path: str, values: FloatArray) -> None:
        samplers.append({"input": times, "output": document.accessor(values.astype(np.float32)), "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": bone, "path": path}})

    for bone in range(local.shape[1]):
        rotmats = local[:, bone, :3, :3]
        if parents[bone] < 0 or np.abs(rotmats - bind[bone, :3, :3]).max() > 1e-6:
            channel(bone, "rotation", continuous(_xyzw(rotmats)))
        if parents[bone] < 0 or np.abs(local[:, bone, :3, 3] - bind[bone, :3, 3]).max() > 1e-6:
            channel(bone, "translation", local[:, bone, :3, 3])
    return {"name": name, "samplers": samplers, "channels": channels}


def _xyzw(rotmats: FloatArray) -> FloatArray:
    """Quaternions (..., 4) in glTF's order of rotation matrices (..., 3, 3)."""
    quats = rotmat_to_quat(rotmats.astype(np.float64))
    ordered: FloatArray = quats[..., [1, 2, 3, 0]]
    return ordered


def _floats(values: FloatArray) -> list[float]:
    return [float(value) for value in values.astype(np.float32)]
