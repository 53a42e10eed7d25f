"""Colors of one person from several photos: each place takes those of the photo that saw it best,
in the exposure of the main one."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import evened, vertex_normals, within
from a2v.reconstruction.canvas import Canvas
from a2v.reconstruction.projection import PhotoProjection
from a2v.reconstruction.shading import photo_without_shading
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera, Subject, Surface

_LEAST = 60
"""So many vertices of a part that both photos show tell an exposure."""
_EXPOSURE = (0.4, 2.5)
"""Least and largest factor between the exposures of two photos."""
_TINT = (0.75, 1.33)
"""The same of a channel beside the middle one: a jacket of another color behind is no other
light."""
_CLIPPED = (0.02, 0.97)
"""Colors below and above tell no exposure, sRGB."""
_SHARP = 4
"""Power of the trust by which photos are mixed: the one that sees a place better has it nearly
alone."""
_FACE = 3
"""Rings over which the other photos fade out around the face."""


@dataclass(frozen=True, eq=False)
class OtherPhoto:
    """A further photo of a canonical person, as it projects onto that person in its own pose.

    Attributes
    ----------
    photo : PhotoProjection
    vertices, normals : (V, 3)
        In the flat frame of its camera.
    canvas : Canvas
        Of that pose.
    trust : (V,)
        How far its colors are to be trusted.
    colors : (V, 3)
        sRGB.
    gain : (3,)
        From its exposure to the main photo's, linear RGB.
    allowed : (V,)
        From 0 to 1: not the face, which is the main photo's.
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
        """Of the surface in that photo's pose, in the flat frame of its camera."""
        faces, vertices = (
            np.asarray(surface.faces, np.int64),
            np.asarray(surface.vertices, np.float64),
        )
        normals = vertex_normals(surface.vertices, faces)
        photo = PhotoProjection(surface, subject, camera)
        photo.canvas = canvas
        trust = photo.trust(vertices, normals) * canvas.agrees(
            camera.project(vertices), canvas.parts
        )
        trust = trust * (photo.unoccluded(vertices) & (normals[:, 2] > 0))
        colors = photo.patch_colors(vertices, faces)
        if delight and (trust > 0.5).any():
            photo.clean = photo_without_shading(
                photo.clean, camera, vertices, faces, normals, colors=colors, seen=trust > 0.5
            )
            colors = photo.patch_colors(vertices, faces)
        return cls(
            photo, vertices, normals, canvas, trust, colors, np.ones(3), np.ones(len(vertices))
        )

    @property
    def known(self) -> BoolArray:
        """Which vertices (V,) it shows well."""
        return np.asarray(self.trust * self.allowed > 0.5)

    def beside(
        self, known: BoolArray, colors: FloatArray, faces: IntArray, face: IntArray | None
    ) -> OtherPhoto:
        """The same beside a main photo, which shows the `known` (V,) vertices in `colors` (V, 3)
        and the vertices of the `face` (n,)."""
        allowed = np.ones((len(known), 1))
        if face is not None:
            allowed[face] = 0.0
            allowed = np.minimum(allowed, evened(faces, allowed, _FACE))
        gain = exposure(self.canvas, (known, colors), (self.trust > 0.5, self.colors))
        return dataclasses.replace(
            self, gain=gain, colors=_exposed(self.colors, gain), allowed=allowed[:, 0]
        )

    def at(self, corner: IntArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far its colors are to be trusted (n, 1) at places with `corner` (n, 3) vertices and
        barycentric `weight` (n, 3, 1), and the colors (n, 3)."""
        point, normal = (within(values, corner, weight) for values in (self.vertices, self.normals))
        pixels = self.photo.camera.project(point)
        strongest = corner[np.arange(len(corner)), weight[..., 0].argmax(axis=1)]
        trust = self.photo.trust(point, normal) * self.canvas.agrees(
            pixels, self.canvas.parts[strongest]
        )
        trust = trust * (self.allowed[corner] * weight[..., 0]).sum(axis=1)
        return trust[:, None], _exposed(sample_image(self.photo.clean, pixels), self.gain)


def _exposed(colors: FloatArray, gain: FloatArray) -> FloatArray:
    return np.asarray(np.clip(linear_to_srgb(srgb_to_linear(np.clip(colors, 0, 1)) * gain), 0, 1))


def mixed(
    trusts: Sequence[FloatArray], colors: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """The largest of several trusts (n, 1), and the colors (n, 3) of those who see a place
    best."""
    share = [np.maximum(trust, 1e-4) ** _SHARP for trust in trusts]
    total = np.sum(share, axis=0)
    return np.max(trusts, axis=0), np.sum(
        [part * color for part, color in zip(share, colors, strict=True)], axis=0
    ) / total


def on_vertices(
    trust: FloatArray, known: BoolArray, colors: FloatArray, others: Sequence[OtherPhoto]
) -> tuple[BoolArray, FloatArray]:
    """Which vertices (V,) any photo shows well, and the colors (V, 3) of those that see them best;
    all of the main photo where none does."""
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
    """The factor (3,) in linear RGB from another photo's exposure to the main one's.

    `main` and `other` are which vertices (V,) each shows well, and their colors (V, 3). Of every
    part but the head, whose sides are face and hair, the medians of what both photos show of it are
    compared; the middle of the parts, by how many vertices they have, is the factor. Where two
    views end beside each other would be nearer, but there both see at a glance, and light from the
    side is in the colors.
    """
    ratios, counts = [], []
    for part in np.unique(canvas.parts):
        if PARTS[part] in ("head", "neck"):
            continue
        own = canvas.parts == part
        shown = [colors[own & known] for known, colors in (main, other)]
        shown = [
            colors[((colors > _CLIPPED[0]) & (colors < _CLIPPED[1])).all(axis=1)]
            for colors in shown
        ]
        if min(map(len, shown)) >= _LEAST:
            medians = [np.log(np.median(srgb_to_linear(colors), axis=0)) for colors in shown]
            ratios.append(medians[0] - medians[1])
            counts.append(min(map(len, shown)))
    if not ratios:
        return np.ones(3)
    found, weight = np.array(ratios), np.array(counts, np.float64)
    factor = []
    for channel in found.T:
        order = np.argsort(channel)
        share = np.cumsum(weight[order])
        factor.append(channel[order][np.searchsorted(share, share[-1] / 2)])
    gain = np.exp(factor)
    middle = np.median(gain)
    return np.asarray(np.clip(middle, *_EXPOSURE) * np.clip(gain / middle, *_TINT))
