"""Pictures of people for sheets."""

from __future__ import annotations

from a2v.rendering.preview import preview_surface
from a2v.types import ByteArray, FloatArray, Surface


def framed_surface(
    surface: Surface, framed: FloatArray, azimuth: float, size: int, *, border: float
) -> ByteArray:
    """A picture (size, size, 3) of a surface in the square around `framed` (V, 3), whose side is
    `border` times the largest extent of `framed`."""
    low, high = framed.min(axis=0), framed.max(axis=0)
    return preview_surface(
        surface,
        azimuth=azimuth,
        size=size,
        center=(low + high) / 2,
        extent=border * float((high - low).max()),
    )
