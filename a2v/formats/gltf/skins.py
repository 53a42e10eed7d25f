"""Read the skinned meshes of a glTF file in its pose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from a2v.formats.gltf.bounds import MAX_VERTICES, MAX_WEIGHTS
from a2v.formats.gltf.reading import Gltf
from a2v.types import FloatArray, IntArray


def read_skin(
    file: Gltf, world: FloatArray, owners: Mapping[int, int], bones: int
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Read the skinned meshes of a person in the pose and the units of the file: vertices (n, 3)
    float64, faces (f, 3) and weights (n, bones) float32. `owners` are the bones of the person by
    their nodes; skins without any of them are others'."""
    points, faces, weights = list[FloatArray](), list[IntArray](), list[FloatArray]()
    count = 0
    for node in file.items("nodes"):
        if "mesh" not in node or "skin" not in node:
            continue
        skin = file.item("skins", node["skin"])
        joints = file.joints(skin)
        if joints[0] not in owners:
            continue
        own = np.array([owners[joint] for joint in joints])
        matrices = world[joints] @ _inverse_bind(file, skin, len(joints))
        primitives = file.item("meshes", node["mesh"]).get("primitives")
        for primitive in primitives if isinstance(primitives, list) else []:
            attributes = primitive.get("attributes") if isinstance(primitive, dict) else None
            if (
                not isinstance(attributes, dict)
                or not {"POSITION", "JOINTS_0", "WEIGHTS_0"} <= attributes.keys()
            ):
                continue
            most = count + file.count(attributes["POSITION"])
            if most * bones > MAX_WEIGHTS or most > MAX_VERTICES:
                raise file.fail(
                    f"has {most} vertices and {bones} bones or more; expected at most "
                    f"{MAX_VERTICES} vertices, and a product of at most {MAX_WEIGHTS}"
                )
            made, (moving, shares) = _posed(file, attributes, matrices)
            points.append(made)
            faces.append(count + _triangles(file, primitive, len(made)))
            rows = np.zeros((len(made), bones), np.float32)
            np.add.at(rows, (np.arange(len(made))[:, None], own[moving]), shares.astype(np.float32))
            weights.append(rows)
            count += len(made)
    if not points or count < 3:
        raise file.fail("has no skinned mesh")
    every = np.concatenate(points)
    if not np.isfinite(every).all() or np.abs(every).max() > 1e6:
        raise file.fail("has vertex positions that are not finite, or too large")
    return every, np.concatenate(faces).astype(np.int32), np.concatenate(weights)


def _inverse_bind(file: Gltf, skin: dict[str, Any], joints: int) -> FloatArray:
    """Return the inverse bind matrices (joints, 4, 4) float64 of a skin."""
    if "inverseBindMatrices" not in skin:
        return np.tile(np.eye(4), (joints, 1, 1))
    given = file.accessor(skin["inverseBindMatrices"], "MAT4")
    if given.shape != (joints, 16):
        raise file.fail("does not have one inverse bind matrix per joint")
    return np.swapaxes(given.astype(np.float64).reshape(-1, 4, 4), 1, 2)


def _triangles(file: Gltf, primitive: dict[str, Any], count: int) -> IntArray:
    """Return the triangles (f, 3) of a primitive of `count` vertices; none for lines and strips."""
    if primitive.get("mode", 4) != 4:
        return np.zeros((0, 3), np.int64)
    indices = (
        file.accessor(primitive["indices"], "SCALAR").ravel()
        if "indices" in primitive
        else np.arange(count)
    )
    used = indices[: len(indices) // 3 * 3].astype(np.int64)
    if used.size and not 0 <= int(used.min()) <= int(used.max()) < count:
        raise file.fail("has triangles that refer to missing vertices")
    return used.reshape(-1, 3)


def _posed(
    file: Gltf, attributes: Mapping[str, Any], matrices: FloatArray
) -> tuple[FloatArray, tuple[IntArray, FloatArray]]:
    """Return the vertices (n, 3) under the joints' matrices, and the joints and weights (n, 4) of
    each."""
    vertices, joints, weights = (
        file.accessor(attributes[name], kind)
        for name, kind in (("POSITION", "VEC3"), ("JOINTS_0", "VEC4"), ("WEIGHTS_0", "VEC4"))
    )
    if not len(vertices) == len(joints) == len(weights):
        raise file.fail("has a skinned mesh whose positions, joints and weights differ in number")
    vertices, joints, weights = (
        vertices.astype(np.float64),
        joints.astype(np.int64),
        weights.astype(np.float64),
    )
    if joints.size and not 0 <= int(joints.min()) <= int(joints.max()) < len(matrices):
        raise file.fail("has vertices that follow joints missing in the skin")
    total = weights.sum(axis=1, keepdims=True)
    weights = np.where(total > 1e-6, weights / np.maximum(total, 1e-6), [1.0, 0.0, 0.0, 0.0])
    made = np.zeros((len(vertices), 3))
    for column in range(4):
        chosen = matrices[joints[:, column]]
        made += weights[:, column, None] * (
            np.einsum("nab,nb->na", chosen[:, :3, :3], vertices) + chosen[:, :3, 3]
        )
    return made, (joints, weights)
