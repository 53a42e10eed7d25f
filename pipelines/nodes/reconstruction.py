"""Nodes from the fitted body to a surface with the photo's colors."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Sequence

from a2v.beside import loading_beside
from a2v.reconstruction import ColorSettings, FaceSettings, HandSettings
from a2v.reconstruction.backends import BackendSettings
from a2v.reconstruction.canonical import CharacterSettings, Sight
from a2v.types import Body, PhotoCamera, Reconstruction, Subject, Surface
from pipelines.engine.memo import memo, note, progress
from pipelines.engine.refs import Ref
from pipelines.engine.store import get, put


@memo()
def surface(
    subject: Ref[Subject],
    photo_body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    shape: BackendSettings,
) -> Ref[Reconstruction]:
    """Reconstruct the person with clothes and hair; the settings' type selects the backend."""
    from a2v.reconstruction.backends import reconstruct

    camera = get(photo_camera, PhotoCamera)
    # the remeshing uses one core; the other one prepares the texture of the usual person and size
    with loading_beside(_load_layout):
        person = reconstruct(
            get(subject, Subject), get(photo_body, Body), camera, shape, progress=progress()
        )
    return put(person)


def _load_layout() -> None:
    # By its name: the surface does not depend on this module, so an edit of it shall not make the
    # surface new.
    importlib.import_module("a2v.reconstruction.canonical.coloring").load_layout()


@memo()
def surface_with_hands(
    surface: Ref[Reconstruction], body: Ref[Body], hands: HandSettings, figure: CharacterSettings
) -> Ref[Reconstruction]:
    """Sew in the hands of the body, whose fingers move; a canonical character has them already."""
    from a2v.reconstruction import add_hands
    from a2v.reconstruction.canonical import is_canonical

    if is_canonical(get(body, Body), figure):
        return surface

    return put(add_hands(get(surface, Reconstruction), get(body, Body), settings=hands))


@memo()
def surface_with_face(
    surface_with_hands: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    face: FaceSettings,
    figure: CharacterSettings,
) -> Ref[Reconstruction]:
    """Lay the body's face with its expressions into the surface, or build the canonical character.

    The canonical character has this face already.
    """
    from a2v.reconstruction.canonical import is_canonical
    from a2v.reconstruction.face import add_face

    person, camera, fitted = (
        get(surface_with_hands, Reconstruction),
        get(photo_camera, PhotoCamera),
        get(body, Body),
    )
    if not is_canonical(fitted, figure):
        return put(add_face(person, get(subject, Subject), fitted, camera, settings=face))
    return put(build_character(Sight(get(subject, Subject), fitted, camera, person), figure, face))


def build_character(
    sight: Sight, figure: CharacterSettings, face: FaceSettings, others: Sequence[Sight] = ()
) -> Reconstruction:
    """Build the canonical character of one photo and of `others`; a small face is noted."""
    from a2v.reconstruction.canonical import SMALL_FACE, TURNED_FACE, canonical_person

    made = canonical_person(sight, settings=figure, face=face, others=others)
    if made.surface.provenance.get("small_face"):
        note(SMALL_FACE)
    elif made.surface.provenance.get("turned_face"):
        note(TURNED_FACE)
    return made


@memo()
def colored_surface(
    surface_with_face: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    color: ColorSettings,
) -> Ref[Surface]:
    """Project the photo on the visible surface and color the rest (Eq. 14).

    The fitted body shows where the head is.
    """
    return put(_colored(surface_with_face, subject, body, photo_camera, color))


@memo()
def shaded_surface(
    surface_with_face: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    color: ColorSettings,
) -> Ref[Surface]:
    """Color the surface with the photo's shading left in; without light it looks like the photo."""
    return put(
        _colored(
            surface_with_face,
            subject,
            body,
            photo_camera,
            dataclasses.replace(color, delight=False),
        )
    )


def _colored(
    surface_with_face: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    color: ColorSettings,
) -> Surface:
    from a2v.reconstruction.colorings import color_by_photo

    person, fitted, camera = (
        get(surface_with_face, Reconstruction),
        get(body, Body),
        get(photo_camera, PhotoCamera),
    )
    return color_by_photo(
        person, get(subject, Subject), fitted, camera, settings=color, progress=progress()
    )
