"""Props: what a person climbs or sits on, and things in hands, as plain solids."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from a2v.errors import InputError
from a2v.record import Record
from a2v.types import FloatArray, IntArray, Surface

COLOR = (0.42, 0.47, 0.53)
"""sRGB of all props, chosen to differ from skin."""


HIDDEN = 1e-3
"""Scale of a thing that is not shown: too small to be seen."""
Solid = tuple[str, FloatArray]
"""Name and points (N, 3) of a convex solid."""


class Moving(NamedTuple):
    """A thing that moves: its name, its solids in a frame of its own, and this frame (T, 4, 4) in
    the world."""

    name: str
    solids: list[Solid]
    frames: FloatArray


def _no_moves() -> FloatArray:
    return np.zeros((0, 0, 4, 4), np.float32)


@dataclass(frozen=True, kw_only=True)
class Props(Record):
    """Solids of the world: steps, rungs, rails, bars, posts and seats, and things in hands.

    Attributes
    ----------
    vertices : (V, 3) float32
        World, meters, y up; those of a thing that moves are in its own frame.
    faces : (F, 3) int32
        Counter-clockwise seen from outside.
    owner : (F,) int32
        The solid that a face belongs to, an index into `names`.
    names : tuple of str
        One per solid.
    moves : (T, M, 4, 4) float32
        World from each thing that moves, for every frame; a thing that is not shown is scaled by
        `HIDDEN`.
    mover : (S,) int32
        The thing of each solid that moves; -1 for those of the world. Empty if nothing moves.
    clips : tuple of M str
        The clip in which each thing moves; "" for the only one.
    """

    vertices: FloatArray
    faces: IntArray
    owner: IntArray
    names: tuple[str, ...] = ()
    moves: FloatArray = field(default_factory=_no_moves)
    mover: IntArray = field(default_factory=lambda: np.zeros(0, np.int32))
    clips: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        sizes = {"names": len(self.names)}
        self._check("vertices", ("V", 3), sizes)
        self._check("faces", ("F", 3), sizes, below="V")
        self._check("owner", ("F",), sizes, below="names")
        self._check("moves", ("T", "M", 4, 4), sizes)
        self._check("mover", ("S",), sizes, below="M", least=-1)
        if len(self.mover) not in (0, len(self.names)):
            raise InputError(
                f"{len(self.mover)} of {len(self.names)} solids name the thing that they move with"
            )

    @classmethod
    def of(cls, solids: list[Solid]) -> Props:
        """Build convex solids, each the hull of its points (N, 3). Solids with the same name are
        numbered.

        Raises
        ------
        InputError
            The points of a solid lie in a plane.
        """
        from scipy.spatial import ConvexHull, QhullError

        vertices, faces, owner = (
            [np.zeros((0, 3))],
            [np.zeros((0, 3), np.int64)],
            [np.zeros(0, np.int64)],
        )
        names, count = list[str](), 0
        for name, points in solids:
            try:
                hull = ConvexHull(points)
            except QhullError:
                raise InputError(
                    f"the points of '{name}' lie in a plane; expected a solid"
                ) from None
            corners = np.asarray(points, np.float64)[hull.simplices]
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            turned = (normal * hull.equations[:, :3]).sum(axis=1) < 0
            own = np.where(turned[:, None], hull.simplices[:, ::-1], hull.simplices)
            vertices.append(np.asarray(points, np.float64))
            faces.append(own + count)
            owner.append(np.full(len(own), len(names)))
            names.append(f"{name}_{1 + sum(known.rsplit('_', 1)[0] == name for known in names)}")
            count += len(points)
        return cls(
            vertices=np.concatenate(vertices).astype(np.float32),
            faces=np.concatenate(faces).astype(np.int32),
            owner=np.concatenate(owner).astype(np.int32),
            names=tuple(names),
        )

    def with_moving(self, things: list[Moving]) -> Props:
        """Add things that move; all have the same number of frames."""
        if not things:
            return self
        solids = [solid for thing in things for solid in thing.solids]
        other = Props.of(solids)
        owners = [number for number, thing in enumerate(things) for _ in thing.solids]
        return Props(
            vertices=np.concatenate([self.vertices, other.vertices]),
            faces=np.concatenate([self.faces, other.faces + np.int32(len(self.vertices))]),
            owner=np.concatenate([self.owner, other.owner + np.int32(len(self.names))]),
            names=(*self.names, *other.names),
            moves=np.stack([thing.frames for thing in things], axis=1).astype(np.float32),
            mover=np.concatenate([np.full(len(self.names), -1), owners]).astype(np.int32),
            clips=("",) * len(things),
        )

    @property
    def movers(self) -> IntArray:
        """The thing (S,) of each solid, -1 for those of the world."""
        return self.mover if len(self.mover) else np.full(len(self.names), -1, np.int32)

    def at(self, frame: int) -> FloatArray:
        """Return the vertices (V, 3) in the world in a frame; the last one stays."""
        if not len(self.moves):
            return self.vertices
        thing = np.full(len(self.vertices), -1)
        thing[self.faces] = self.movers[self.owner][:, None]
        now = self.moves[min(frame, len(self.moves) - 1)]
        moved = np.einsum("vab,vb->va", now[thing, :3, :3], self.vertices) + now[thing, :3, 3]
        found: FloatArray = np.where(thing[:, None] < 0, self.vertices, moved).astype(np.float32)
        return found

    def frame(self, number: int) -> Props:
        """Return the props of a single frame; the last one stays."""
        at = min(number, max(len(self.moves) - 1, 0))
        return dataclasses.replace(self, moves=self.moves[at : at + 1])

    def shape(self) -> Props:
        """Return the solids without their places: equal for all frames."""
        return Props(vertices=self.vertices, faces=self.faces, owner=self.owner, names=self.names)

    @classmethod
    def of_clips(cls, clips: Mapping[str, Props]) -> Props:
        """Combine the solids of several clips into one scene.

        With more than one clip, each solid's name begins with its clip's name.
        """
        some = {name: props for name, props in clips.items() if props.names}
        if len(clips) < 2 and some:
            return next(iter(some.values()))
        firsts = np.cumsum([0, *(len(props.vertices) for props in some.values())])
        owners = np.cumsum([0, *(len(props.names) for props in some.values())])
        return cls(
            vertices=np.concatenate(
                [np.zeros((0, 3), np.float32), *(props.vertices for props in some.values())]
            ),
            faces=np.concatenate(
                [
                    np.zeros((0, 3), np.int32),
                    *(p.faces + np.int32(at) for p, at in zip(some.values(), firsts, strict=False)),
                ]
            ),
            owner=np.concatenate(
                [
                    np.zeros(0, np.int32),
                    *(p.owner + np.int32(at) for p, at in zip(some.values(), owners, strict=False)),
                ]
            ),
            names=tuple(f"{clip}_{name}" for clip, props in some.items() for name in props.names),
            **_together(some),
        )

    def surfaces(self) -> list[tuple[str, Surface]]:
        """Return each solid's name and mesh; a mesh has one color and its own vertices."""
        found = []
        for number, name in enumerate(self.names):
            used, faces = np.unique(self.faces[self.owner == number], return_inverse=True)
            solid = Surface(
                vertices=self.vertices[used],
                faces=faces.reshape(-1, 3).astype(np.int32),
                colors=np.tile(np.array(COLOR, np.float32), (len(used), 1)),
            )
            found.append((name, solid))
        return found


