"""Reading of the VALID avatars.

The files are glTF 2.0 with one or more skinned meshes (body, eyes, hair) that share one skeleton. A
vertex of a skinned mesh is ``sum_k w_k * joint_k * inverse_bind_k * v``; the node of the mesh
itself is ignored (glTF 2.0, section 3.7.3.3).
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.body.parts import PARTS
from a2v.errors import InputError
from a2v.formats.gltf import Gltf, read_glb
from a2v.formats.gltf.armatures import parents_among
from a2v.formats.gltf.bounds import MAX_JOINTS
from a2v.io import shorten
from a2v.lab.studio.avatars import Avatar, avatar_part
from a2v.types import ByteArray

MAX_VERTICES = 400_000
"""Largest number of vertices of all meshes together, and of their triangles. VALID's avatars have
at most 36,000."""
MAX_PARTS = 256
"""Largest number of skinned meshes, of skins and of materials."""
MAX_TEXELS = 4096 * 4096
"""Largest number of texels of all materials' pictures together."""
_GUTTER = (
    8  # pixels repeated around each tile of the atlas, so that filtering never mixes two materials
)


def list_avatars(folder: str | os.PathLike[str]) -> tuple[Path, ...]:
    """List the ``.glb`` files of a folder, sorted by name.

    Raises
    ------
    InputError
        The folder contains none.
    """
    found = tuple(sorted(Path(folder).glob("*.glb")))
    if not found:
        raise InputError(
            f"{folder} holds no .glb files; set A2V_DATA to the data folder that holds them in "
            "'avatars'"
        )
    return found


def load_avatar(path: str | os.PathLike[str]) -> Avatar:
    """Read a rigged avatar.

    Raises
    ------
    InputError
        The file is not a binary glTF 2.0 with a skinned, textured mesh, or is broken. The message
        names it.
    """
    gltf = read_glb(path)
    try:
        return _read_avatar(gltf)
    except InputError as error:
        message = str(error)
        raise error if str(gltf.path) in message else gltf.fail(message) from None
    except Exception as error:  # any error that a file of another meaning causes
        raise gltf.fail(f"is malformed ({type(error).__name__}: {shorten(error)})") from error


@dataclass
class _Merged:
    """What `_read_avatar` collects, with one entry per primitive."""

    influences: list[np.ndarray] = dataclasses.field(default_factory=list)
    weights: list[np.ndarray] = dataclasses.field(default_factory=list)
    bones: list[np.ndarray] = dataclasses.field(default_factory=list)
    faces: list[np.ndarray] = dataclasses.field(default_factory=list)
    corners: list[np.ndarray] = dataclasses.field(default_factory=list)
    materials: list[np.ndarray] = dataclasses.field(default_factory=list)
    mesh_ids: list[np.ndarray] = dataclasses.field(default_factory=list)
    mesh_names: list[str] = dataclasses.field(default_factory=list)
    vertices: int = 0
    corner_count: int = 0


