"""Write characters as binary glTF 2.0, skinned or with morph targets."""

from __future__ import annotations

import os
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.characters import (
    Clips,
    Strengths,
    check_clips,
    parent_from_bone,
    strength_tables,
)
from a2v.formats.gltf.document import ARRAY_BUFFER, Document
from a2v.formats.gltf.mesh import add_mesh, split_corners
from a2v.kinematics import rotmat_to_quat
from a2v.kinematics.resample import continuous
from a2v.props import HIDDEN, Props
from a2v.types import Body, Character, FloatArray, IntArray, Surface

MAX_MORPH_BYTES = 2 << 30

ARMATURES: Mapping[str, str] = MappingProxyType({"talkinghead": "Armature"})
"""By rig: the node that its programs expect above all bones and meshes. They also expect one mesh
per material."""


def write_glb(
    path: str | os.PathLike[str],
    character: Character,
    clips: Clips | None = None,
    *,
    name: str = "character",
    jpeg_quality: int = 92,
    expressions: Strengths | None = None,
    props: Props | None = None,
) -> None:
    """Write a textured (or vertex-colored), skinned and animated glTF 2.0 binary; expressions are
    morph targets.

    The mesh is in the bind pose (the photo's). Every clip is one animation with rotations of the
    moving bones and the root's path, one key per frame, linear interpolation.

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
        Strengths of the face's expressions in the clips.
    props : Props or None
        Solids in the scene: each has a mesh and a node with its name.

    Raises
    ------
    InputError
        A clip has the wrong shape, is not finite or has no frames; unknown expressions.
    """
    document = skinned_document(character, clips, name=name, jpeg_quality=jpeg_quality)
    _animate_face(document, character, clips or {}, expressions or {})
    if props is not None:
        _add_props(document, props, clips or {})
    document.write(path)


def _add_props(document: Document, props: Props, clips: Clips) -> None:
    """Add a mesh and a node for each of the solids, and animations of those that move. A thing is
    not shown in the other clips."""
    for (name, solid), mover in zip(props.surfaces(), props.movers.tolist(), strict=True):
        node = document.node(name=name, mesh=add_mesh(document, solid, name, 92)[0])
        document.json["scenes"][0]["nodes"].append(node)
        for animation in document.json.get("animations", []) if mover >= 0 else []:
            frames, fps = clips[animation["name"]]
            own = props.clips[mover] in ("", animation["name"])
            moves = props.moves[: len(frames) if own else 1, mover].astype(np.float64)
            scale = np.linalg.norm(moves[:, :3, 0], axis=-1)
            keys = {
                "translation": moves[:, :3, 3],
                "rotation": continuous(_xyzw(moves[:, :3, :3] / scale[:, None, None])),
                "scale": np.repeat((scale if own else HIDDEN * scale)[:, None], 3, axis=1),
            }
            times = document.times(len(moves), fps)
            for path, values in keys.items():
                how = "STEP" if path == "scale" else "LINEAR"
                document.channel(animation, times, (node, path), values, interpolation=how)


def _animate_face(
    document: Document, character: Character, clips: Clips, expressions: Strengths
) -> None:
    """Add the strengths of expressions to the animations of a `skinned_document`."""
    tables = strength_tables(character.surface.face, clips, expressions)
    for animation in document.json.get("animations", []):
        if animation["name"] not in tables:
            continue
        table = tables[animation["name"]]
        times = document.times(len(table), clips[animation["name"]][1])
        for node, item in enumerate(document.json["nodes"]):
            names = (
                document.json["meshes"][item["mesh"]].get("extras", {}).get("targetNames")
                if "mesh" in item
                else None
            )
            if not names:
                continue
            assert character.surface.face is not None
            own = table[:, [character.surface.face.names.index(name) for name in names]]
            document.channel(animation, times, (node, "weights"), own.reshape(-1))


