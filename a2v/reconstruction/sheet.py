"""Draw a contact sheet of a surface."""

from __future__ import annotations

import numpy as np

from a2v.types import ByteArray, Surface


def surface_sheet(surface: Surface, *, size: int = 448) -> ByteArray:
    """Draw front, left, back and right in color and as clay, then the head from the same sides:
    (2 size, 6 size, 3) uint8."""
    from a2v.rendering.preview import PreviewStyle, preview_surface

    vertices = surface.vertices
    top = float(vertices[:, 1].max())
    tall = top - float(vertices[:, 1].min())
    crown = vertices[vertices[:, 1] > top - 0.06 * tall]
    head = np.array([np.median(crown[:, 0]), top - 0.085 * tall, np.median(crown[:, 2])])
    turns = (0.0, 90.0, 180.0, 270.0)
    colored = [preview_surface(surface, azimuth=turn, size=size) for turn in turns]
    clay = [
        preview_surface(surface, azimuth=turn, size=size, style=PreviewStyle(plain=True))
        for turn in turns
    ]
    heads = [
        preview_surface(surface, azimuth=turn, size=size, center=head, extent=0.24 * tall)
        for turn in turns
    ]
    return np.vstack([np.hstack([*colored, *heads[:2]]), np.hstack([*clay, *heads[2:]])])