def _together(clips: Mapping[str, Props]) -> dict[str, Any]:
    """Return `moves`, `mover` and `clips` of the things of several clips; those of a short clip
    stay where they end."""
    moving = [props.moves for props in clips.values() if len(props.moves)]
    if not moving:
        return {}
    longest = max(map(len, moving))
    firsts = np.cumsum([0, *(props.moves.shape[1] for props in clips.values())])
    return {
        "moves": np.concatenate(
            [
                np.concatenate([moves, np.repeat(moves[-1:], longest - len(moves), axis=0)])
                for moves in moving
            ],
            axis=1,
        ),
        "mover": np.concatenate(
            [
                np.where(props.movers < 0, -1, props.movers + first)
                for props, first in zip(clips.values(), firsts, strict=False)
            ]
        ).astype(np.int32),
        "clips": tuple(name for name, props in clips.items() for _ in props.clips),
    }


def box(low: FloatArray, high: FloatArray, *, bevel: float = 0.008) -> FloatArray:
    """Return points (24, 3) of a box between two corners, with edges cut by `bevel` meters.

    The cut edges keep the sides flat under smooth normals.
    """
    corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    outer = np.where(corners, high, low)
    bevel = min(bevel, 0.3 * float(np.min(np.asarray(high) - np.asarray(low))))
    inward = np.where(corners, -bevel, bevel)
    points: FloatArray = np.concatenate(
        [outer + inward * (np.arange(3) != axis) for axis in range(3)]
    )
    return points


def rod(start: FloatArray, end: FloatArray, radius: float, *, sides: int = 12) -> FloatArray:
    """Return points (4 * sides, 3) on a rod between two points, meters."""
    along = np.asarray(end, np.float64) - start
    along /= max(float(np.linalg.norm(along)), 1e-9)
    across = np.cross(along, (1.0, 0.0, 0.0) if abs(along[0]) < 0.8 else (0.0, 0.0, 1.0))
    across /= np.linalg.norm(across)
    angle = np.arange(sides) * (2 * np.pi / sides)
    ring = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * np.cross(along, across)
    rim = 0.1 * radius
    points: FloatArray = np.concatenate(
        [
            start + rim * along + radius * ring,
            end - rim * along + radius * ring,
            start + 0.9 * radius * ring,
            end + 0.9 * radius * ring,
        ]
    )
    return points
