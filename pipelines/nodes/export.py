"""From a character and its motion to the files that animators' tools open."""

from __future__ import annotations

import tempfile
from pathlib import Path

from a2v.types import Body, Character
from pipelines.memo import memo
from pipelines.nodes.values import Blob, Poses
from pipelines.store import Ref, get, put


@memo()
def glb(character: Ref[Character], poses: Ref[Poses]) -> Ref[Blob]:
    """One binary glTF: textured, skinned, animated."""
    from a2v.formats.gltf import write_glb

    moves = get(poses, Poses)
    clip = moves.action or "motion"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "character.glb"
        write_glb(path, get(character, Character), {clip: (moves.bone_transforms, moves.fps)}, expressions={clip: moves.expressions})
        return put(Blob.of(path.read_bytes()))


@memo()
def still(character: Ref[Character]) -> Ref[Blob]:
    """One binary glTF in the photo's pose: textured and skinned."""
    from a2v.formats.gltf import write_glb

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "character.glb"
        write_glb(path, get(character, Character), {})
        return put(Blob.of(path.read_bytes()))


@memo()
def bvh(poses: Ref[Poses], body: Ref[Body]) -> Ref[Blob]:
    """The motion of the body's own rig as BVH."""
    from a2v.animation import rig_motion
    from a2v.formats.bvh import write_bvh

    moves = get(poses, Poses)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.bvh"
        write_bvh(path, rig_motion(moves.bone_transforms, get(body, Body), moves.fps))
        return put(Blob.of(path.read_bytes()))