def _read_avatar(gltf: Gltf) -> Avatar:
    world, node_parents = gltf.node_matrices()
    joints, parents = _joint_order(gltf, node_parents)
    slot = {node: index for index, node in enumerate(joints)}
    rest = world[joints]
    merged = _Merged()
    skinned = [node for node in gltf.items("nodes") if "mesh" in node and "skin" in node]
    if max(len(skinned), len(gltf.items("materials")), len(gltf.items("skins"))) > MAX_PARTS:
        raise gltf.fail(f"has more than {MAX_PARTS} skinned meshes, skins or materials")
    for node in skinned:
        skin = gltf.item("skins", node["skin"])
        chosen = np.array([slot[joint] for joint in gltf.joints(skin)])
        inverse_bind = (
            gltf.accessor(skin["inverseBindMatrices"], "MAT4")
            .reshape(-1, 4, 4)
            .transpose(0, 2, 1)
            .astype(np.float64)
        )
        if len(inverse_bind) < len(chosen):
            raise gltf.fail(
                f"skin {node['skin']} has {len(inverse_bind)} inverse bind matrices for "
                f"{len(chosen)} joints"
            )
        matrices = rest[chosen] @ inverse_bind[: len(chosen)]
        merged.mesh_names.append(str(node.get("name", f"mesh{node['mesh']}")))
        for primitive in gltf.item("meshes", node["mesh"])["primitives"]:
            _add_primitive(gltf, primitive, matrices, chosen, merged)
    if not merged.faces:
        raise gltf.fail("has no skinned mesh")
    texture, tiles = _atlas(gltf)
    materials = np.concatenate(merged.materials)
    weights = np.concatenate(merged.weights)
    bones = np.concatenate(merged.bones)
    names = tuple(str(gltf.items("nodes")[node].get("name", f"joint{node}")) for node in joints)
    part_of = np.array([PARTS.index(avatar_part(name)) for name in names], np.int8)
    rigid = rest.copy()
    rigid[:, :3, :3] /= np.linalg.norm(rest[:, :3, :3], axis=1, keepdims=True)
    return Avatar(
        name=gltf.path.stem,
        influences=np.concatenate(merged.influences).astype(np.float32),
        weights=weights.astype(np.float32),
        bones=bones.astype(np.int32),
        faces=np.concatenate(merged.faces).astype(np.int32),
        uv=to_atlas(np.concatenate(merged.corners), tiles[materials]).astype(np.float32),
        texture=texture,
        materials=materials.astype(np.int32),
        material_names=tuple(str(entry.get("name", "")) for entry in gltf.items("materials")),
        mesh_ids=np.concatenate(merged.mesh_ids).astype(np.int32),
        mesh_names=tuple(merged.mesh_names),
        bone_names=names,
        bone_parents=np.array(parents, np.int32),
        rest_transforms=rigid.astype(np.float32),
        parts=part_of[bones[np.arange(len(bones)), weights.argmax(axis=1)]],
    )


def _joint_order(gltf: Gltf, node_parents: list[int]) -> tuple[list[int], list[int]]:
    """Return the nodes that any skin uses, parents first, and each one's parent among them (-1 for
    the root)."""
    used = {joint for skin in gltf.items("skins") for joint in gltf.joints(skin)}
    if len(used) > MAX_JOINTS:
        raise gltf.fail(f"has {len(used)} joints; expected at most {MAX_JOINTS}")
    depth = {}
    for joint in used:
        steps, at = 0, node_parents[joint]
        while at >= 0:
            steps, at = steps + 1, node_parents[at]
        depth[joint] = steps
    first = [joint for skin in gltf.items("skins")[:1] for joint in gltf.joints(skin)]
    rank = {joint: index for index, joint in enumerate(first)}
    order = sorted(used, key=lambda joint: (depth[joint], rank.get(joint, len(rank)), joint))
    return order, parents_among(tuple(order), node_parents).tolist()


