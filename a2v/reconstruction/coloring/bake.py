"""Bake the texture of a person: trusted colors of the photo, else the colors of the vertices."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from a2v.geometry.images import sample_image
from a2v.geometry.mesh import within
from a2v.reconstruction.backs.continuation import PATTERNED
from a2v.reconstruction.backs.seen import HAIR
from a2v.reconstruction.coloring.atlas import PaddedAtlas
from a2v.reconstruction.coloring.borders import Borders
from a2v.reconstruction.coloring.elsewhere import shown_elsewhere
from a2v.reconstruction.coloring.other_photos import mixed
from a2v.reconstruction.coloring.painting import Painting
from a2v.reconstruction.face.colors import EYE, FacePaint
from a2v.system import thread_count
from a2v.types import FloatArray, IntArray

BAND = 256
"""Number of rows of the texture that are colored at a time; bounds memory."""
STRAND = 0.05
"""Largest detail of hair that is continued over unseen hair, sRGB."""
CROWN = 0.015
"""The same above long hair, which is combed."""


def bake(painting: Painting, padded: PaddedAtlas) -> tuple[FloatArray, np.ndarray]:
    """Return the texture (size, size, 3) uint8 and its coordinates: trusted colors of the photo,
    else the colors of the vertices.

    With several photos, each texel takes the most trusted one (`mixed`).
    """
    atlas, photo, paint = padded.atlas, painting.photo, painting.paint
    continued, others = painting.continued, painting.others
    size, vertices, faces = atlas.size, painting.vertices, painting.faces
    normals, colors = painting.normals, np.clip(painting.colors, 0, 1)
    texture = np.zeros((size, size, 3), np.uint8)
    borders = _borders(painting, colors)

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
        owners = None if photo.canvas is None else photo.canvas.owners[strongest]
        trust = photo.trust(point, normal, owners)[:, None]
        if painting.kept is not None:
            trust = trust * within(painting.kept[:, None], corner, weight)
        trust, beyond, mirrored = shown_elsewhere(painting, corner, weight, trust)
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
            sharp[eye] = _eye_colors(painting, paint, corner[eye], weight[eye])
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
                else _of_hair(
                    detail,
                    continued.labels[strongest[asked]],
                    continued.contrast,
                    STRAND if photo.canvas.strands is None else CROWN,
                )
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
    painting: Painting, paint: FacePaint, corner: IntArray, weight: FloatArray
) -> FloatArray:
    """Colors (n, 3) of places on the eyeballs with `corner` (n, 3) vertices and barycentric
    `weight` (n, 3, 1). An eye that the nose hides has the colors of the other one."""
    if painting.canvas is not None:
        far = paint.far[corner].any(axis=1)
        corner = np.where(far[:, None], painting.canvas.twin[corner], corner)
    pixels = painting.photo.camera.project(within(painting.vertices, corner, weight))
    return np.asarray(sample_image(paint.eyes, pixels))


def _borders(painting: Painting, colors: FloatArray) -> Borders | None:
    """The borders between the materials of a canonical person, of `colors` (V, 3); None for
    others."""
    off = "smooth_borders" in painting.settings.off
    if off or painting.canvas is None or painting.continued is None:
        return None
    materials = painting.continued.materials
    return Borders.between(materials, painting.faces, colors, painting.known)


def _of_hair(detail: FloatArray, labels: IntArray, contrast: float, most: float) -> FloatArray:
    """Return the detail (n, 3), on hair without its hue, and weaker.

    Strands of hair differ only in brightness; the color of what is visible between them is not
    continued. The `contrast` of the visible hair comes down to `most`. A hat with a pattern stays
    as it is.
    """
    if contrast > PATTERNED:
        return detail
    hair = labels == HAIR
    gain = min(1.0, most / max(2.0 * contrast, 1e-6))
    detail[hair] = np.clip(gain * detail[hair].mean(axis=1, keepdims=True), -most, most)
    return detail
