"""Make a `Motion` of bones that move: the way from every file format with bones to ours."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.bone_map import read_bone_map, write_bone_map
from a2v.formats.conventions import (
    Bone,
    choose_scale,
    demand_limbs,
    demand_person,
    guess_up_axis,
    y_up_rotmat,
)
from a2v.kinematics import SKELETONS, rotvec_to_rotmat, skeleton_of, swing_between
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.orientations import rotmats_to_chain
from a2v.kinematics.skeleton import Skeleton
from a2v.kinematics.understand import understand
from a2v.types import FloatArray, Motion


@dataclass(frozen=True, kw_only=True)
class Recording:
    """The moving bones of a file, in its axes and units.

    Attributes
    ----------
    source : str
        Name of the file in messages.
    bones : sequence of N Bone
        Parents first; the first has none.
    local : (T, N, 3) float64
        Places of the bones in the frames of their parents at rest.
    world : (T, N, 3) float64
        Places in the world.
    rotmats : (T, N, 3, 3) float64
        Rotations in the world from the pose at rest, in which no bone is turned.
    fps : float
    up : str or None
        Upward axis that the format states; None guesses it.
    known : bool
        Whether joints that are those of a data set get its skeleton and their order there.
    notes : tuple of str
        What is particular about the file, a sentence each.
    facts : mapping
        Further entries of ``provenance``.
    """

    source: str
    bones: Sequence[Bone]
    local: FloatArray
    world: FloatArray
    rotmats: FloatArray
    fps: float
    up: str | None = None
    known: bool = True
    notes: tuple[str, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)


def motion_of(
    file: Recording,
    *,
    units: str | float | None = None,
    up: str | None = None,
    person: bool = True,
    action: str = "",
    bone_map: str | os.PathLike[str] | None = None,
) -> Motion:
    """Make the motion of a recording, in meters, y up.

    Joints at the place of their parent are merged into it. A root that carries only the pelvis
    becomes part of the pelvis's path. ``provenance`` gets "source", "units", "scale", "up", "notes"
    and the recording's facts.

    Parameters
    ----------
    file : Recording
    units, up, person, action
        As in `a2v.formats.read_bvh`.
    bone_map : path or None
        A table of `a2v.formats.bone_map` that names the joints.

    Raises
    ------
    InputError
        The skeleton is not a person's, or has no size; the table is broken or lacks joints.
    """
    tree = _merge(file)
    if bone_map is not None or (person and missing_joints(tree.canonical)):
        file = _understood(file, tree, bone_map)
        tree = _merge(file)
    notes = list(file.notes)
    if person and (above := tree.above_pelvis()):
        tree = tree.from_pelvis()
        notes.append(f"{', '.join(above)} above the pelvis became part of its path")
    if person:
        demand_person(file.source, file.bones, tree.canonical, tree.names)
        kept = [file.bones[joint] for joint in tree.keep]
        demand_limbs(file.source, kept, file.local[:, tree.keep], tree.canonical)
    scale, unit = choose_scale(
        file.source, tree.offsets, tree.parents, tree.canonical, units, person
    )
    axis = (
        up
        or file.up
        or guess_up_axis(tree.offsets, tree.parents, tree.canonical, file.world[:, tree.keep])
    )
    to_y_up = y_up_rotmat(axis)
    posed = _Posed(
        local=file.local, world=(file.world * scale) @ to_y_up.T, rotmats=to_y_up @ file.rotmats
    )
    tree = dataclasses.replace(tree, offsets=np.round((tree.offsets * scale) @ to_y_up.T, 7))
    told = {"source": file.source, "units": unit, "scale": scale, "up": axis, "notes": notes}
    known = _known_skeleton(tree.names, tree.parents) if file.known else None
    if known is not None:  # BVH lists joints depth first
        tree = tree.ordered(
            [tree.names.index(name) for name in known.joint_names], known.parents.tolist()
        )
    skeleton = known or skeleton_of("custom", tree.parents, tree.names)
    motion = _motion(tree, posed, skeleton, fps=file.fps)
    return dataclasses.replace(motion, action=action, provenance={**told, **file.facts})


def write_map_of_recording(file: Recording, path: str | os.PathLike[str]) -> None:
    """Write the joints of a recording as a table to be edited (`a2v.formats.bone_map`)."""
    tree = _merge(file)
    write_bone_map(path, tree.names, tree.parents, tree.heads())


def _understood(file: Recording, tree: _Tree, bone_map: str | os.PathLike[str] | None) -> Recording:
    """Return a recording whose joints have canonical names, by a table or the shape of its skeleton
    and with added ends of arms where need be; the same one if it is no person's."""
    given = None if bone_map is None else read_bone_map(bone_map, tree.names)
    found = understand(tree.names, tree.parents, tree.heads(), given=given)
    if found is None:
        if given is not None:
            missing = ", ".join(missing_joints(given)[:4])
            raise InputError(f"{bone_map} names no bone for {missing}; name one on a line of each")
        return file
    bones = [
        dataclasses.replace(bone, name=f"other_{place}") for place, bone in enumerate(file.bones)
    ]
    local, world, rotmats = file.local, file.world, file.rotmats
    keep = [*tree.keep]
    for joint, name in enumerate(found.names):
        if joint < len(tree.keep):
            bones[keep[joint]].name = name
            continue
        above = keep[found.parents[joint]]
        way = found.heads[joint] - found.heads[found.parents[joint]]
        keep.append(len(bones))
        bones.append(Bone(name, above, bones[above].line))
        local = np.concatenate([local, np.broadcast_to(way, local[:, :1].shape)], axis=1)
        place = world[:, above] + rotmats[:, above] @ way
        world = np.concatenate([world, place[:, None]], axis=1)
        rotmats = np.concatenate([rotmats, rotmats[:, above, None]], axis=1)
    return dataclasses.replace(
        file,
        bones=bones,
        local=local,
        world=world,
        rotmats=rotmats,
        known=False,
        notes=(*file.notes, *found.notes),
    )


