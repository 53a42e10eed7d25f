"""Bake the texture of a person: trusted colors of the photo, else the colors of the vertices."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from a2v.geometry.images import nearest_known, sample_image
from a2v.geometry.mesh import within
from a2v.reconstruction.atlas import Atlas
from a2v.reconstruction.backs import Continuation
from a2v.reconstruction.backs.continuation import PATTERNED
from a2v.reconstruction.backs.seen import HAIR
from a2v.reconstruction.borders import Borders
from a2v.reconstruction.colored import ColoredMesh
from a2v.reconstruction.face.colors import EYE, FacePaint
from a2v.reconstruction.merged import OtherPhoto, mixed
from a2v.reconstruction.other_half import of_other_half
from a2v.reconstruction.projection import PhotoProjection
from a2v.system import thread_count
from a2v.types import FloatArray, IntArray

BAND = 256
"""Number of rows of the texture that are colored at a time; bounds memory."""
STRAND = 0.05
"""Largest detail of hair that is continued over unseen hair, sRGB."""


def bake(
    mesh: ColoredMesh,
    photo: PhotoProjection,
    paint: FacePaint | None,
    continued: Continuation | None,
    padded: PaddedAtlas,
    others: Sequence[OtherPhoto] = (),
) -> tuple[FloatArray, np.ndarray]:
    """Return the texture (size, size, 3) uint8 and its coordinates: trusted colors of the photo,
    else the colors of the mesh.

    With several photos, each texel takes the most trusted one (`mixed`).
    """
    atlas = padded.atlas
    size, vertices, faces = atlas.size, mesh.vertices, mesh.faces
    normals, colors = mesh.normals, mesh.colors
    texture = np.zeros((size, size, 3), np.uint8)
    borders = _borders(mesh, photo, continued)

    kinds = None if paint is None else paint.kinds[faces].max(axis=1)

    def fill(top: int) -> None:
        """Color the rows of the texture from `top` on; each band writes only its own rows."""
        rows, columns = np.nonzero(atlas.face[top : top + BAND] >= 0)
        if not len(rows):
            return
        rows = rows + top
        face = atlas.face[rows, columns]
        corner = faces[face]
        weight = atlas.barycentric[rows, columns][..., None]
        point, normal = within(vertices, corner, weight), within(normals, corner, weight)
        pixels = photo.camera.project(point)
        strongest = corner[np.arange(len(corner)), weight[..., 0].argmax(axis=1)]
        trust = photo.trust(point, normal)[:, None]
        if photo.canvas is not None:
            trust *= photo.canvas.agrees(pixels, photo.canvas.owners[strongest])[:, None]
        trust, beyond, mirrored = of_other_half(photo, mesh, corner, weight, trust)
        if kinds is not None:
            kind = kinds[face]
            eye = kind == EYE
            trust = np.where(kind == 0, trust[:, 0], eye)[:, None]
            beyond[kind > 0] = 0.0
        # colors of weight 0 are not computed: the photo covers a third of the texture
        asked = np.flatnonzero((trust[:, 0] > 0) | bool(others))
        sharp = np.zeros((len(corner), 3), np.float32)
        sharp[asked] = sample_image(photo.clean, pixels[asked])
        if paint is not None:
            sharp[eye] = _eye_colors(photo, mesh, paint, corner[eye], weight[eye])
        asked = np.flatnonzero(((trust[:, 0] < 1) & (beyond[:, 0] < 1)) | bool(others))
        smooth = np.zeros((len(corner), 3))
        smooth[asked] = (
            within(colors, corner[asked], weight[asked])
            if borders is None
            else borders.colors(corner[asked], weight[asked])
        )
        if continued is not None:
            detail = continued.at(point[asked], corner[asked], weight[asked, :, 0])
            smooth[asked] += (
                detail
                if photo.canvas is None
                else _of_hair(detail, continued.labels[strongest[asked]], continued.contrast)
            )
        if others:
            found = [other.at(corner, weight) for other in others]
            trust, sharp = mixed(
                [trust, *(one for one, _ in found)], [sharp, *(color for _, color in found)]
            )
        blended = trust * sharp + (1 - trust) * (beyond * mirrored + (1 - beyond) * smooth)
        texture[rows, columns] = np.clip(blended * 255 + 0.5, 0, 255).astype(np.uint8)

    with ThreadPoolExecutor(thread_count()) as threads:
        list(threads.map(fill, range(0, size, BAND)))
    rows, columns = padded.spots
    texture[rows, columns] = np.clip(
        colors[faces[padded.slivers]].mean(axis=1) * 255 + 0.5, 0, 255
    ).astype(np.uint8)
    return atlas.uv, texture[padded.nearest[0], padded.nearest[1]]


def _eye_colors(
    photo: PhotoProjection,
    mesh: ColoredMesh,
    paint: FacePaint,
    corner: IntArray,
    weight: FloatArray,
) -> FloatArray:
    """Colors (n, 3) of places on the eyeballs with `corner` (n, 3) vertices and barycentric
    `weight` (n, 3, 1). An eye that the nose hides has the colors of the other one."""
    if photo.canvas is not None:
        far = paint.far[corner].any(axis=1)
        corner = np.where(far[:, None], photo.canvas.twin[corner], corner)
    pixels = photo.camera.project(within(mesh.vertices, corner, weight))
    return np.asarray(sample_image(paint.eyes, pixels))


@dataclass(frozen=True, eq=False)
class PaddedAtlas:
    """A layout whose charts are extended beyond their borders, so that filtering and mipmaps show
    no gaps.

    Attributes
    ----------
    atlas : Atlas
    slivers : (n,) int
        Faces between texel centers. A sliver would show the color of any chart nearby, so each gets
        a colored texel of its own in the padding.
    spots : two arrays (n,) int
        Rows and columns of these texels.
    nearest : two arrays (size, size) int
        Row and column of the nearest texel with a color.
    """

    atlas: Atlas
    slivers: IntArray
    spots: tuple[IntArray, IntArray]
    nearest: tuple[IntArray, IntArray]

    @classmethod
    def of(cls, atlas: Atlas) -> PaddedAtlas:
        """Pad the layout of a mesh."""
        filled = np.asarray(atlas.face >= 0)
        missed = np.setdiff1d(np.arange(len(atlas.uv)), atlas.face[filled])
        middle = atlas.uv[missed].mean(axis=1) * atlas.size
        row = np.clip((atlas.size - middle[:, 1]).astype(np.int64), 0, atlas.size - 1)
        column = np.clip(middle[:, 0].astype(np.int64), 0, atlas.size - 1)
        lone = ~filled[row, column]
        spots = row[lone], column[lone]
        filled[spots] = True
        return cls(atlas, missed[lone], spots, nearest_known(filled))


def _borders(
    mesh: ColoredMesh, photo: PhotoProjection, continued: Continuation | None
) -> Borders | None:
    """The borders between the materials of a canonical person; None for others."""
    if photo.canvas is None or continued is None:
        return None
    return Borders.between(continued.materials, mesh.faces, mesh.colors, photo.known)


@functools.lru_cache(maxsize=1)
def padded_layout(atlas: Atlas) -> PaddedAtlas:
    """Pad a layout that many people share (`PaddedAtlas.of`), once for all of them."""
    return PaddedAtlas.of(atlas)


def _of_hair(detail: FloatArray, labels: IntArray, contrast: float) -> FloatArray:
    """Return the detail (n, 3), on hair without its hue, and weaker.

    Strands of hair differ only in brightness; the color of what is visible between them is not
    continued. The `contrast` of the visible hair comes down to `STRAND`. A hat with a pattern stays
    as it is.
    """
    if contrast > PATTERNED:
        return detail
    hair = labels == HAIR
    gain = min(1.0, STRAND / max(2.0 * contrast, 1e-6))
    detail[hair] = np.clip(gain * detail[hair].mean(axis=1, keepdims=True), -STRAND, STRAND)
    return detail
