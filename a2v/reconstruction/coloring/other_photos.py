"""Merge colors of one person from several photos: each place takes the best view, in the exposure
of the main photo."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import evened, vertex_normals, within
from a2v.reconstruction.coloring.canvas import Canvas
from a2v.reconstruction.coloring.projection import PhotoProjection
from a2v.reconstruction.coloring.shading import LUMINANCE, photo_without_shading
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera, Subject, Surface

_LEAST = 60
"""Smallest number of vertices of a part, visible in both photos, that give an exposure."""
_EXPOSURE = (0.4, 2.5)
"""Smallest and largest factor between the exposures of two photos."""
_TINT = (0.75, 1.33)
"""Smallest and largest factor of a channel relative to the middle one. A back of another color is
not another light."""
_SHARP = 4
"""Power of the trust by which photos are blended; high, so that mainly the best view of a place
counts."""
_FACE = 3
"""Number of rings of vertices over which the other photos fade out around the face."""


@dataclass(frozen=True, eq=False)
class OtherPhoto:
    """A further photo of a canonical person, projected onto that person in the pose of that photo.

    Attributes
    ----------
    photo : PhotoProjection
    vertices, normals : (V, 3)
        In the flat frame of its camera.
    canvas : Canvas
        Of that pose.
    trust : (V,)
        Trust in its colors, from 0 to 1.
    colors : (V, 3)
        sRGB.
    gain : (3,)
        Factor from its exposure to that of the main photo, linear RGB.
    allowed : (V,)
        From 0 to 1; 0 in the face, which is taken from the main photo.
    """

    photo: PhotoProjection
    vertices: FloatArray
    normals: FloatArray
    canvas: Canvas
    trust: FloatArray
    colors: FloatArray
    gain: FloatArray
    allowed: FloatArray

    @classmethod
    def of(
        cls,
        surface: Surface,
        subject: Subject,
        camera: OrthographicCamera,
        canvas: Canvas,
        *,
        delight: bool,
    ) -> OtherPhoto:
        """Project a photo onto the surface in its pose, in the flat frame of its camera."""
        faces, vertices = (
            np.asarray(surface.faces, np.int64),
            np.asarray(surface.vertices, np.float64),
        )
        normals = vertex_normals(surface.vertices, faces)
        photo = PhotoProjection(surface, subject, camera, canvas)
        trust = photo.trust(vertices, normals, canvas.owners)
        trust = trust * (photo.unoccluded(vertices) & (normals[:, 2] > 0))
        colors = photo.patch_colors(vertices, faces)
        if delight and (trust > 0.5).any():
            photo = photo.in_colors(
                photo_without_shading(
                    photo.clean, camera, vertices, faces, normals, colors=colors, seen=trust > 0.5
                )
            )
            colors = photo.patch_colors(vertices, faces)
        return cls(
            photo, vertices, normals, canvas, trust, colors, np.ones(3), np.ones(len(vertices))
        )

    @property
    def known(self) -> BoolArray:
        """Which vertices (V,) the photo shows well."""
        return np.asarray(self.trust * self.allowed > 0.5)

    def beside(
        self, known: BoolArray, colors: FloatArray, faces: IntArray, face: IntArray | None
    ) -> OtherPhoto:
        """Fit the exposure to a main photo, which shows the `known` (V,) vertices in `colors` (V,
        3) and the vertices of the `face` (n,)."""
        allowed = np.ones((len(known), 1))
        if face is not None:
            allowed[face] = 0.0
            allowed = np.minimum(allowed, evened(faces, allowed, _FACE))
        gain = exposure(self.canvas, (known, colors), (self.trust > 0.5, self.colors))
        return dataclasses.replace(
            self, gain=gain, colors=_exposed(self.colors, gain), allowed=allowed[:, 0]
        )

    def at(self, corner: IntArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Trust (n, 1) and colors (n, 3) at places with `corner` (n, 3) vertices and barycentric
        `weight` (n, 3, 1)."""
        point, normal = (within(values, corner, weight) for values in (self.vertices, self.normals))
        pixels = self.photo.camera.project(point)
        strongest = corner[np.arange(len(corner)), weight[..., 0].argmax(axis=1)]
        trust = self.photo.trust(point, normal, self.canvas.owners[strongest])
        trust = trust * (self.allowed[corner] * weight[..., 0]).sum(axis=1)
        return trust[:, None], _exposed(sample_image(self.photo.clean, pixels), self.gain)


def _exposed(colors: FloatArray, gain: FloatArray) -> FloatArray:
    return np.asarray(np.clip(linear_to_srgb(srgb_to_linear(np.clip(colors, 0, 1)) * gain), 0, 1))


def mixed(
    trusts: Sequence[FloatArray], colors: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Blend colors (n, 3) by their trusts (n, 1); returns the largest trust and the blend."""
    share = [np.maximum(trust, 1e-4) ** _SHARP for trust in trusts]
    total = np.sum(share, axis=0)
    return np.max(trusts, axis=0), np.sum(
        [part * color for part, color in zip(share, colors, strict=True)], axis=0
    ) / total


def on_vertices(
    trust: FloatArray, known: BoolArray, colors: FloatArray, others: Sequence[OtherPhoto]
) -> tuple[BoolArray, FloatArray]:
    """Return which vertices (V,) any photo shows well, and their colors (V, 3) from the best views.

    All other vertices keep the colors of the main photo.
    """
    every = known.copy()
    for other in others:
        every |= other.known
    trusts = [
        np.where(known, trust, 0.0)[:, None],
        *(np.where(other.known, other.trust * other.allowed, 0.0)[:, None] for other in others),
    ]
    best = mixed(trusts, [colors, *(other.colors for other in others)])[1]
    return every, np.where(
        (every & ~(known & (np.max(trusts[1:], axis=0)[:, 0] == 0)))[:, None], best, colors
    )


def exposure(
    canvas: Canvas, main: tuple[BoolArray, FloatArray], other: tuple[BoolArray, FloatArray]
) -> FloatArray:
    """Factor (3,), linear RGB, from the exposure of another photo to that of the main one.

    `main` and `other` are the vertices (V,) that each shows well, and their colors (V, 3). The
    factor gives the other photo the mean linear color of the main one. The mean is taken part by
    part, weighted by the smaller number of vertices of a part in both photos, because each photo
    shows other places. Only the darker half of a part counts, because gloss brightens the other
    half, and cameras compress it. The head is left out: its sides are face and hair. The seam
    between two views is not compared, because there both views are grazing, and light from the side
    changes the colors.
    """
    totals = np.zeros((2, 3))
    for part in np.unique(canvas.parts):
        if PARTS[part] in ("head", "neck"):
            continue
        own = canvas.parts == part
        shown = [srgb_to_linear(colors[own & known]) for known, colors in (main, other)]
        count = min(map(len, shown))
        if count >= _LEAST:
            totals += [count * _darker_half(colors).mean(axis=0) for colors in shown]
    if not totals.all():
        return np.ones(3)
    gain = totals[0] / totals[1]
    middle = np.median(gain)
    return np.asarray(np.clip(middle, *_EXPOSURE) * np.clip(gain / middle, *_TINT))


def _darker_half(colors: FloatArray) -> FloatArray:
    """Return those linear colors of (n, 3) whose luminance is at most the median."""
    bright = colors @ LUMINANCE
    return np.asarray(colors[bright <= np.median(bright)])
