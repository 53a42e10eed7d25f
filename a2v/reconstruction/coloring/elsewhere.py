"""Give places that the photo hides the texture of others: heads are symmetric, and cloth that hangs
looks alike all around."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import on_parts
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import within
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.coloring.painting import Painting
from a2v.types import BoolArray, FloatArray, IntArray

HEAD = ("head", "neck")
_WORSE = (0.45, 0.8)
"""Ratios of how directly a place and the other place face the camera. Below the first ratio the
place takes the colors of the other place, above the second its own."""


def shown_elsewhere(
    painting: Painting, corner: IntArray, weight: FloatArray, trust: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sample the mirrored places of head and neck, and the visible side of hanging cloth.

    The places have `corner` (n, 3) vertices and barycentric `weight` (n, 3, 1).

    Returns
    -------
    The `trust` (n, 1) in the photo's own colors, lowered if the other place is seen much more
    squarely; the trust (n, 1) in the colors of the other place; and these colors (n, 3), sRGB.
    """
    kept, beyond, colors = trust.copy(), np.zeros((len(corner), 1)), np.zeros((len(corner), 3))
    photo, canvas = painting.photo, painting.canvas
    if canvas is None:
        return kept, beyond, colors
    off, other = painting.settings.off, canvas.twin
    chosen = on_parts(canvas.parts, *HEAD) & ("mirror_texels" not in off)
    if canvas.loose is not None and canvas.around is not None and "repeat_cloth" not in off:
        chosen, other = chosen | canvas.loose, np.where(canvas.loose, canvas.around, other)
    own = np.flatnonzero(_all_of(chosen, corner))
    if not len(own):
        return kept, beyond, colors
    share = weight[own]
    there = other[corner[own]]
    point, normal = (
        within(values, there, share) for values in (painting.vertices, painting.normals)
    )
    owner = canvas.owners[there[np.arange(len(own)), share[..., 0].argmax(axis=1)]]
    beyond[own, 0] = photo.trust(point, normal, owner)
    if painting.kept is not None:
        beyond[own] *= within(painting.kept[:, None], there, share)
    colors[own] = sample_image(photo.clean, photo.camera.project(point))
    facing = np.maximum(within(painting.normals, corner[own], share)[:, 2], 0.0)
    worse = 1 - smoothstep(facing / np.maximum(normal[:, 2], 1e-6), *_WORSE)
    kept[own, 0] *= 1 - worse * beyond[own, 0]
    return kept, beyond, colors


def _all_of(chosen: BoolArray, corner: IntArray) -> BoolArray:
    """Return whether all vertices of `corner` (n, 3) are `chosen` (V,)."""
    first, second, third = (chosen[corner[:, k]] for k in range(3))
    return np.asarray(first & second & third)