def skinned_document(
    character: Character, clips: Clips | None, *, name: str, jpeg_quality: int
) -> Document:
    """Make the document for `write_glb`: nodes 0 to B - 1 are the bones in their order, then the
    skinned meshes.

    There is one mesh, except for rigs of `ARMATURES`.
    """
    body = character.body
    checked = check_clips(clips, len(body.bone_names))
    document = Document(name)
    armature = ARMATURES.get(body.model, "")
    meshes = add_mesh(document, character, name, jpeg_quality, apart=bool(armature))
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
            "inverseBindMatrices": document.accessor(
                np.swapaxes(inverse, 1, 2).astype(np.float32).reshape(len(bind), 16)
            ),
        }
    ]
    skinned = [
        document.node(name=document.json["meshes"][mesh]["name"], mesh=mesh, skin=0)
        for mesh in meshes
    ]
    tops = [*roots, *skinned]
    document.json["scenes"][0]["nodes"] = (
        [document.node(name=armature, children=tops)] if armature else tops
    )
    if checked:
        document.json["animations"] = [
            add_animation(document, key, *clip, body.bone_parents, local)
            for key, clip in checked.items()
        ]
    return document


def add_bones(document: Document, body: Body, local: FloatArray) -> list[int]:
    """Make a node of every bone, in order from node 0 on, at its position `local` (B, 4, 4) in its
    parent; returns the roots."""
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
    """Write the exact deformation as a glTF 2.0 binary with one morph target per frame (no bones).

    Parameters
    ----------
    path : path
        Written atomically.
    surface : Surface
        Faces, colors and the base shape.
    frames : (T, V, 3) float
        Vertices of every frame, meters (such as `ArapDeformer`'s).
    fps : float

    Raises
    ------
    InputError
        Wrong shape, not finite, or more than 2 GiB (12 bytes per vertex and frame).
    """
    frames = np.asarray(frames, dtype=np.float32)
    if (
        frames.ndim != 3
        or frames.shape[1:] != surface.vertices.shape
        or len(frames) == 0
        or not np.isfinite(frames).all()
    ):
        raise InputError(
            f"frames have shape {frames.shape}; expected (T, {len(surface.vertices)}, 3) finite "
            "numbers"
        )
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"fps is {fps}; expected a positive number")
    if frames.nbytes > MAX_MORPH_BYTES:
        raise InputError(
            f"{len(frames)} frames of {frames.shape[1]} vertices need {frames.nbytes >> 20} MiB; "
            "use fewer frames or a smaller mesh"
        )
    document = Document(name)
    source, _, _ = split_corners(surface)
    (mesh,) = add_mesh(document, surface, name, jpeg_quality)
    base = surface.vertices[source]
    targets = [
        {"POSITION": document.accessor(frame[source] - base, target=ARRAY_BUFFER, bounds=True)}
        for frame in frames
    ]
    document.json["meshes"][mesh]["primitives"][0]["targets"] = targets
    document.json["meshes"][mesh]["weights"] = [0.0] * len(frames)
    node = document.node(name=name, mesh=mesh)
    document.json["scenes"][0]["nodes"] = [node]
    animation: dict[str, Any] = {"name": clip, "samplers": [], "channels": []}
    weights = np.eye(len(frames), dtype=np.float32).reshape(-1)
    document.channel(animation, document.times(len(frames), fps), (node, "weights"), weights)
    document.json["animations"] = [animation]
    document.write(path)


def add_animation(
    document: Document,
    name: str,
    transforms: FloatArray,
    fps: float,
    parents: IntArray,
    bind: FloatArray,
) -> dict[str, Any]:
    """Make an animation of bone transforms (T, B, 4, 4), with channels for bones that move relative
    to `bind` (B, 4, 4)."""
    local = parent_from_bone(transforms, parents)
    times = document.times(len(local), fps)
    made: dict[str, Any] = {"name": name, "samplers": [], "channels": []}
    for bone in range(local.shape[1]):
        rotmats = local[:, bone, :3, :3]
        if parents[bone] < 0 or np.abs(rotmats - bind[bone, :3, :3]).max() > 1e-6:
            document.channel(made, times, (bone, "rotation"), continuous(_xyzw(rotmats)))
        if parents[bone] < 0 or np.abs(local[:, bone, :3, 3] - bind[bone, :3, 3]).max() > 1e-6:
            document.channel(made, times, (bone, "translation"), local[:, bone, :3, 3])
    return made


def _xyzw(rotmats: FloatArray) -> FloatArray:
    """Return quaternions (..., 4) in glTF's order from rotation matrices (..., 3, 3)."""
    quats = rotmat_to_quat(rotmats.astype(np.float64))
    ordered: FloatArray = quats[..., [1, 2, 3, 0]]
    return ordered


def _floats(values: FloatArray) -> list[float]:
    return [float(value) for value in values.astype(np.float32)]
