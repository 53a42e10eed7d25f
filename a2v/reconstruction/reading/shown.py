"""Which part of a body, and which vertex of a surface, the pixels of a photo show."""

from __future__ import annotations

import numpy as np

from a2v.geometry.rays import ray_scene
from a2v.types import Body, BoolArray, Camera, IntArray, OrthographicCamera, Subject, Surface

STEP = 2
"""Side of the squares of pixels of the photo that are treated as one."""


def pixels_beside(mask: BoolArray, row: int, column: int, side: int) -> int | None:
    """Number of successive pixels of a mask (h, w) from one in its range on, to the left (`side`
    -1) or the right (1); None if they reach the border, which may cut them off."""
    line = mask[row, column::side]
    return None if line.all() else int(line.argmin())


def body_shown(body: Body, subject: Subject, camera: Camera) -> IntArray:
    """Part (h, w) of a fitted body, without clothes, in every `STEP`-th pixel of the photo; -1 for
    none."""
    height, width = (side // STEP for side in subject.mask.shape)
    flat = camera.flatten(body.vertices).astype(np.float32)
    skin = Surface(
        vertices=flat,
        faces=np.asarray(body.faces, np.int32),
        colors=np.zeros(flat.shape, np.float32),
    )
    return parts_shown(skin, np.asarray(body.parts, np.int64), camera.flat, (height, width))


def parts_shown(
    surface: Surface, parts: IntArray, camera: OrthographicCamera, size: tuple[int, int]
) -> IntArray:
    """Part (h, w) of a posed surface on `parts` (V,) in every `STEP`-th pixel; -1 for none."""
    vertex = vertices_shown(surface, camera, size)
    return np.where(vertex >= 0, parts[vertex], -1)


def vertices_shown(surface: Surface, camera: OrthographicCamera, size: tuple[int, int]) -> IntArray:
    """A corner (h, w) of the triangle of a posed surface in every `STEP`-th pixel; -1 for none."""
    columns, rows = np.meshgrid(
        (np.arange(size[1]) + 0.5) * STEP, (np.arange(size[0]) + 0.5) * STEP
    )
    points = camera.unproject(np.stack([columns, rows], axis=-1), 0.0)
    rays = np.empty((*size, 6), np.float32)
    rays[..., :2], rays[..., 2], rays[..., 3:] = (
        points[..., :2],
        float(surface.vertices[:, 2].max()) + 1,
        (0, 0, -1),
    )
    found = ray_scene(surface.vertices, surface.faces, threads=0).cast_rays(rays)
    hit = np.isfinite(found["t_hit"].numpy())
    face = np.where(hit, found["primitive_ids"].numpy().astype(np.int64), 0)
    return np.where(hit, surface.faces[face, 0], -1)
