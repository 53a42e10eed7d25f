"""Read people from binary glTF or VRM as a `Body` for retargeting, and add animations to their
files.

Animations are the only change to the given file: its binary chunk is the beginning of the new one.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.formats.characters import Clips, check_clips
from a2v.formats.gltf.bounds import MAX_JOINTS
from a2v.formats.gltf.compression import plain
from a2v.formats.gltf.document import Document, pack_glb
from a2v.formats.gltf.reading import Gltf, decomposed, node_name, read_glb
from a2v.formats.gltf.skins import read_skin
from a2v.io import atomic_path, reading
from a2v.kinematics import rotmat_to_quat
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.resample import continuous
from a2v.types import Body, FloatArray, IntArray

_HEIGHTS = (0.3, 4.0)
"""Range of leg lengths that are taken as meters; other legs are scaled to `_LEG`."""
_LEAST_SHARE = 0.1
"""Smallest height of the mesh, as a share of the height of the bones."""
_LEG = 0.85
"""Thigh and shin of an adult, meters."""


@dataclass(frozen=True, kw_only=True)
class Person:
    """A person that was read from a file.

    Attributes
    ----------
    file : Gltf
    body : Body
        Bones and skin in the pose of the file: meters, y up, facing +z, the soles on y = 0.
    nodes : tuple of int
        Node in the file of each bone.
    turn : (3, 3) float64
        The body's axes from the file's.
    unit : float
        Meters per unit of the file.
    floor : float
        Height of the soles, meters, which is the ground of the file.
    mover : int
        The bone that moves the whole person: the lowest common ancestor of hips and shoulders.
    odd : tuple of int
        Bones that are mirrored, scaled unevenly or to nothing, such as hidden hair. Only bones that
        carry no joint may be; they keep their pose.
    """

    file: Gltf
    body: Body
    nodes: tuple[int, ...]
    turn: FloatArray
    unit: float
    floor: float
    mover: int
    odd: tuple[int, ...] = ()


def read_person(
    path: str | os.PathLike[str], *, name: str | os.PathLike[str] | None = None
) -> Person:
    """Read a skinned person from a ``.glb`` or ``.vrm``. Messages call the file `name`.

    Raises
    ------
    InputError
        The file is broken or too large, has no skin, or its bones have no names that
        `canonical_joints` knows; bones that carry joints are mirrored or scaled unevenly; the
        person lies or is upside down.
    """
    file = dataclasses.replace(plain(read_glb(path)), path=Path(name or path))
    with reading(file.path, "person that can be read", "a skinned person in a binary glTF 2.0"):
        return _read(file)


def _read(file: Gltf) -> Person:
    if not file.items("skins"):
        raise file.fail("has no skin")
    world, above = file.node_matrices()
    nodes = bone_nodes(file, above)
    parents = _parents(nodes, above)
    names = _names(file, nodes)
    found = canonical_joints(names, parents.tolist())
    if missing := missing_joints(found):
        raise file.fail(
            f"has no bone for {', '.join(missing[:4])} among "
            f"{', '.join(name for name in names[:6] if name) or 'its nodes'}..."
        )
    if not np.isfinite(world).all() or np.abs(world).max() > 1e6:
        raise file.fail("has node positions that are not finite, or too large")
    turns, odd = decomposed(world[list(nodes)])
    if bad := sorted(set(odd) & _carriers(found, parents)):
        raise file.fail(
            f"has bones that are mirrored, scaled to nothing or scaled unevenly "
            f"({', '.join(names[bone] for bone in bad[:3])}); apply the scale in the program that "
            "made it"
        )
    turn, unit = _placed(file, found, world[list(nodes)][:, :3, 3])
    rest = np.tile(np.eye(4), (len(nodes), 1, 1))
    rest[:, :3, :3] = turn @ turns
    rest[:, :3, 3] = unit * (world[list(nodes)][:, :3, 3] @ turn.T)
    vertices, faces, weights = read_skin(file, world, nodes)
    placed = unit * (vertices @ turn.T)
    floor = float(placed[:, 1].min())
    tall = float(placed[:, 1].max()) - floor
    if tall < _LEAST_SHARE * float(np.ptp(rest[:, 1, 3])):
        raise file.fail(
            f"has a mesh of {tall:.3g} m on bones of {float(np.ptp(rest[:, 1, 3])):.3g} m; its "
            "inverse bind matrices are missing or of another unit"
        )
    rest[:, 1, 3] -= floor
    placed[:, 1] -= floor
    body = Body(
        model="the file's",
        parameters={},
        vertices=placed.astype(np.float32),
        faces=faces,
        bone_names=tuple(names),
        bone_parents=parents,
        bone_transforms=rest.astype(np.float32),
        rest_transforms=rest.astype(np.float32),
        bone_tails=rest[:, :3, 3].astype(np.float32),
        weights=weights,
        parts=np.zeros(len(placed), np.int8),
    )
    mover = _mover(found, parents.tolist())
    return Person(
        file=file, body=body, nodes=nodes, turn=turn, unit=unit, floor=floor, mover=mover, odd=odd
    )


def _carriers(found: Mapping[str, int], parents: IntArray) -> set[int]:
    """Return the bones of the joints, and those above them."""
    carriers: set[int] = set()
    for bone in found.values():
        while bone >= 0 and bone not in carriers:
            carriers.add(bone)
            bone = int(parents[bone])
    return carriers


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
    file, body = person.file, person.body
    world, above = file.node_matrices()
    turns, _ = decomposed(world[list(person.nodes)])
    times = document.accessor((np.arange(len(moves)) / fps).astype(np.float32), bounds=True)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []

    def channel(bone: int, path: str, values: FloatArray) -> None:
        node = document.json["nodes"][person.nodes[bone]]
        if "matrix" in node:
            document.json["nodes"][person.nodes[bone]] = file.without_matrix(node)
        samplers.append(
            {
                "input": times,
                "output": document.accessor(values.astype(np.float32)),
                "interpolation": "LINEAR",
            }
        )
        channels.append(
            {"sampler": len(samplers) - 1, "target": {"node": person.nodes[bone], "path": path}}
        )

    from_rest = moves[..., :3, :3] @ np.swapaxes(
        body.rest_transforms[:, :3, :3].astype(np.float64), -1, -2
    )
    turned = person.turn.T @ from_rest @ person.turn @ turns
    below = {person.mover}
    for bone, parent in enumerate(body.bone_parents.tolist()):
        if parent in below:
            below.add(bone)
        if bone not in below or {bone, parent} & set(person.odd):
            continue
        outer = above[person.nodes[bone]]
        base = (
            np.eye(3) if outer < 0 else decomposed(world[outer][None])[0][0]
        )  # relative to the parent node, which may not be a bone
        if bone == person.mover or parent not in below:
            around = np.broadcast_to(base, turned[:, bone].shape)
        else:
            around = turned[:, parent] @ (turns[parent].T @ base)
        local, still = np.swapaxes(around, 1, 2) @ turned[:, bone], base.T @ turns[bone]
        if np.abs(local - still).max() > 1e-5:
            channel(bone, "rotation", continuous(rotmat_to_quat(local)[..., [1, 2, 3, 0]]))
        if bone == person.mover:
            shift = moves[:, bone, :3, 3] - body.rest_transforms[bone, :3, 3].astype(np.float64)
            places = world[person.nodes[bone]][:3, 3] + shift @ person.turn / person.unit
            inverse = np.eye(4) if outer < 0 else np.linalg.inv(world[outer])
            channel(bone, "translation", places @ inverse[:3, :3].T + inverse[:3, 3])
    return {"name": name, "samplers": samplers, "channels": channels}


def bone_nodes(file: Gltf, above: list[int], more: Iterable[int] = ()) -> tuple[int, ...]:
    """Return the nodes that are joints of a skin or among `more`, or lie between two such; parents
    first. `above` are the parents of all nodes."""
    joints = {joint for skin in file.items("skins") for joint in file.joints(skin)} | set(more)
    if len(joints) > MAX_JOINTS:
        raise file.fail(f"has {len(joints)} joints in its skins; expected at most {MAX_JOINTS}")
    inside = set(joints)
    for joint in joints:
        path, at = [], above[joint]
        while at >= 0 and at not in joints:
            path.append(at)
            at = above[at]
        if at >= 0:
            inside |= set(path)

    if len(inside) > 2 * MAX_JOINTS:
        raise file.fail(f"has {len(inside)} bones; expected at most {2 * MAX_JOINTS}")

    def depth(node: int) -> int:
        steps = 0
        while above[node] >= 0:
            node, steps = above[node], steps + 1
        return steps

    return tuple(sorted(inside, key=lambda node: (depth(node), node)))


def _parents(nodes: tuple[int, ...], above: list[int]) -> IntArray:
    """Return for each of `nodes` the index of its nearest ancestor among them, -1 for none."""
    known = {one: place for place, one in enumerate(nodes)}
    found = []
    for node in nodes:
        at = above[node]
        while at >= 0 and at not in known:
            at = above[at]
        found.append(known.get(at, -1))
    return np.array(found)


def _names(file: Gltf, nodes: tuple[int, ...]) -> list[str]:
    """Return the names of the bones, from VRM's humanoid if present, else from the nodes."""
    every = file.items("nodes")
    names = [node_name(every[node]) for node in nodes]
    human = humanoid(file)
    if human:
        return [human.get(node, f"other{place}") for place, node in enumerate(nodes)]
    return names


