"""Write surfaces as OBJ (with texture) and PLY (colored points)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.formats.characters import encode_texture
from a2v.geometry.mesh import vertex_normals
from a2v.io import atomic_path
from a2v.types import FloatArray, Surface


def write_obj(
    path: str | os.PathLike[str], surface: Surface, *, vertices: FloatArray | None = None
) -> None:
    """Write Wavefront OBJ with colors after the positions (``v x y z r g b``); with a texture also
    ``vt``, an ``.mtl`` and a ``.png``.

    Parameters
    ----------
    path : path
        ``.obj``; the material and the texture are next to it with the same stem.
    surface : Surface
    vertices : (V, 3) float or None
        Other positions of the same mesh, such as a deformed frame.
    """
    points = _points(surface, vertices)
    target = Path(path)
    lines = []
    if surface.uv is not None and surface.texture is not None:
        with atomic_path(target.with_suffix(".png")) as temporary:
            temporary.write_bytes(encode_texture(surface.texture, 0)[0])
        with atomic_path(target.with_suffix(".mtl")) as temporary:
            temporary.write_text(
                f"newmtl surface\nKd 1 1 1\nmap_Kd {target.stem}.png\n", encoding="utf-8"
            )
        lines += [f"mtllib {target.stem}.mtl", "usemtl surface"]
    with (
        atomic_path(target) as temporary,
        open(temporary, "w", encoding="utf-8", newline="\n") as stream,
    ):
        stream.write("".join(f"{line}\n" for line in lines))
        np.savetxt(
            stream,
            np.concatenate([points, surface.colors], axis=1),
            fmt="v %.6f %.6f %.6f %.4f %.4f %.4f",
        )
        corners = surface.faces.astype(np.int64) + 1
        if surface.uv is not None:
            unique, index = np.unique(surface.uv.reshape(-1, 2), axis=0, return_inverse=True)
            np.savetxt(stream, unique, fmt="vt %.6f %.6f")
            pairs = np.stack([corners, index.reshape(-1, 3) + 1], axis=-1).reshape(-1, 6)
            np.savetxt(stream, pairs, fmt="f %d/%d %d/%d %d/%d")
        else:
            np.savetxt(stream, corners, fmt="f %d %d %d")


def write_ply(
    path: str | os.PathLike[str], surface: Surface, *, vertices: FloatArray | None = None
) -> None:
    """Write binary PLY with positions, normals and 8-bit colors; `vertices` (V, 3) replaces the
    surface's."""
    points = _points(surface, vertices)
    normals = vertex_normals(points.astype(np.float64), surface.faces.astype(np.int64)).astype(
        "<f4"
    )
    table = np.zeros(len(points), dtype=[("p", "<f4", 3), ("n", "<f4", 3), ("c", "u1", 3)])
    table["p"], table["n"], table["c"] = (
        points,
        normals,
        np.round(np.clip(surface.colors, 0, 1) * 255),
    )
    faces = np.zeros(len(surface.faces), dtype=[("count", "u1"), ("v", "<i4", 3)])
    faces["count"], faces["v"] = 3, surface.faces
    properties = "".join(f"property float {axis}\n" for axis in ("x", "y", "z", "nx", "ny", "nz"))
    properties += "".join(f"property uchar {channel}\n" for channel in ("red", "green", "blue"))
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment a2v, meters, y up\nelement vertex "
        f"{len(table)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with atomic_path(path) as temporary:
        temporary.write_bytes(header.encode() + table.tobytes() + faces.tobytes())


def _points(surface: Surface, vertices: FloatArray | None) -> FloatArray:
    if vertices is None:
        return surface.vertices
    if np.shape(vertices) != surface.vertices.shape:
        raise InputError(
            f"vertices have shape {np.shape(vertices)}; expected {surface.vertices.shape}"
        )
    return np.asarray(vertices)
