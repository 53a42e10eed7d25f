"""Write motions as GLB or FBX of a skeleton without a person: an octahedron on every bone, so that
programs show it and take it for a skeleton."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.formats.bvh.writing import rig_of_motion
from a2v.formats.fbx import write_fbx
from a2v.formats.gltf import write_glb
from a2v.types import Body, Character, FloatArray, Motion, Surface

_WIDTH = 0.1
"""Width of a bone's octahedron, in lengths of the bone."""
_LEAST = 0.02
"""Length that bones without one are drawn with, meters."""
_GRAY = 0.6
_CORNERS = ((1, 0), (0, 1), (-1, 0), (0, -1))
_FACES = [
    *((0, 2 + (k + 1) % 4, 2 + k) for k in range(4)),
    *((1, 2 + k, 2 + (k + 1) % 4) for k in range(4)),
]


def write_skeleton(path: str | os.PathLike[str], motion: Motion) -> None:
    """Write one clip as ``.glb`` or ``.fbx`` of its skeleton, with exact joint positions.

    As in BVH, joints whose children turn against each other have helpers (``<child>_turn``) of zero
    length, which `read_moving_bones` removes again.

    Raises
    ------
    InputError
        A batch, or a path that cannot be written.
    MissingDependencyError, A2VError
        See `a2v.formats.fbx.write_fbx`.
    """
    if motion.batch:
        raise InputError(
            f"expected one clip; this Motion is a batch of shape {motion.batch}: index it first"
        )
    body, transforms = rig_of_motion(motion)
    write_rig_skeleton(path, body, transforms, motion.fps, name=motion.action or "motion")


def write_rig_skeleton(
    path: str | os.PathLike[str],
    body: Body,
    transforms: FloatArray,
    fps: float,
    *,
    name: str = "motion",
) -> None:
    """Write the motion of a rig's bones as ``.glb`` or ``.fbx`` without the rig's mesh.

    Parameters
    ----------
    path : path
        Written atomically.
    body : Body
        Bones and their rest pose.
    transforms : (T, B, 4, 4) float
        World from bone, meters.
    fps : float
    name : str
        Name of the animation.

    Raises
    ------
    InputError, MissingDependencyError, A2VError
        As `write_glb` and `write_fbx`.
    """
    write = write_fbx if Path(path).suffix.lower() == ".fbx" else write_glb
    write(path, drawn_bones(body), {name: (transforms, fps)})


def drawn_bones(body: Body) -> Character:
    """Return octahedra on the bones of a body at rest, each moved by its bone."""
    heads = body.rest_transforms[:, :3, 3].astype(np.float64)
    tails = body.bone_tails.astype(np.float64)
    points = []
    for bone, (head, tail) in enumerate(zip(heads, tails, strict=True)):
        below = heads[body.bone_parents == bone]
        way = (below if len(below) else tail[None]) - head
        way = way.mean(axis=0) if np.linalg.norm(way.mean(axis=0)) > 1e-3 else way[0]
        length = float(np.linalg.norm(way))
        way = way / length if length > 1e-3 else np.array([0.0, 1, 0])
        length = max(length, _LEAST)
        side = np.cross(way, [1.0, 0, 0] if abs(way[0]) < 0.8 else [0.0, 0, 1])
        side /= np.linalg.norm(side)
        sides = np.asarray(_CORNERS) @ np.stack([side, np.cross(way, side)])
        points.append(head + length * np.concatenate([[0 * way, way], 0.2 * way + _WIDTH * sides]))
    count, each = len(heads), len(_CORNERS) + 2
    vertices = np.concatenate(points).astype(np.float32)
    faces = (np.asarray(_FACES) + each * np.arange(count)[:, None, None]).reshape(-1, 3)
    bones = np.zeros((len(vertices), 4), np.int32)
    bones[:, 0] = np.repeat(np.arange(count), each)
    weights = np.zeros((len(vertices), 4), np.float32)
    weights[:, 0] = 1
    return Character(
        surface=Surface(
            vertices=vertices,
            faces=faces.astype(np.int32),
            colors=np.full(vertices.shape, _GRAY, np.float32),
        ),
        body=body,
        weights=weights,
        bones=bones,
        anchors=np.zeros(len(vertices), np.int32),
        parts=np.zeros(len(vertices), np.int8),
    )