def humanoid(file: Gltf) -> dict[int, str]:
    """Return VRM's names of nodes, in either edition or in an animation."""
    extensions = file.json.get("extensions")
    found: dict[int, str] = {}
    if not isinstance(extensions, dict):
        return found
    for key in ("VRMC_vrm", "VRM", "VRMC_vrm_animation"):
        said = extensions.get(key)
        humanoid = said.get("humanoid") if isinstance(said, dict) else None
        bones = humanoid.get("humanBones") if isinstance(humanoid, dict) else None
        rows: list[tuple[Any, Any]] = []
        if isinstance(bones, dict):
            rows = [
                (name, bone.get("node")) for name, bone in bones.items() if isinstance(bone, dict)
            ]
        elif isinstance(bones, list):
            rows = [
                (bone.get("bone"), bone.get("node")) for bone in bones if isinstance(bone, dict)
            ]
        for name, node in rows:
            file.item("nodes", node)
            found.setdefault(node, str(name)[:200])
    return found


def _placed(file: Gltf, found: Mapping[str, int], heads: FloatArray) -> tuple[FloatArray, float]:
    """Return the rotation (3, 3) about y that makes the person face +z, and the meters per unit."""
    across = (
        heads[found["left_hip"]]
        - heads[found["right_hip"]]
        + heads[found["left_shoulder"]]
        - heads[found["right_shoulder"]]
    )
    up = (
        heads[found["left_shoulder"]]
        + heads[found["right_shoulder"]]
        - heads[found["left_ankle"]]
        - heads[found["right_ankle"]]
    )
    size = float(np.linalg.norm(up))
    if size < 1e-9 or up[1] < 0.7 * size or np.hypot(across[0], across[2]) < 1e-6 * size:
        raise file.fail("has a person that does not stand upright along y in its rest pose")
    yaw = float(np.arctan2(across[2], across[0]))
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    legs = [
        float(
            np.linalg.norm(heads[found[f"{side}_hip"]] - heads[found[f"{side}_knee"]])
            + np.linalg.norm(heads[found[f"{side}_knee"]] - heads[found[f"{side}_ankle"]])
        )
        for side in ("left", "right")
    ]
    leg = float(np.mean(legs))
    if leg < 1e-9:
        raise file.fail("has legs without length")
    return turn, 1.0 if _HEIGHTS[0] / 2 <= leg <= _HEIGHTS[1] / 2 else _LEG / leg


def _mover(found: Mapping[str, int], parents: list[int]) -> int:
    """Return the lowest common ancestor of hips and shoulders."""

    def path(bone: int) -> list[int]:
        steps = [bone]
        while parents[steps[-1]] >= 0:
            steps.append(parents[steps[-1]])
        return steps

    paths = [
        path(found[name]) for name in ("left_hip", "right_hip", "left_shoulder", "right_shoulder")
    ]
    shared = set(paths[0]).intersection(*paths[1:])
    return next((bone for bone in paths[0] if bone in shared), found["pelvis"])
