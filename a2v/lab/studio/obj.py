"""Meshes with texture coordinates from the text of an OBJ file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.types import FloatArray, IntArray

MOST = 200_000
"""Largest number of vertices, texture coordinates or triangles."""


@dataclass(frozen=True, eq=False)
class ObjMesh:
    """An OBJ's triangles.

    Attributes
    ----------
    count : int
        Number of vertices (lines ``v``); they are not kept.
    faces : (F, 3) int
        Vertices of the triangles, from 0.
    corners : (F, 3) int
        Their texture coordinates, from 0.
    coordinates : (U, 2)
        Texture coordinates (lines ``vt``), origin at the lower left.
    """

    count: int
    faces: IntArray
    corners: IntArray
    coordinates: FloatArray

    @property
    def uv(self) -> FloatArray:
        """Texture coordinates (F, 3, 2) of the triangles' corners."""
        return self.coordinates[self.corners]


def parse_obj(text: str, source: str) -> ObjMesh:
    """Parse the triangles of an OBJ with texture coordinates.

    Polygons become fans; normals and groups are ignored. Vertices may be missing (`ObjMesh.count`
    is 0) in files that contain only texture coordinates.

    Parameters
    ----------
    text : str
    source : str
        Name of the file in messages.

    Raises
    ------
    InputError
        There are no faces, or faces without texture coordinates, an index is out of range, a number
        is malformed, or there are too many elements.
    """
    count, coordinates, faces, corners = 0, [], [], []
    for line in text.splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == "v":
            count += 1
        elif words[0] == "vt":
            coordinates.append(_coordinate(words[1:3], source))
        elif words[0] == "f":
            pairs = [_corner(word, source) for word in words[1:]]
            for second in range(1, len(pairs) - 1):
                chosen = (pairs[0], pairs[second], pairs[second + 1])
                faces.append([pair[0] for pair in chosen])
                corners.append([pair[1] for pair in chosen])
        if max(count, len(faces), len(coordinates)) > MOST:
            raise InputError(f"{source} has more than {MOST} vertices or faces")
    if not faces:
        raise InputError(f"{source} has no faces")
    face, corner, uv = (
        np.array(faces) - 1,
        np.array(corners) - 1,
        np.array(coordinates).reshape(-1, 2),
    )
    if (
        face.min() < 0
        or (count and face.max() >= count)
        or corner.min() < 0
        or corner.max() >= len(uv)
    ):
        raise InputError(
            f"{source} has faces beyond its {count} vertices and {len(uv)} texture coordinates"
        )
    return ObjMesh(count, face, corner, uv)


def _coordinate(words: list[str], source: str) -> tuple[float, float]:
    try:
        u, v = (float(word) for word in words)
    except ValueError:
        u = v = np.nan
    if not (np.isfinite(u) and np.isfinite(v)):
        raise InputError(
            f"{source} has a texture coordinate '{' '.join(words)}'; expected two numbers"
        )
    return u, v


def _corner(word: str, source: str) -> tuple[int, int]:
    parts = word.split("/")
    if len(parts) < 2 or not parts[1]:
        raise InputError(f"{source} has a face without texture coordinates ('{word}')")
    try:
        vertex, corner = int(parts[0]), int(parts[1])
    except ValueError:
        vertex = corner = 2**40
    if not max(abs(vertex), abs(corner)) <= 2**31:
        raise InputError(f"{source} has a face with the corner '{word}'; expected numbers")
    return vertex, corner
