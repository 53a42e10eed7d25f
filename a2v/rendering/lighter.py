"""A small copy of a character for pages and notebooks: fewer triangles, a smaller texture, no
expressions."""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from a2v.formats.obj_ply import write_obj
from a2v.types import Character, FloatArray, IntArray, Surface


def lighter(character: Character, *, triangles: int = 6000, texture: int = 512) -> Character:
    """Return a copy of a character with at most `triangles` triangles and a texture of at most
    `texture` pixels a side.

    Edges are collapsed where shape and texture change least (Garland and Heckbert 1998, by
    MeshLab). A new vertex takes color, weights and bones of the nearest old one. The face of the
    copy has no expressions.
    """
    import cv2
    from scipy.spatial import cKDTree

    surface = character.surface
    picture = surface.texture
    if picture is not None and max(picture.shape[:2]) > texture:
        size = [
            max(1, round(side * texture / max(picture.shape[:2]))) for side in picture.shape[1::-1]
        ]
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
        surface = dataclasses.replace(surface, texture=picture)
    vertices, faces, uv = surface.vertices, surface.faces, surface.uv
    if len(faces) > triangles:
        vertices, faces, uv = _collapsed(surface, triangles)
    _, nearest = cKDTree(surface.vertices).query(vertices)
    light = dataclasses.replace(
        surface,
        vertices=vertices,
        faces=faces,
        colors=surface.colors[nearest],
        uv=uv,
        visible=None if surface.visible is None else surface.visible[nearest],
        twins=None,
        face=None,
    )
    own = {
        name: getattr(character, name)[nearest] for name in ("weights", "bones", "anchors", "parts")
    }
    return dataclasses.replace(character, surface=light, **own)


def _collapsed(surface: Surface, triangles: int) -> tuple[FloatArray, IntArray, FloatArray | None]:
    """Reduce a surface to at most `triangles` triangles.

    Returns vertices (N, 3), faces (M, 3) and texture coordinates (M, 3, 2) of the triangles'
    corners.
    """
    import pymeshlab

    meshes: Any = pymeshlab.MeshSet(verbose=False)
    with (
        tempfile.TemporaryDirectory() as folder
    ):  # MeshLab takes texture coordinates per corner only from files
        write_obj(Path(folder) / "surface.obj", surface)
        meshes.load_new_mesh(str(Path(folder) / "surface.obj"))
    if surface.uv is None:
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=triangles, preservenormal=True
        )
    else:
        meshes.meshing_decimation_quadric_edge_collapse_with_texture(
            targetfacenum=triangles, preservenormal=True
        )
    meshes.meshing_remove_unreferenced_vertices()
    made = meshes.current_mesh()
    uv = (
        None
        if surface.uv is None
        else made.wedge_tex_coord_matrix().reshape(-1, 3, 2).astype(np.float32)
    )
    return made.vertex_matrix().astype(np.float32), made.face_matrix().astype(np.int32), uv
