"""Steps that take colors from the photo, and expect those of the unseen side."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.reconstruction.coloring.expected import (
    mirrored_prior,
)
from a2v.reconstruction.coloring.nearest import nearest_known
from a2v.reconstruction.coloring.other_photos import on_vertices
from a2v.reconstruction.coloring.painting import Painting
from a2v.reconstruction.coloring.shading import photo_without_shading
from a2v.reconstruction.coloring.tones import (
    given_or_close,
    without_strangers,
)
from a2v.reconstruction.face.colors import face_paint
from a2v.reconstruction.face.drawing import drawn_over


def delight(painting: Painting) -> Painting:
    """Remove the shading of the photo from its colors."""
    if not painting.settings.delight:
        return painting
    photo = painting.photo
    return painting.reprojected(
        photo_without_shading(
            photo.clean,
            photo.camera,
            painting.vertices,
            painting.faces,
            painting.normals,
            colors=painting.colors,
            seen=painting.known,
        )
    )


def move_face(painting: Painting) -> Painting:
    """Move a face in the photo that is turned aside over the features of the model."""
    surface, photo = painting.surface, painting.photo
    if surface.face is None or not surface.provenance.get("turned_face"):
        return painting
    clean, surface = drawn_over(photo.clean, surface, photo.camera)
    return dataclasses.replace(painting.reprojected(clean), surface=surface)


def paint_face(painting: Painting) -> Painting:
    """Give the inside of the mouth and the eyeballs their colors."""
    paint = face_paint(painting.surface, painting.photo.clean)
    if paint is None:
        return painting
    known, colors, mouth = painting.known.copy(), painting.colors.copy(), painting.mouth.copy()
    known[paint.inner], colors[paint.inner], mouth[paint.inner] = True, paint.colors, True
    return dataclasses.replace(
        painting, paint=paint, known=known, main=known, colors=colors, mouth=mouth
    )


def expect(painting: Painting) -> Painting:
    """Expect on the unseen side the mirrored front, or what a network predicts."""
    photo, known = painting.photo, painting.known & ~painting.mouth
    expected = mirrored_prior(painting, known=known)
    if painting.prior is not None:
        # near visible places the photo is better than any network: its color there, or nearby
        reach, nearest = nearest_known(painting.vertices, known)
        close = np.where(
            (photo.unoccluded(painting.vertices) & (painting.normals[:, 2] > -0.2))[:, None],
            painting.colors,
            painting.colors[nearest],
        )
        expected = given_or_close(painting.prior, close=close, otherwise=expected, reach=reach)
    return dataclasses.replace(painting, expected=expected)


def add_other_photos(painting: Painting) -> Painting:
    """Take each place from the photo that shows it best."""
    if not painting.others:
        return painting
    face = painting.surface.face
    patch = None if face is None else face.patch
    others = tuple(
        other.beside(painting.known, painting.colors, painting.faces, patch)
        for other in painting.others
    )
    known, colors = on_vertices(painting.trust, painting.known, painting.colors, others)
    return dataclasses.replace(
        painting,
        others=others,
        known=known,
        colors=colors,
        seen=painting.seen | known,
    )


def replace_strangers(painting: Painting) -> Painting:
    """Expect the color of the limb where the pixel of a hidden vertex shows another part."""
    if painting.canvas is None:
        return painting
    expected = without_strangers(
        painting.expected, painting.colors, painting.canvas, painting.pixels, painting.known
    )
    return dataclasses.replace(painting, expected=expected)


def tint_hidden_hands(painting: Painting) -> Painting:
    """Expect the color of the visible hand, or of its glove, on hidden hands."""
    if painting.canvas is None or painting.canvas.hands is None:
        return painting
    expected = painting.expected.copy()
    expected[painting.hidden_hands] = painting.canvas.hands
    return dataclasses.replace(painting, expected=expected)
