"""Read BVH: convert the file's transforms to the world, with our axes and unit."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.bvh.conventions import (
    choose_scale,
    demand_limbs,
    demand_person,
    guess_up_axis,
    without_rest_frame,
    y_up_rotmat,
)
from a2v.formats.bvh.parsing import POSITION_AXES, ROTATION_AXES, BvhFile, parse_bvh
from a2v.io import read_bytes, reading
from a2v.kinematics import SKELETONS, rotvec_to_rotmat, skeleton_of, swing_between
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.orientations import rotmats_to_chain
from a2v.kinematics.resample import resample_motion
from a2v.kinematics.skeleton import Skeleton
from a2v.types import FloatArray, Motion

MAX_BYTES = 512 << 20


def read_bvh(
    path: str | os.PathLike[str] | bytes,
    *,
    fps: float | None = None,
    units: str | float | None = None,
    up: str | None = None,
    person: bool = True,
    action: str = "",
    name: str = "BVH text",
) -> Motion:
    """Read a BVH file.

    Channels and rotations may have any order. Position channels on any joint replace its OFFSET, as
    in Blender and MotionBuilder. End Sites become joints ``<parent>_end``. Joints at the place of
    their parent (zero offset, such as CMU's ``LHipJoint``) are merged into it. A root that carries
    only the pelvis (MotionBuilder's ``Reference``) becomes part of the pelvis's path.
    ``motion.provenance["notes"]`` lists what was read although it breaks the format (`parse_bvh`).

    Parameters
    ----------
    path : path, or the text or bytes of a file
    fps : float or None
        Resample to this rate (`resample_motion`); None keeps the file's.
    units : name in `UNITS`, meters per unit, or None
        None guesses from the person's height; ``motion.provenance["units"]`` and ``["scale"]``
        contain the choice.
    up : {"x", "y", "z", "-x", "-y", "-z"} or None
        The file's upward axis; None guesses (see ``provenance["up"]``).
    person : bool
        Require the joints of a person in a known naming scheme (`canonical_joints`); False accepts
        any skeleton.
    action : str
        Stored in the motion.
    name : str
        Name of text or bytes in messages.

    Returns
    -------
    Motion
        Meters, y up. Rotations are in the chain convention and keep the file's twists about the
        bones.

    Raises
    ------
    InputError
        The file is missing, empty, truncated, inconsistent, not finite, of absurd size or not a
        person; the message names the file and the line.
    """
    text, source = _read_text(path, name)
    with reading(source, "BVH file that can be read"):
        file, dropped = without_rest_frame(parse_bvh(text, source))
    local, world, rotmats = _transforms(file)
    tree = _merge(file, local)
    notes = list(file.notes)
    if person and (above := tree.above_pelvis()):
        tree = tree.from_pelvis()
        notes.append(f"{', '.join(above)} above the pelvis became part of its path")
    if person:
        demand_person(file, tree.canonical, tree.names)
        demand_limbs(file, local, tree.keep, tree.canonical)
    scale, unit = choose_scale(source, tree.offsets, tree.parents, tree.canonical, units, person)
    axis = up or guess_up_axis(tree.offsets, tree.parents, tree.canonical, world[:, tree.keep])
    facts = {
        "source": source,
        "units": unit,
        "scale": scale,
        "up": axis,
        "dropped_rest_frame": dropped,
        "notes": notes,
    }
    to_y_up = y_up_rotmat(axis)
    posed = _Posed(local=local, world=(world * scale) @ to_y_up.T, rotmats=to_y_up @ rotmats)
    tree = dataclasses.replace(tree, offsets=np.round((tree.offsets * scale) @ to_y_up.T, 7))
    motion = _motion(tree, posed, fps=_fps(file.frame_time), action=action, facts=facts)
    return motion if fps is None else resample_motion(motion, fps)


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


def _motion(
    tree: _Tree, posed: _Posed, *, fps: float, action: str, facts: dict[str, Any]
) -> Motion:
    """Make the motion of a tree with `offsets` in meters and y up; the joints of a data set's
    skeleton are in its order."""
    known = _known_skeleton(tree.names, tree.parents)
    if known is not None:  # BVH lists joints depth first
        tree = tree.ordered(
            [tree.names.index(name) for name in known.joint_names], known.parents.tolist()
        )
    skeleton = known or skeleton_of("custom", tree.parents, tree.names)
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
        action=action,
        provenance=facts,
        rest_offsets=tree.offsets,
    )


def _read_text(path: str | os.PathLike[str] | bytes, name: str) -> tuple[str, str]:
    if isinstance(path, bytes):
        return _decode(path), name
    if isinstance(path, str) and ("\n" in path or path.lstrip().startswith("HIERARCHY")):
        return path, name
    return _decode(read_bytes(path, limit=MAX_BYTES, empty=True)), os.fspath(path)


def _decode(data: bytes) -> str:
    """Decode a file: UTF-8, with or without a byte-order mark, else Latin-1, which accepts every
    byte."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _transforms(file: BvhFile) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions of every joint in its parent (T, N, 3), in the world (T, N, 3), and world rotations
    (T, N, 3, 3); the file's units and axes."""
    local, turned = _local_transforms(file)
    world, rotmats = np.zeros_like(local), np.zeros_like(turned)
    for j, node in enumerate(file.nodes):
        if node.parent < 0:
            world[:, j], rotmats[:, j] = local[:, j], turned[:, j]
        else:
            before = rotmats[:, node.parent]
            world[:, j] = world[:, node.parent] + np.einsum("tij,tj->ti", before, local[:, j])
            rotmats[:, j] = before @ turned[:, j]
    return local, world, rotmats


def _local_transforms(file: BvhFile) -> tuple[FloatArray, FloatArray]:
    """Translations (T, N, 3) and rotations (T, N, 3, 3) of every joint in its parent."""
    frames, n = len(file.values), len(file.nodes)
    local = np.zeros((frames, n, 3))
    rotmats = np.tile(np.eye(3), (frames, n, 1, 1))
    for j, node in enumerate(file.nodes):
        local[:, j] = node.offset if node.offset is not None else 0.0
        for place, channel in enumerate(node.channels or ()):
            values = file.values[:, node.first + place]
            if channel in POSITION_AXES:
                local[:, j, POSITION_AXES[channel]] = values
            else:
                axis = np.zeros((frames, 3))
                axis[:, ROTATION_AXES[channel]] = np.deg2rad(values)
                rotmats[:, j] = rotmats[:, j] @ rotvec_to_rotmat(axis)
    return local, rotmats


def _merge(file: BvhFile, local: FloatArray) -> _Tree:
    """Merge joints at the place of their parent; `local` (T, N, 3) are positions in the parents."""
    length = np.abs(local).max(axis=(0, 2))
    tolerance = 1e-6 * max(float(length[1:].max()) if len(length) > 1 else 0.0, 1e-12)
    keep, merged = [0], {0: 0}  # and for each joint the kept joint at its place
    for j, node in enumerate(file.nodes[1:], start=1):
        if length[j] > tolerance:
            keep.append(j)
            merged[j] = j
        else:
            merged[j] = merged[node.parent]
    if len(keep) < 2:
        raise InputError(
            f"{file.source}:{file.nodes[0].line}: every bone has zero length; there is no skeleton "
            "to move"
        )
    new = {old: i for i, old in enumerate(keep)}
    names = _unique([file.nodes[j].name for j in keep])
    parents = [-1 if file.nodes[j].parent < 0 else new[merged[file.nodes[j].parent]] for j in keep]
    # the bone that ends at j is turned by the file's parent of j (a merged helper included)
    bearers = [max(file.nodes[j].parent, 0) for j in keep]
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


def _fps(frame_time: float) -> float:
    """Frames per second; files give the usual rates with few digits (.0083333 is 120)."""
    fps = 1.0 / frame_time
    return float(round(fps)) if round(fps) and abs(fps / round(fps) - 1) < 2e-4 else fps