def _add_primitive(
    gltf: Gltf,
    primitive: dict[str, object],
    matrices: np.ndarray,
    joints: np.ndarray,
    merged: _Merged,
) -> None:
    if primitive.get("mode", 4) != 4:
        raise gltf.fail("has a primitive that is no triangle list")
    attributes = primitive["attributes"]
    if not isinstance(attributes, dict):
        raise gltf.fail("has a primitive without attributes")
    if missing := [
        name
        for name in ("POSITION", "TEXCOORD_0", "JOINTS_0", "WEIGHTS_0")
        if name not in attributes
    ]:
        raise gltf.fail(f"has a mesh without {missing[0]}")
    positions, uv, local, weights = (
        gltf.accessor(attributes[name], kind)
        for name, kind in (
            ("POSITION", "VEC3"),
            ("TEXCOORD_0", "VEC2"),
            ("JOINTS_0", "VEC4"),
            ("WEIGHTS_0", "VEC4"),
        )
    )
    count = len(positions)
    indices = (
        gltf.accessor(primitive["indices"], "SCALAR").ravel()
        if "indices" in primitive
        else np.arange(count)
    )
    merged.corner_count += len(indices)
    if merged.vertices + count > MAX_VERTICES or merged.corner_count > 3 * MAX_VERTICES:
        raise gltf.fail(f"has more than {MAX_VERTICES} vertices or triangles")
    if len(merged.faces) >= MAX_PARTS:
        raise gltf.fail(f"has more than {MAX_PARTS} primitives")
    if not count == len(uv) == len(local) == len(weights):
        raise gltf.fail("has a mesh whose attributes differ in length")
    if (
        len(indices) % 3
        or (len(indices) and indices.max() >= count)
        or local.max(initial=0) >= len(joints)
    ):
        raise gltf.fail("has indices beyond its vertices or joints")
    total = weights.sum(axis=1, dtype=np.float64, keepdims=True)
    if not np.isfinite(positions).all() or not np.isfinite(uv).all() or not (total > 0).all():
        raise gltf.fail("has vertices that are not finite or belong to no joint")
    faces = indices.reshape(-1, 3).astype(np.int64)
    chosen = matrices[local.astype(np.int64)]
    points = positions.astype(np.float64)
    merged.influences.append(
        np.einsum("vkij,vj->vki", chosen[..., :3, :3], points) + chosen[..., :3, 3]
    )
    merged.weights.append(weights / total)
    merged.bones.append(joints[local.astype(np.int64)])
    merged.faces.append(faces + merged.vertices)
    merged.corners.append(uv.astype(np.float64)[faces])
    material = primitive.get("material", 0)
    gltf.item("materials", material)
    merged.materials.append(np.full(len(faces), material))
    merged.mesh_ids.append(np.full(len(faces), len(merged.mesh_names) - 1))
    merged.vertices += count


def _atlas(gltf: Gltf) -> tuple[ByteArray, np.ndarray]:
    """Pack the materials' textures into an atlas, and return each material's tile (left, bottom,
    width, height) in uv."""
    images = []
    for material in gltf.items("materials"):
        shading = material.get("pbrMetallicRoughness", {})
        factor = np.asarray(shading.get("baseColorFactor", (1, 1, 1, 1)), np.float64)[:3]
        if "baseColorTexture" in shading:
            image: np.ndarray = (
                gltf.image(
                    gltf.item("textures", shading["baseColorTexture"]["index"])["source"]
                ).astype(np.float64)
                / 255
            )
        else:
            image = np.ones((16, 16, 3))
        # Factors are linear. Multiplying sRGB by their sRGB value is exact for a pure power law,
        # and for factor 1.
        images.append(np.rint(255 * image * factor ** (1 / 2.2)).astype(np.uint8))
        if sum(image.shape[0] * image.shape[1] for image in images) > MAX_TEXELS:
            raise gltf.fail(f"has textures of more than {MAX_TEXELS >> 20} million pixels together")
    if not images:
        raise gltf.fail("has no materials")
    return pack_atlas(images)


def pack_atlas(images: Sequence[ByteArray]) -> tuple[ByteArray, np.ndarray]:
    """Pack pictures (h, w, 3) side by side, and return each one's tile (left, bottom, width,
    height) in uv.

    Their border pixels are repeated around them.
    """
    height = max(image.shape[0] for image in images)
    padded, tiles, left = [], [], 0
    for image in images:
        rows, columns = image.shape[:2]
        below = height - rows
        padded.append(
            np.pad(image, ((_GUTTER, _GUTTER + below), (_GUTTER, _GUTTER), (0, 0)), mode="edge")
        )
        tiles.append((left + _GUTTER, _GUTTER + below, columns, rows))
        left += columns + 2 * _GUTTER
    atlas = np.concatenate(padded, axis=1)
    return atlas, np.array(tiles, np.float64) / np.array(
        [left, height + 2 * _GUTTER] * 2, np.float64
    )


def to_atlas(corners: np.ndarray, tiles: np.ndarray) -> np.ndarray:
    """Map glTF texture coordinates (F, 3, 2; origin at the upper left) into tiles (F, 4), origin at
    the lower left."""
    whole = np.floor(corners.mean(axis=1, keepdims=True))  # a face wholly in a repeated tile
    inside = np.clip(corners - whole, 0.0, 1.0)
    inside[..., 1] = 1.0 - inside[..., 1]
    return np.asarray(tiles[:, None, :2] + inside * tiles[:, None, 2:])
