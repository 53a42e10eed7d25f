"""What a canonical person is coloured on: the model's own texture layout."""

from __future__ import annotations

import functools

import numpy as np

from a2v.geometry.rays import texels
from a2v.reconstruction.atlas import Atlas
from a2v.reconstruction.canonical.topology import topology
from a2v.reconstruction.canvas import Canvas, part_agreement
from a2v.types import OrthographicCamera, Subject, Surface


def canvas_of(surface: Surface, subject: Subject, camera: OrthographicCamera, *, size: int) -> Canvas:
    """The canvas of a canonical person's surface, in the photo's pose, with a texture of `size` texels."""
    assert surface.standing is not None
    parts = np.asarray(surface.standing.parts, np.int64)
    return Canvas(
        rest=surface.standing.vertices.astype(np.float64), parts=parts, twin=topology().twin, atlas=layout(size),
        agreement=part_agreement(surface, parts, subject, camera),
    )  # fmt: skip


@functools.lru_cache(maxsize=2)
def layout(size: int) -> Atlas:
    """MakeHuman's texture layout on `size` texels."""
    uv = topology().uv
    face, barycentric = texels(uv.astype(np.float64) * size, size)
    return Atlas(uv, size, face, barycentric, float(size))
