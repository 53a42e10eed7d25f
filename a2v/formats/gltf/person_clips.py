"""Add animations to the file of a person that was read: the only change to the file, whose binary
chunk is the beginning of the new one."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from a2v.formats.characters import Clips, check_clips
from a2v.formats.gltf.document import Document, pack_glb
from a2v.formats.gltf.people import Person
from a2v.formats.gltf.reading import decomposed
from a2v.io import atomic_path
from a2v.kinematics import rotmat_to_quat
from a2v.kinematics.resample import continuous
from a2v.types import FloatArray, IntArray


def write_person(path: str | os.PathLike[str], person: Person, clips: Clips) -> None:
    """Write the file of a person with further animations, atomically.

    Bones at and below `Person.mover` turn, and only `Person.mover` moves. Nodes above it and nodes
    that are not bones do not change; the matrix of a node that turns is written as its translation,
    rotation and scale, since glTF animates only these. Names that already exist in the
    file get a number.

    Parameters
    ----------
    path : path
    person : Person
    clips : Clips
        Clips of its body: bone transforms (T, B, 4, 4), world from bone, meters.

    Raises
    ------
    InputError
        A clip does not fit the body, or the file's animations or buffers are invalid.
    """
    file = person.file
    buffers = file.items("buffers")
    if len(buffers) != 1 or "uri" in buffers[0]:
        raise file.fail("stores its arrays outside of the file, or in several buffers")
    document = Document("")
    document.blob = bytearray(file.binary)
    kinds = ("nodes", "accessors", "bufferViews", "animations")
    grown = {kind: [*file.items(kind)] for kind in kinds}
    tree = document.json = file.json | grown | {"buffers": [dict(buffers[0])]}
    taken = {str(animation.get("name", "")) for animation in tree["animations"]}
    for name, (moves, fps) in check_clips(clips, len(person.body.bone_names)).items():
        free = next(
            title
            for title in (name, *(f"{name}_{number}" for number in range(2, len(taken) + 3)))
            if title not in taken
        )
        taken.add(free)
        tree["animations"].append(_animation(document, person, free, moves, fps))
    tree["buffers"][0]["byteLength"] = len(document.blob)
    with atomic_path(path) as temporary:
        temporary.write_bytes(pack_glb(tree, bytes(document.blob)))


def _animation(
    document: Document, person: Person, name: str, moves: FloatArray, fps: float
) -> dict[str, Any]:
    """Make an animation of transforms (T, B, 4, 4) of the body, in the file's own nodes."""
    body = person.body
    made = _Channels(document, person, moves, fps)
    below = {person.mover}
    for bone, parent in enumerate(body.bone_parents.tolist()):
        if parent in below:
            below.add(bone)
    moving = [
        bone
        for bone in range(len(person.nodes))
        if bone in below and not {bone, int(body.bone_parents[bone])} & set(person.odd)
    ]
    made.add(person.nodes, body.bone_parents, np.arange(len(person.nodes)), moving, {person.mover})
    for twin in person.twins:
        own = twin.armature
        roots = {bone for bone, parent in enumerate(own.parents.tolist()) if parent < 0}
        made.add(own.nodes, own.parents, twin.follows, [*range(len(own.nodes))], roots)
    return {"name": name, **made.animation}


class _Channels:
    """The channels of an animation of transforms (T, B, 4, 4) of a person's body."""

    def __init__(self, document: Document, person: Person, moves: FloatArray, fps: float) -> None:
        self._document, self._person, self._moves = document, person, moves
        self._rest = person.body.rest_transforms.astype(np.float64)
        self._world, self._above = person.file.node_matrices()
        self._times = document.times(len(moves), fps)
        self.animation: dict[str, Any] = {"samplers": [], "channels": []}

    def _channel(self, node: int, path: str, values: FloatArray) -> None:
        nodes = self._document.json["nodes"]
        if "matrix" in nodes[node]:
            nodes[node] = self._person.file.without_matrix(nodes[node])
        self._document.channel(self.animation, self._times, (node, path), values)

    def add(
        self,
        nodes: tuple[int, ...],
        parents: IntArray,
        follows: IntArray,
        moving: list[int],
        carried: set[int],
    ) -> None:
        """Add channels for the bones `moving` of an armature, each of which follows a bone of the
        body; those `carried` also move in their parents."""
        person, world = self._person, self._world
        turns, _ = decomposed(world[list(nodes)])
        inside = set(moving)

        def turned(bone: int) -> FloatArray:
            own = int(follows[bone])
            from_rest = self._moves[:, own, :3, :3] @ self._rest[own, :3, :3].T
            return np.asarray(person.turn.T @ from_rest @ person.turn @ turns[bone])

        for bone in moving:
            parent, outer = int(parents[bone]), self._above[nodes[bone]]
            base = (
                np.eye(3) if outer < 0 else decomposed(world[outer][None])[0][0]
            )  # relative to the parent node, which may not be a bone
            now = turned(bone)
            if bone in carried or parent not in inside:
                around = np.broadcast_to(base, now.shape)
            else:
                around = turned(parent) @ (turns[parent].T @ base)
            local, still = np.swapaxes(around, 1, 2) @ now, base.T @ turns[bone]
            if np.abs(local - still).max() > 1e-5:
                quats = continuous(rotmat_to_quat(local)[..., [1, 2, 3, 0]])
                self._channel(nodes[bone], "rotation", quats)
            if bone in carried:
                own = int(follows[bone])
                away = world[nodes[bone]][:3, 3] @ person.turn.T * person.unit
                away[1] -= person.floor
                fixed = self._rest[own, :3, :3].T @ (away - self._rest[own, :3, 3])
                places = self._moves[:, own, :3, 3] + self._moves[:, own, :3, :3] @ fixed
                places[:, 1] += person.floor
                places = places @ person.turn / person.unit
                inverse = np.eye(4) if outer < 0 else np.linalg.inv(world[outer])
                self._channel(
                    nodes[bone], "translation", places @ inverse[:3, :3].T + inverse[:3, 3]
                )
