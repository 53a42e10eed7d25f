"""What a canonical person is coloured on: the model's own texture layout."""

from __future__ import annotations

import functools

import numpy as np

from a2v.geometry.rays import texels
from a2v.reconstruction.atlas import Atlas
from a2v.reconstruction.canonical.skirt import body_layout, skirt_layout, skirt_twins
from a2v.reconstruction.canonical.topology import topology
from a2v.reconstruction.canvas import Canvas, clues_of, part_agreement
from a2v.types import Body, Camera, Subject, Surface


def canvas_of(surface: Surface, subject: Subject, body: Body, camera: Camera, *, size: int) -> Canvas:
    """The canvas of a canonical person's surface, in the photo's pose and the flat frame of `camera`, with a texture of `size` texels."""
    assert surface.standing is not None
    parts = np.asarray(surface.standing.parts, np.int64)
    own = len(topology().twin)
    hanging = len(parts) - own
    clues = clues_of(subject, body, camera, np.arange(len(parts)) >= own)
    agreement = part_agreement(surface, parts, subject, camera.flat, clues=clues)
    return Canvas(
        rest=surface.standing.vertices.astype(np.float64), parts=parts, twin=np.concatenate([topology().twin, own + skirt_twins(hanging)]),
        atlas=layout(size, hanging), agreement=agreement, hands=clues.tone(subject.image),
    )  # fmt: skip


@functools.lru_cache(maxsize=2)
def layout(size: int, hanging: int = 0) -> Atlas:
    """MakeHuman's texture layout on `size` texels; above the strip of a skirt of so many vertices that are `hanging`."""
    uv = topology().uv
    if hanging:
        uv = np.concatenate([body_layout(uv), skirt_layout(hanging)])
    face, barycentric = texels(uv.astype(np.float64) * size, size)
    return Atlas(uv, size, face, barycentric, float(size))
