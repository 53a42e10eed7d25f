"""Nodes from a character and its motion to files for animation programs."""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path

from a2v.animation import EngineSettings
from a2v.props import Props
from a2v.types import Body, Character
from pipelines.engine.memo import memo
from pipelines.engine.refs import Ref
from pipelines.engine.store import get, put
from pipelines.nodes.values import Blob, Poses


@memo()
def engine_character(character: Ref[Character], engine: EngineSettings) -> Ref[Character]:
    """Return the character for export: few triangles with a normal map and named materials."""
    from a2v.animation.engine import engine_ready
    from a2v.body.parts import on_parts
    from a2v.rendering.matter import materials_of

    person = engine_ready(get(character, Character), engine)
    if not engine.one_material:
        head, hands = (
            on_parts(person.parts, "head"),
            on_parts(person.parts, "left_hand", "right_hand"),
        )
        materials = materials_of(person.surface, head, hands)
        person = dataclasses.replace(
            person, surface=dataclasses.replace(person.surface, materials=materials)
        )
    return put(person)


@memo()
def glb(engine_character: Ref[Character], poses: Ref[Poses], props: Ref[Props]) -> Ref[Blob]:
    """Write one binary glTF: textured, skinned and animated, with climbed objects as own meshes."""
    from a2v.formats.gltf import write_glb

    moves = get(poses, Poses)
    clip = moves.action or "motion"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "character.glb"
        clips, faces = {clip: (moves.bone_transforms, moves.fps)}, {clip: moves.expressions}
        write_glb(
            path,
            get(engine_character, Character),
            clips,
            expressions=faces,
            props=get(props, Props),
        )
        return put(Blob.of(path.read_bytes()))


@memo()
def bvh(poses: Ref[Poses], body: Ref[Body]) -> Ref[Blob]:
    """Write the motion of the body's own rig as BVH."""
    from a2v.animation import rig_motion
    from a2v.formats.bvh import write_bvh

    moves = get(poses, Poses)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.bvh"
        write_bvh(path, rig_motion(moves.bone_transforms, get(body, Body), moves.fps))
        return put(Blob.of(path.read_bytes()))
