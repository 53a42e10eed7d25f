"""Read people from glTF or VRM as a `Body` for retargeting."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.formats.bone_map import read_bone_map, write_bone_map
from a2v.formats.gltf.armatures import (
    Armature,
    Twin,
    armatures,
    bone_names,
    bone_nodes,
    choose,
    parents_among,
)
from a2v.formats.gltf.compression import plain
from a2v.formats.gltf.reading import Gltf, decomposed, read_glb
from a2v.formats.gltf.skins import read_skin
from a2v.io import reading
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.understand import UP_Z
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
        Node in the file of each bone; those of the body's last bones, ends of arms that the file
        lacks, are left out.
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
    twins : tuple of Twin
        Other armatures of the same body, such as those of clothes, which move with it.
    notes : tuple of str
        What was found out or left out, a sentence each.
    """

    file: Gltf
    body: Body
    nodes: tuple[int, ...]
    turn: FloatArray
    unit: float
    floor: float
    mover: int
    odd: tuple[int, ...] = ()
    twins: tuple[Twin, ...] = ()
    notes: tuple[str, ...] = ()


def read_person(
    path: str | os.PathLike[str],
    *,
    name: str | os.PathLike[str] | None = None,
    bone_map: str | os.PathLike[str] | None = None,
) -> Person:
    """Read a skinned person from a ``.glb``, ``.gltf`` or ``.vrm``. Messages call the file `name`.

    The joints are those of `bone_map`, else found by the bones' names, else by their shape
    (`a2v.kinematics.understand`); `Person.notes` tells of the latter.

    Parameters
    ----------
    path : path
    name : path or None
    bone_map : path or None
        A table of `a2v.formats.bone_map`.

    Raises
    ------
    InputError
        The file is broken or too large, has no skin, or no bones of a person; bones that carry
        joints are mirrored or scaled unevenly; the person lies or is upside down.
    """
    file = dataclasses.replace(plain(read_glb(path)), path=Path(name or path))
    with reading(file.path, "person that can be read", "a skinned person in a binary glTF 2.0"):
        every = _armatures(file)
        given = None if bone_map is None else read_bone_map(bone_map, every[0].names)
        return _read(file, every, given)


def has_skin(path: str | os.PathLike[str]) -> bool:
    """Return whether a glTF has a skin.

    Raises
    ------
    InputError
        The file is broken or too large.
    """
    return bool(read_glb(path).items("skins"))


def write_map_of(
    path: str | os.PathLike[str], target: str | os.PathLike[str], *, name: object = None
) -> None:
    """Write the bones of a character's file as a table to be edited (`a2v.formats.bone_map`).

    Raises
    ------
    InputError
        See `read_person`.
    """
    file = dataclasses.replace(plain(read_glb(path)), path=Path(str(name or path)))
    with reading(file.path, "person that can be read", "a skinned person in a binary glTF 2.0"):
        one = _armatures(file)[0]
    write_bone_map(target, one.names, one.parents.tolist(), one.heads)


def _armatures(file: Gltf) -> list[Armature]:
    if not file.items("skins"):
        raise file.fail("has no skin")
    world, above = file.node_matrices()
    if not np.isfinite(world).all() or np.abs(world).max() > 1e6:
        raise file.fail("has node positions that are not finite, or too large")
    nodes = bone_nodes(file, above)
    names, parents = bone_names(file, nodes), parents_among(nodes, above)
    return armatures(file, nodes, names, parents, world[list(nodes)][:, :3, 3])


def _read(file: Gltf, every: list[Armature], given: Mapping[str, int] | None) -> Person:
    world, _ = file.node_matrices()
    main, known, twins, notes = choose(every, given)
    if known is None:
        missing = missing_joints(canonical_joints(main.names, main.parents.tolist()))
        missing = missing if given is None else missing_joints(dict(given))
        raise file.fail(
            f"has no bone for {', '.join(missing[:4])} among "
            f"{', '.join(name for name in main.names[:6] if name) or 'its nodes'}..., and no shape "
            "of a person; name the bones by --bone-map FILE, which writes the table first"
        )
    nodes, count = main.nodes, len(main.nodes)
    plain_names = given is None and not known.notes
    names = main.names if plain_names else known.names
    found = canonical_joints(names, list(known.parents)) if plain_names else known.joints
    turns, odd = decomposed(world[list(nodes)])
    if bad := sorted(set(odd) & _carriers(found, main.parents)):
        raise file.fail(
            f"has bones that are mirrored, scaled to nothing or scaled unevenly "
            f"({', '.join(main.names[bone] for bone in bad[:3])}); apply the scale in the program "
            "that made it"
        )
    turn, unit, said = _placed(file, found, known.heads)
    added = known.parents[count:]
    turns = np.concatenate([turns, *(turns[bone][None] for bone in added if bone < count)])
    turns = np.concatenate([turns, np.tile(np.eye(3), (len(known.names) - len(turns), 1, 1))])
    rest = np.tile(np.eye(4), (len(known.names), 1, 1))
    rest[:, :3, :3] = turn @ turns
    rest[:, :3, 3] = unit * (known.heads @ turn.T)
    owners = dict(zip(nodes, range(count), strict=True))
    for twin in twins:
        owners |= dict(zip(twin.armature.nodes, twin.follows.tolist(), strict=True))
    vertices, faces, weights = read_skin(file, world, owners, len(known.names))
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
        bone_parents=np.array(known.parents),
        bone_transforms=rest.astype(np.float32),
        rest_transforms=rest.astype(np.float32),
        bone_tails=rest[:, :3, 3].astype(np.float32),
        weights=weights,
        parts=np.zeros(len(placed), np.int8),
    )
    return Person(
        file=file,
        body=body,
        nodes=nodes,
        turn=turn,
        unit=unit,
        floor=floor,
        mover=_mover(found, list(known.parents)),
        odd=odd,
        twins=tuple(twins),
        notes=(*known.notes, *said, *notes),
    )


def _carriers(found: Mapping[str, int], parents: IntArray) -> set[int]:
    """Return the bones of the joints, and those above them."""
    carriers: set[int] = set()
    for bone in found.values():
        while bone >= 0 and bone not in carriers:
            carriers.add(bone)
            bone = int(parents[bone]) if bone < len(parents) else -1  # added bones carry nothing
    return carriers


def _placed(
    file: Gltf, found: Mapping[str, int], heads: FloatArray
) -> tuple[FloatArray, float, tuple[str, ...]]:
    """Return the rotation (3, 3) that makes the person stand along y and face +z, the meters per
    unit, and notes. Only a person that stands along z is turned upright."""
    left, right = (
        {joint: heads[found[f"{side}_{joint}"]] for joint in ("hip", "shoulder", "ankle")}
        for side in ("left", "right")
    )
    across = left["hip"] - right["hip"] + left["shoulder"] - right["shoulder"]
    up = left["shoulder"] + right["shoulder"] - left["ankle"] - right["ankle"]
    size = float(np.linalg.norm(up))
    lying = size > 1e-9 and up[2] > 0.9 * size
    upright = UP_Z if lying else np.eye(3)
    across, up = upright @ across, upright @ up
    if size < 1e-9 or up[1] < 0.7 * size or np.hypot(across[0], across[2]) < 1e-6 * size:
        raise file.fail("has a person that does not stand upright along y in its rest pose")
    yaw = float(np.arctan2(across[2], across[0]))
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    turn = turn @ upright
    notes = ("the person stands along z; it moves so, and the file stays z up",) if lying else ()
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
    return turn, 1.0 if _HEIGHTS[0] / 2 <= leg <= _HEIGHTS[1] / 2 else _LEG / leg, notes


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
