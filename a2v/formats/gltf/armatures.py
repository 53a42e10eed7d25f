"""Which bones of a glTF are the person's: armatures, several people, clothes with bones of their
own."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.formats.gltf.bounds import MAX_JOINTS
from a2v.formats.gltf.reading import Gltf, node_name
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.understand import Understood, understand
from a2v.types import FloatArray, IntArray

_NEAR = 0.03
"""Distance of the same bones of two armatures of one body, as a share of its height."""


@dataclass(frozen=True)
class Armature:
    """Bones that are connected, or joints of the same skin: `nodes` of the file, parents first,
    their `parents` among themselves, `names`, `heads` (B, 3) in the file's axes, and the number of
    `vertices` that they move."""

    nodes: tuple[int, ...]
    parents: IntArray
    names: tuple[str, ...]
    heads: FloatArray
    vertices: int

    @property
    def title(self) -> str:
        """Name in messages: that of the first bone that has one."""
        return next((name for name in self.names if name), "nameless bones")


@dataclass(frozen=True)
class Twin:
    """An armature that moves with the person's: clothes, hair. `follows` (B,) is the person's bone
    that each of its bones follows."""

    armature: Armature
    follows: IntArray


def armatures(
    file: Gltf, nodes: tuple[int, ...], names: list[str], parents: IntArray, heads: FloatArray
) -> list[Armature]:
    """Return the armatures of a file, those that move most vertices first."""
    label = list(range(len(nodes)))

    def top(bone: int) -> int:
        while label[bone] != bone:
            label[bone] = label[label[bone]]
            bone = label[bone]
        return bone

    place = {node: bone for bone, node in enumerate(nodes)}
    for bone, parent in enumerate(parents.tolist()):
        if parent >= 0:
            label[top(bone)] = top(parent)
    counts: dict[int, int] = {}
    skins = [file.joints(skin) for skin in file.items("skins")]
    for joints in skins:
        for joint in joints[1:]:
            label[top(place[joint])] = top(place[joints[0]])
    for node in file.items("nodes"):
        if "mesh" in node and "skin" in node:
            file.item("skins", node["skin"])
            primitives = file.item("meshes", node["mesh"]).get("primitives")
            one = place[skins[node["skin"]][0]]
            for primitive in primitives if isinstance(primitives, list) else []:
                attributes = primitive.get("attributes") if isinstance(primitive, dict) else None
                if isinstance(attributes, dict) and "POSITION" in attributes:
                    counts[one] = counts.get(one, 0) + file.count(attributes["POSITION"])
    found = []
    for first in sorted({top(bone) for bone in range(len(nodes))}):
        own = [bone for bone in range(len(nodes)) if top(bone) == first]
        new = {bone: number for number, bone in enumerate(own)}
        found.append(
            Armature(
                nodes=tuple(nodes[bone] for bone in own),
                parents=np.array([new.get(int(parents[bone]), -1) for bone in own]),
                names=tuple(names[bone] for bone in own),
                heads=heads[own],
                vertices=sum(count for bone, count in counts.items() if top(bone) == first),
            )
        )
    return sorted(found, key=lambda one: -one.vertices)


def choose(
    every: list[Armature], given: Mapping[str, int] | None
) -> tuple[Armature, Understood | None, list[Twin], list[str]]:
    """Return the person's armature, its joints (None if unknown), the armatures that move with it,
    and notes.

    Parameters
    ----------
    every : list of Armature
        Those that move most vertices first.
    given : dict or None
        The user's joints, bones of the first armature.
    """
    if given is not None:
        main, found = (
            every[0],
            understand(every[0].names, every[0].parents.tolist(), every[0].heads, given=given),
        )
    else:
        named = [one for one in every if _is_named(one)]
        main = (named or every)[0]
        found = None
        for one in named or every:
            if found is None:
                found = understand(one.names, one.parents.tolist(), one.heads)
                main = one if found is not None else main
    twins, notes, people = [], [], 1
    others = [one for one in every if one is not main and one.vertices]
    for one in others:
        follows = _followed(one, main)
        if follows is not None:
            twins.append(Twin(one, follows))
        elif _is_named(one):
            people += 1
        else:
            notes.append(f"{one.title} and its {one.vertices} vertices stay in the file's pose")
    if people > 1:
        notes.append(
            f"of {people} people the one with most vertices ({main.title}) moves; the others stay "
            "in the file's pose"
        )
    return main, found, twins, notes


def _is_named(one: Armature) -> bool:
    return not missing_joints(canonical_joints(one.names, one.parents.tolist()))


def _followed(one: Armature, main: Armature) -> IntArray | None:
    """Return the bone of `main` that each bone of another armature of the same body follows; None
    if it is not of the same body: most of its bones have the name and the place of one of
    `main`'s, or one above them has."""
    size = float(np.ptp(main.heads, axis=0).max())
    known: dict[str, int] = {}
    for bone, name in enumerate(main.names):
        if name:
            known.setdefault(name, bone)
    follows = np.full(len(one.names), -1)
    same = 0
    for bone, name in enumerate(one.names):
        twin = known.get(name, known.get(re.sub(r"[._]\d+$", "", name)))  # Blender numbers them
        if twin is not None and np.linalg.norm(one.heads[bone] - main.heads[twin]) < _NEAR * size:
            follows[bone] = twin
            same += 1
        elif one.parents[bone] >= 0:
            follows[bone] = follows[one.parents[bone]]
    if not same or (follows < 0).sum() > 0.5 * len(follows):
        return None
    first = int(follows[follows >= 0][0])
    return np.where(follows < 0, first, follows)


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


def parents_among(nodes: tuple[int, ...], above: list[int]) -> IntArray:
    """Return for each of `nodes` the index of its nearest ancestor among them, -1 for none."""
    known = {one: place for place, one in enumerate(nodes)}
    found = []
    for node in nodes:
        at = above[node]
        while at >= 0 and at not in known:
            at = above[at]
        found.append(known.get(at, -1))
    return np.array(found)


def bone_names(file: Gltf, nodes: tuple[int, ...]) -> list[str]:
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
