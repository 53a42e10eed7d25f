"""Give the meshes of a glTF without bones a skeleton and skins."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.formats.gltf.bounds import MAX_VERTICES
from a2v.formats.gltf.compression import plain
from a2v.formats.gltf.document import ARRAY_BUFFER, Document, pack_glb
from a2v.formats.gltf.reading import Gltf, read_glb
from a2v.io import atomic_path, reading
from a2v.types import FloatArray, IntArray


@dataclass(frozen=True)
class Bones:
    """A skeleton in the axes and units of a file: `names`, `parents` (B,), parents first, and rigid
    transforms (B, 4, 4), world from bone."""

    names: tuple[str, ...]
    parents: IntArray
    transforms: FloatArray


@dataclass(frozen=True)
class _Part:
    """A primitive of a node's mesh: its node and place there, and vertices (n, 3) in the world."""

    node: int
    number: int
    vertices: FloatArray


def rig_glb(
    path: str | os.PathLike[str],
    target: str | os.PathLike[str],
    rig: Callable[[FloatArray], tuple[Bones, FloatArray, IntArray]],
    *,
    name: str | os.PathLike[str] | None = None,
) -> None:
    """Write a glTF whose meshes have no skin with a skeleton and skins, atomically.

    Parameters
    ----------
    path : path
        Messages call it `name`.
    target : path
        A ``.glb``.
    rig : function of vertices (n, 3) float64
        All vertices in the world, in the file's axes and units. Returns the bones, and weights (n,
        4), rows with sum 1, with their bones (n, 4).

    Raises
    ------
    InputError
        The file is broken or too large, or has no meshes; or `rig` does not take them.
    """
    file = read_glb(path)
    file = plain(Gltf(Path(name or path), file.json, file.binary))
    with reading(file.path, "mesh that can be read", "a person's mesh in a glTF 2.0"):
        world, _ = file.node_matrices()
        parts = _parts(file, world)
        bones, weights, owners = rig(np.concatenate([part.vertices for part in parts]))
        made = _rigged(file, world, parts, bones, weights, owners)
    with atomic_path(target) as temporary:
        temporary.write_bytes(pack_glb(made.json, bytes(made.blob)))


def _parts(file: Gltf, world: FloatArray) -> list[_Part]:
    """Return every primitive with triangles."""
    parts, count = list[_Part](), 0
    for node, entry in enumerate(file.items("nodes")):
        if "mesh" not in entry:
            continue
        primitives = file.item("meshes", entry["mesh"]).get("primitives")
        for number, primitive in enumerate(primitives if isinstance(primitives, list) else []):
            attributes = primitive.get("attributes") if isinstance(primitive, dict) else None
            if not isinstance(attributes, dict) or "POSITION" not in attributes:
                continue
            count += file.count(attributes["POSITION"])
            if count > MAX_VERTICES:
                raise file.fail(f"has {count} vertices; expected at most {MAX_VERTICES}")
            local = file.accessor(attributes["POSITION"], "VEC3").astype(np.float64)
            matrix = world[node]
            parts.append(_Part(node, number, local @ matrix[:3, :3].T + matrix[:3, 3]))
    if count < 100:
        raise file.expect(f"has meshes of {count} vertices", "a person's mesh")
    if not all(np.isfinite(part.vertices).all() for part in parts):
        raise file.fail("has vertex positions that are not finite")
    return parts


def _rigged(
    file: Gltf,
    world: FloatArray,
    parts: list[_Part],
    bones: Bones,
    weights: FloatArray,
    owners: IntArray,
) -> Document:
    document = Document("")
    document.blob = bytearray(file.binary)
    kinds = ("nodes", "meshes", "accessors", "bufferViews", "skins")
    tree = document.json = file.json | {kind: [*file.items(kind)] for kind in kinds}
    first, roots = len(tree["nodes"]), []
    for bone, (label, parent) in enumerate(zip(bones.names, bones.parents.tolist(), strict=True)):
        local = bones.transforms[bone]
        if parent >= 0:
            local = np.linalg.inv(bones.transforms[parent]) @ local
            above = tree["nodes"][first + parent]
            above.setdefault("children", []).append(first + bone)
        else:
            roots.append(first + bone)
        node = file.without_matrix({"matrix": local.T.ravel().tolist()})
        tree["nodes"].append({"name": label, **node})
    scenes = [dict(scene) for scene in file.items("scenes")] or [{"nodes": []}]
    place = tree.get("scene", 0)
    place = place if isinstance(place, int) and 0 <= place < len(scenes) else 0
    scenes[place]["nodes"] = [*scenes[place].get("nodes", []), *roots]
    tree["scenes"], tree["scene"] = scenes, place
    at = 0
    inverse = np.linalg.inv(bones.transforms)
    skins: dict[int, int] = {}
    for part in parts:
        count = len(part.vertices)
        own, shares = owners[at : at + count], weights[at : at + count]
        at += count
        if part.node not in skins:
            # every node keeps its vertices, so its own place is part of its skin's matrices
            matrices = np.swapaxes(inverse @ world[part.node], 1, 2).astype(np.float32)
            matrices[:, :3, 3], matrices[:, 3, 3] = 0, 1
            tree["skins"].append(
                {
                    "joints": [first + bone for bone in range(len(bones.names))],
                    "inverseBindMatrices": document.accessor(matrices.reshape(-1, 16)),
                }
            )
            skins[part.node] = len(tree["skins"]) - 1
            entry = tree["nodes"][part.node]
            mesh: dict[str, Any] = dict(tree["meshes"][entry["mesh"]])
            mesh["primitives"] = [
                {**primitive, "attributes": dict(primitive.get("attributes", {}))}
                for primitive in mesh["primitives"]
            ]
            tree["meshes"].append(mesh)
            tree["nodes"][part.node] = entry | {
                "mesh": len(tree["meshes"]) - 1,
                "skin": skins[part.node],
            }
        entry = tree["nodes"][part.node]
        attributes = tree["meshes"][entry["mesh"]]["primitives"][part.number]["attributes"]
        attributes["JOINTS_0"] = document.accessor(own.astype(np.uint16), target=ARRAY_BUFFER)
        attributes["WEIGHTS_0"] = document.accessor(shares.astype(np.float32), target=ARRAY_BUFFER)
    tree["buffers"] = [{"byteLength": len(document.blob)}]
    return document
