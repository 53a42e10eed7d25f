"""The person's surface as a Mitsuba mesh: cut along its texture seams, with smooth normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.geometry.colors import srgb_to_linear
from a2v.types import FloatArray, IntArray, Surface


@dataclass(frozen=True, kw_only=True)
class RenderMesh:
    """A surface cut along its texture seams, with its smooth normals.

    Mitsuba keeps one texture coordinate per vertex, so seams have to be cut. `source` (W,) maps the
    cut mesh's vertices to the surface's; `faces` (F, 3) and `uv` (W, 2) belong to the cut mesh.
    `smooth` sums face normals (times area) into vertex normals over coincident vertices, so that
    seams are invisible.
    """

    source: IntArray
    faces: IntArray
    uv: FloatArray | None
    welded: IntArray
    corner_faces: IntArray
    smooth: Any

    def normals(self, vertices: FloatArray) -> FloatArray:
        """Return smooth unit normals (W, 3) float32 for the surface's vertices (V, 3)."""
        one, two, three = (
            np.asarray(vertices, np.float32)[self.corner_faces[:, k]] for k in range(3)
        )
        (ax, ay, az), (bx, by, bz) = (two - one).T, (three - one).T
        summed = self.smooth @ np.stack(
            [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1
        )
        length = np.sqrt((summed**2).sum(axis=1, keepdims=True))
        unit = np.where(
            length > 1e-20,
            summed / np.maximum(length, 1e-20),
            np.array((0.0, 1.0, 0.0), np.float32),
        )
        return np.asarray(unit[self.welded[self.source]], np.float32)


def render_mesh(surface: Surface) -> RenderMesh:
    """Cut `surface` along its texture seams and prepare its smooth normals."""
    from scipy.sparse import csr_matrix

    faces = np.asarray(surface.faces, np.int64)
    source = np.arange(len(surface.vertices))
    cut, uv = faces, None
    if surface.uv is not None:
        corners = np.ascontiguousarray(surface.uv.reshape(-1, 2), np.float32)
        keys = np.column_stack([faces.ravel(), corners.view(np.int32)])
        _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        source, cut, uv = faces.ravel()[first], inverse.reshape(-1, 3), corners[first]
    _, welded = np.unique(np.asarray(surface.vertices, np.float32), axis=0, return_inverse=True)
    welded = welded.ravel()
    rows, columns = welded[faces].ravel(), np.repeat(np.arange(len(faces)), 3)
    smooth = csr_matrix(
        (np.ones(rows.size, np.float32), (rows, columns)), shape=(int(welded.max()) + 1, len(faces))
    )
    return RenderMesh(
        source=source, faces=cut, uv=uv, welded=welded, corner_faces=faces, smooth=smooth
    )


def mesh_object(
    mi: Any, mesh: RenderMesh, surface: Surface, *, bsdf: dict[str, Any] | None = None
) -> Any:
    """Return the Mitsuba mesh of a surface; `bsdf` may refer to the surface's colors by the string
    "surface"."""
    textured = mesh.uv is not None and surface.texture is not None
    color: dict[str, Any]
    if textured:
        color = {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(surface.texture)),
            "filter_type": "bilinear",
            "wrap_mode": "clamp",
        }
    else:
        color = {"type": "mesh_attribute", "name": "vertex_color"}
    plan = {"type": "diffuse", "reflectance": "surface"} if bsdf is None else bsdf
    plan = {
        key: color if isinstance(value, str) and value == "surface" else value
        for key, value in plan.items()
    }
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "twosided", "inside": plan})
    shape = mi.Mesh(
        "person",
        len(mesh.source),
        len(mesh.faces),
        has_vertex_normals=True,
        has_vertex_texcoords=textured,
        props=properties,
    )
    if not textured:
        shape.add_attribute("vertex_color", 3, srgb_to_linear(surface.colors[mesh.source]).ravel())
    parameters = mi.traverse(shape)
    parameters["faces"] = mesh.faces.astype(np.uint32).ravel()
    parameters["vertex_positions"] = np.asarray(surface.vertices, np.float32)[mesh.source].ravel()
    parameters["vertex_normals"] = mesh.normals(surface.vertices).ravel()
    if mesh.uv is not None and textured:
        # Mitsuba's v grows down over a bitmap's rows; `Surface.uv`'s v grows up
        parameters["vertex_texcoords"] = (
            np.column_stack([mesh.uv[:, 0], 1 - mesh.uv[:, 1]]).astype(np.float32).ravel()
        )
    parameters.update()
    return shape
