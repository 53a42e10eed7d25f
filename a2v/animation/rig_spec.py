"""The rigs of other tools, each a table in ``rigs/``: names, hierarchy, rest pose and axes of the
bones."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.types import FloatArray

_TABLES = {
    "mixamo": "rigs/mixamo.json",
    "vrm": "rigs/vrm.json",
    "unreal": "rigs/unreal.json",
    "unity": "rigs/unity.json",
    "rigify": "rigs/rigify.json",
    "talkinghead": "rigs/talkinghead.json",
    "godot": "rigs/godot.json",
    "smpl": "rigs/smpl.json",
}

OWN_RIG = "anny"
"""Name of the body model's own rig: nothing changes."""

RIGS: tuple[str, ...] = (OWN_RIG, *_TABLES)
"""Names that ``--rig`` takes."""

_DIRECTIONS = {
    "left": (1.0, 0.0, 0.0),
    "right": (-1.0, 0.0, 0.0),
    "up": (0.0, 1.0, 0.0),
    "down": (0.0, -1.0, 0.0),
    "front": (0.0, 0.0, 1.0),
    "back": (0.0, 0.0, -1.0),
}


@dataclass(frozen=True, kw_only=True)
class RigBone:
    """A bone of a rig.

    Attributes
    ----------
    name : str
    parent : str
        Empty for the topmost.
    sources : tuple of str
        Anny's bones that it replaces; it follows the first. Anny's bones without a bone of the rig
        follow their nearest ancestor that has one.
    at : tuple of str
        Anny's bones whose heads' mean is its head in the rest pose; it moves with the first source.
        Default: the first source.
    tail : str
        The rig's bone whose head is the other end; empty for the end in the body model.
    direction : str
        Direction of the bone in the rest pose: words such as "left" or "left front" of the person,
        "ahead" for a foot that keeps its tilt, or empty for the direction in Anny's rest pose.
    toward : str
        Direction of the second axis (`RigSpec.toward`) in the rest pose, as near as the first axis
        allows.
    """

    name: str
    parent: str
    sources: tuple[str, ...]
    at: tuple[str, ...]
    tail: str
    direction: str
    toward: str


@dataclass(frozen=True, kw_only=True)
class RigEnd:
    """A bone without skin at the other end of a bone, with its axes.

    Attributes
    ----------
    name : str
    parent : str
        A bone of the rig that has no other children.
    """

    name: str
    parent: str


@dataclass(frozen=True, kw_only=True)
class RigSpec:
    """A rig of another program.

    Attributes
    ----------
    name : str
    title : str
        Display name.
    rest : str
        "T" or "A" (Anny's own rest pose, arms 45 degrees down).
    along, toward : str
        Local axes of the bones, such as "+y": `along` points along the bone, `toward` points to
        `RigBone.toward`. Empty if the axes in the rest pose are the world's.
    mirrored : bool
        Bones of the right side have both axes reversed.
    root : str
        Name of the bone on the ground above the hips; empty for none.
    bones : tuple of RigBone
        Parents first, without the root.
    ends : tuple of RigEnd
        Listed after all other bones.
    visemes : str
        Key of `a2v.animation.visemes.NAMINGS`: mouth shapes that are added to ARKit's.
    triangles : int
        Largest number of triangles of the mesh; 0 for no limit.
    texture : int
        Largest width and height of the texture, texels, if `triangles` is given.
    """

    name: str
    title: str
    rest: str
    along: str
    toward: str
    mirrored: bool
    root: str
    bones: tuple[RigBone, ...]
    ends: tuple[RigEnd, ...] = ()
    visemes: str = ""
    triangles: int = 0
    texture: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all bones, the root first, the ends last."""
        return (
            *([self.root] if self.root else []),
            *(bone.name for bone in self.bones),
            *(end.name for end in self.ends),
        )


@cache
def load_rig(name: str) -> RigSpec:
    """Load the table of a rig of `RIGS` other than `OWN_RIG`.

    Raises
    ------
    InputError
        Unknown name.
    """
    if name not in _TABLES:
        raise InputError(f"unknown rig '{name}'; choose from {', '.join(RIGS)}")
    table = _read_table(name)
    bones = tuple(
        RigBone(
            name=row["name"],
            parent=row.get("parent", ""),
            sources=tuple(row["from"].split()),
            at=tuple(row.get("at", row["from"].split()[0]).split()),
            tail=row.get("tail", ""),
            direction=row.get("direction", ""),
            toward=row.get("toward", ""),
        )
        for row in table.pop("bones")
    )
    ends = tuple(RigEnd(name=end, parent=parent) for end, parent in table.pop("ends", {}).items())
    return RigSpec(name=name, bones=bones, ends=ends, **table)


def _read_table(name: str) -> dict[str, Any]:
    """Read the JSON of a rig.

    A table with the key ``like`` has the bones of that other rig. ``prefix`` is removed from their
    names, ``capitals`` makes the first letters capitals, and ``more`` adds bones.
    """
    table: dict[str, Any] = json.loads(
        (Path(__file__).parent / _TABLES[name]).read_text(encoding="utf-8")
    )
    if "like" not in table:
        return table
    base = _read_table(table.pop("like"))
    prefix, capitals = table.pop("prefix", ""), table.pop("capitals", False)

    def named(text: str) -> str:
        stem = text.removeprefix(prefix)
        return stem[:1].upper() + stem[1:] if capitals else stem

    rows = [
        {
            key: named(value) if key in ("name", "parent", "tail") else value
            for key, value in row.items()
        }
        for row in base["bones"]
    ]
    root = named(base["root"])
    ends = {named(end): named(parent) for end, parent in base.get("ends", {}).items()}
    return base | {"bones": [*rows, *table.pop("more", [])], "ends": ends, "root": root} | table


def world_direction(words: str) -> FloatArray:
    """Return the unit vector (3,) of words such as "left front": the person's left is +x, the front
    +z."""
    total: FloatArray = np.sum([_DIRECTIONS[word] for word in words.split()], axis=0)
    return total / float(np.linalg.norm(total))
