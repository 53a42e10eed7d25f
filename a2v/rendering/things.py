"""A person and the props of a scene as one surface, so that both are lit and cast shadows in the
same way."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.geometry.colors import to_bytes
from a2v.props import COLOR, Props
from a2v.types import Surface

_ROWS = 8
"""Number of rows of texels in the props' color, below the surface's own texture."""


def with_props(surface: Surface, props: Props) -> Surface:
    """Append the vertices of the props to a surface (V vertices), in the props' color.

    Without props the given surface is returned. The surface's face and twins remain valid.
    """
    if not len(props.faces):
        return surface
    count = len(props.vertices)
    faces = np.concatenate([surface.faces, props.faces + len(surface.vertices)]).astype(np.int32)
    colors = np.concatenate([surface.colors, np.tile(np.array(COLOR, np.float32), (count, 1))])
    made = dataclasses.replace(
        surface,
        vertices=np.concatenate([surface.vertices, props.vertices]).astype(np.float32),
        faces=faces,
        colors=colors,
        uv=None,
        texture=None,
        normal_map=None,
        materials=None,
        standing=None,
        visible=None
        if surface.visible is None
        else np.concatenate([surface.visible, np.zeros(count, bool)]),
        twins=None
        if surface.twins is None
        else np.concatenate([surface.twins, np.full(count, -1, surface.twins.dtype)]),
    )
    if surface.uv is None or surface.texture is None:
        return made
    height = len(surface.texture)
    band = np.broadcast_to(to_bytes(np.array(COLOR)), (_ROWS, surface.texture.shape[1], 3)).astype(
        np.uint8
    )
    uv = surface.uv.astype(np.float32).copy()
    uv[..., 1] = (uv[..., 1] * height + _ROWS) / (height + _ROWS)
    plain = np.full((len(props.faces), 3, 2), (0.5, 0.5 * _ROWS / (height + _ROWS)), np.float32)
    return dataclasses.replace(
        made, uv=np.concatenate([uv, plain]), texture=np.concatenate([surface.texture, band])
    )
