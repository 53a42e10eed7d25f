"""Charts of the studio's heads: what lies on each cell of the head chart."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.body.head_chart import head_cells
from a2v.body.registry import load_body_model
from a2v.body.skin import skin_vertices
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import RayScene, at_barycentric
from a2v.lab.studio.avatar_files import list_avatars, load_avatar
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.guide import Guide, guide_key
from a2v.lab.studio.makehuman.dressing import Dresser
from a2v.lab.studio.variation import Build, split_of
from a2v.record import Record
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, Progress

NOTHING, SKIN, HAIR, HAT = range(4)
"""Kinds of a cell."""
_REACH = 0.14
"""Distance from the skin at which rays begin, meters."""
_UNDER = 0.03
"""The same below chin and jaw, where they would begin in the chest, meters."""
_DOWN = -0.35
"""y of the normals below which the second holds."""
_DEEP = 0.04
"""Largest depth of the surface below the guide's skin, meters."""


@dataclass(frozen=True, kw_only=True)
class HeadCharts(Record):
    """Charts of N heads.

    Attributes
    ----------
    under, outer : (N, H, W, 3) float16
        Places of the body's skin, and of what lies outermost on it, meters from the middle of the
        head, in T-pose.
    colors : (N, H, W, 3) uint8
        Of the outermost, sRGB.
    kinds : (N, H, W) uint8
        Kind of the outermost.
    skin : (N, H, W, 3) uint8
        Color of the skin below, sRGB.
    bare : (N, H, W) bool
        Cells whose color of skin is known.
    sources : (N,) uint8
        0: an avatar; 1: a person of MakeHuman.
    """

    under: FloatArray
    outer: FloatArray
    colors: FloatArray
    kinds: IntArray
    skin: FloatArray
    bare: BoolArray
    sources: IntArray

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        for name, shape in {
            "under": ("N", "H", "W", 3),
            "outer": ("N", "H", "W", 3),
            "colors": ("N", "H", "W", 3),
            "kinds": ("N", "H", "W"),
            "skin": ("N", "H", "W", 3),
            "bare": ("N", "H", "W"),
            "sources": ("N",),
        }.items():
            self._check(name, shape, sizes)


def make_charts(
    data: str | os.PathLike[str],
    guides: Mapping[str, Guide],
    split: str,
    *,
    people: int,
    progress: Progress | None = None,
) -> HeadCharts:
    """Make the charts of all avatars of a split, and of `people` of MakeHuman.

    Raises
    ------
    InputError
        The data are missing.
    """
    dresser = Dresser(data, 0)
    avatars = list_avatars(Path(data) / "avatars")
    paths = [path for path in avatars if split_of(path.stem) == split]

    def all_heads() -> Iterator[tuple[Avatar, Guide, int]]:
        for path in paths:
            yield load_avatar(path), guides[guide_key(path.stem)], 0
        for number in range(people):
            dressed = dresser.dressed(split, number)
            yield dressed.prepared.avatar, dressed.guide, 1

    found = []
    for number, (avatar, guide, source) in enumerate(all_heads()):
        found.append((*chart_of(avatar, guide, made=source == 1), source))
        if progress is not None:
            progress(number + 1, len(paths) + people)
    columns = [np.stack(column) for column in zip(*found, strict=True)]
    names = ("under", "outer", "colors", "kinds", "skin", "bare", "sources")
    return HeadCharts(**dict(zip(names, columns, strict=True)))


def chart_of(avatar: Avatar, guide: Guide, *, made: bool) -> tuple[np.ndarray, ...]:
    """The arrays of `HeadCharts` of one head; `made` people of MakeHuman have a mesh of skin."""
    cells = head_cells()
    transforms = avatar.rest_transforms
    body = np.zeros((len(load_body_model("anny").parts), 3))
    kept = skin_vertices(len(body), load_body_model("anny").faces)
    body[kept] = guide.posed(avatar, Build(), transforms)
    normals = np.zeros_like(body)
    normals[kept] = vertex_normals(body[kept], np.asarray(guide.faces, np.int64))
    under = cells.spread(body)[cells.valid]
    way = cells.spread(normals)[cells.valid]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    vertices = avatar.skin(transforms)
    names = [name.lower() for name in avatar.mesh_names]
    reach = np.where(way[:, 1] < _DOWN, _UNDER, _REACH)
    every = np.ones(len(avatar.faces), bool)
    outer, colors, kind = _met(avatar, vertices, every, under, way, reach)
    hair = np.array(["hair" in name or "wig" in name for name in names])
    hat = np.array([name.startswith(("hat", "cloth")) for name in names])
    kinds = np.where(kind < 0, NOTHING, np.where(hair[kind], HAIR, np.where(hat[kind], HAT, SKIN)))
    if made:
        bald = avatar.mesh_ids == names.index("skin")
        _, skin, found = _met(avatar, vertices, bald, under, way, np.full(len(way), _UNDER))
        bare = found >= 0
    else:
        skin, bare = colors, kinds == SKIN
    middle = body[kept][np.asarray(guide.parts) == 0]
    middle = (middle.min(axis=0) + middle.max(axis=0)) / 2

    def charted(values: np.ndarray, dtype: type) -> np.ndarray:
        chart: np.ndarray = np.zeros((*cells.valid.shape, *values.shape[1:]), dtype)
        chart[cells.valid] = values
        return chart

    return (
        charted(under - middle, np.float16),
        charted(outer - middle, np.float16),
        charted(colors, np.uint8),
        charted(kinds, np.uint8),
        charted(skin, np.uint8),
        charted(bare, bool),
    )


def _met(
    avatar: Avatar,
    vertices: FloatArray,
    chosen: BoolArray,
    under: FloatArray,
    way: FloatArray,
    reach: FloatArray,
) -> tuple[FloatArray, ByteArray, IntArray]:
    """Places (n, 3), colors (n, 3) uint8 and meshes (n,), -1 for none, that rays toward the skin
    meet first."""
    scene = RayScene(vertices, avatar.faces[chosen])
    start = under + reach[:, None] * way
    hits = scene.cast(start.astype(np.float32), (-way).astype(np.float32))
    hit = hits.hit & (hits.distance < reach + _DEEP)
    face = np.where(hit, hits.face, 0)
    place = at_barycentric(avatar.uv[chosen][face], np.where(hit[:, None], hits.barycentric, 0.0))
    met = np.where(hit[:, None], start - hits.distance[:, None] * way, under)
    return met, avatar.texels(place), np.where(hit, avatar.mesh_ids[chosen][face], -1)