@dataclass(frozen=True, kw_only=True)
class _Tree:
    """The joints that stand apart from their parent: their nodes `keep`, `names`, `parents` among
    themselves, `canonical` joints, the `bearers` (nodes whose rotation the bones that end at them
    follow) and bones at rest `offsets` (J, 3), the file's units."""

    keep: list[int]
    names: list[str]
    parents: list[int]
    canonical: dict[str, int]
    bearers: list[int]
    offsets: FloatArray

    def heads(self) -> FloatArray:
        """Return the places (J, 3) of the joints at rest, from the root; the file's units."""
        heads = np.zeros_like(self.offsets)
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                heads[joint] = heads[parent] + self.offsets[joint]
        return heads

    def above_pelvis(self) -> list[str]:
        """Names of the joints above the pelvis if all others are below it."""
        pelvis = self.canonical.get("pelvis", 0)
        return (
            self.names[:pelvis]
            if self.parents[1 : pelvis + 1] == list(range(pelvis))
            and min(self.parents[pelvis + 1 :], default=pelvis) >= pelvis
            else []
        )

    def from_pelvis(self) -> _Tree:
        """Return the joints from the pelvis on; the pelvis, now the root, bears itself."""
        pelvis = self.canonical["pelvis"]
        tree = self.ordered(
            range(pelvis, len(self.names)),
            [max(parent - pelvis, -1) for parent in self.parents[pelvis:]],
        )
        tree.bearers[0], tree.offsets[0] = tree.keep[0], 0
        return tree

    def ordered(self, order: Sequence[int], parents: list[int]) -> _Tree:
        """Return the joints in another order, with their parents in that order."""
        names = [self.names[i] for i in order]
        return _Tree(
            keep=[self.keep[i] for i in order],
            names=names,
            parents=parents,
            canonical=canonical_joints(names, parents),
            bearers=[self.bearers[i] for i in order],
            offsets=self.offsets[list(order)],
        )


@dataclass(frozen=True, kw_only=True)
class _Posed:
    """The file's N nodes over time: `local` (T, N, 3) positions relative to the parent in the
    file's axes and units, `world` (T, N, 3) positions in meters, and `rotmats` (T, N, 3, 3)
    rotations, both y up."""

    local: FloatArray
    world: FloatArray
    rotmats: FloatArray


def _motion(tree: _Tree, posed: _Posed, skeleton: Skeleton, *, fps: float) -> Motion:
    """Make the motion of a tree with `offsets` in meters, y up, and the joints of `skeleton`."""
    joints = posed.world[:, tree.keep]
    bones = np.stack([posed.rotmats[:, bearer] for bearer in tree.bearers], 1)
    to_offset = np.tile(np.eye(3), (len(joints), len(tree.keep), 1, 1))
    to_offset[:, 1:] = rotvec_to_rotmat(
        swing_between(
            np.broadcast_to(skeleton.rest_directions[1:], joints[:, 1:].shape),
            posed.local[:, tree.keep[1:]],
        )
    )
    return Motion(
        joints=joints.astype(np.float32),
        rotations=rotmats_to_chain(bones @ to_offset, skeleton).astype(np.float32),
        root=joints[:, 0].astype(np.float32),
        fps=fps,
        parents=np.asarray(tree.parents),
        joint_names=tuple(tree.names),
        skeleton=skeleton.name,
        rest_offsets=tree.offsets,
    )


def _merge(file: Recording) -> _Tree:
    """Merge joints at the place of their parent."""
    local = file.local
    length = np.abs(local).max(axis=(0, 2))
    tolerance = 1e-6 * max(float(length[1:].max()) if len(length) > 1 else 0.0, 1e-12)
    keep, merged = [0], {0: 0}  # and for each joint the kept joint at its place
    for j, node in enumerate(file.bones[1:], start=1):
        if length[j] > tolerance:
            keep.append(j)
            merged[j] = j
        else:
            merged[j] = merged[node.parent]
    if len(keep) < 2:
        raise InputError(
            f"{file.bones[0].at(file.source)}: every bone has zero length; there is no skeleton to "
            "move"
        )
    new = {old: i for i, old in enumerate(keep)}
    names = _unique([file.bones[j].name for j in keep])
    parents = [-1 if file.bones[j].parent < 0 else new[merged[file.bones[j].parent]] for j in keep]
    # the bone that ends at j is turned by the file's parent of j (a merged helper included)
    bearers = [max(file.bones[j].parent, 0) for j in keep]
    offsets = np.median(local[:, keep], axis=0)
    offsets[0] = 0
    return _Tree(
        keep=keep,
        names=names,
        parents=parents,
        canonical=canonical_joints(names, parents),
        bearers=bearers,
        offsets=offsets,
    )


def _unique(names: list[str]) -> list[str]:
    seen: dict[str, int] = {}
    out = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        out.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return out


def _known_skeleton(names: list[str], parents: list[int]) -> Skeleton | None:
    """Find the data set's skeleton with these joints and bones, in any order."""
    tree = {
        name: names[parent] if parent >= 0 else ""
        for name, parent in zip(names, parents, strict=True)
    }
    for skeleton in SKELETONS.values():
        pairs = zip(skeleton.joint_names, skeleton.parents.tolist(), strict=True)
        if tree == {
            name: skeleton.joint_names[parent] if parent >= 0 else "" for name, parent in pairs
        }:
            return skeleton
    return None
