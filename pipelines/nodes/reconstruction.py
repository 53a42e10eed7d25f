"""Nodes from the fitted body to a surface with the photo's colors."""

from __future__ import annotations

import dataclasses
import importlib

from a2v.beside import loading_beside
from a2v.reconstruction import ColorSettings, FaceSettings, HandSettings
from a2v.reconstruction.backends import BackendSettings
from a2v.reconstruction.canonical import CharacterSettings, Sight
from a2v.reconstruction.reading import Reading, ReadingSettings
from a2v.types import Body, PhotoCamera, Reconstruction, Subject, Surface
from pipelines.engine.memo import measure, memo, note, progress
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
def reading(
    subject: Ref[Subject],
    surface: Ref[Reconstruction],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    figure: CharacterSettings,
    readers: ReadingSettings,
) -> Ref[Reading]:
    """Read what the photo shows, for a canonical character; of others nothing is read."""
    from a2v.reconstruction.canonical import is_canonical
    from a2v.reconstruction.reading import Source, read_photo

    fitted, camera = get(body, Body), get(photo_camera, PhotoCamera)
    source = Source(get(subject, Subject), fitted, camera, get(surface, Reconstruction).surface)
    return put(read_photo(source, readers.readers if is_canonical(fitted, figure) else ()))


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
def face_draft(
    surface_with_hands: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    reading: Ref[Reading],
    face: FaceSettings,
    figure: CharacterSettings,
) -> Ref[Reconstruction]:
    """Lay the body's face with its expressions into the surface, or build the canonical character.

    The canonical character has this face already.
    """
    from a2v.reconstruction.canonical import canonical_person, is_canonical
    from a2v.reconstruction.face import add_face

    person, camera, fitted = (
        get(surface_with_hands, Reconstruction),
        get(photo_camera, PhotoCamera),
        get(body, Body),
    )
    if not is_canonical(fitted, figure):
        return put(add_face(person, get(subject, Subject), fitted, camera, settings=face))
    sight = Sight(get(subject, Subject), fitted, camera, person, get(reading, Reading))
    return put(canonical_person(sight, settings=figure, face=face))


@memo()
def color_draft(
    face_draft: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    reading: Ref[Reading],
    color: ColorSettings,
) -> Ref[Surface]:
    """Project the photo on the visible surface and color the rest (Eq. 14).

    The fitted body shows where the head is.
    """
    return put(_colored(face_draft, subject, body, photo_camera, reading, color))


@memo()
def surface_with_face(
    face_draft: Ref[Reconstruction],
    color_draft: Ref[Surface],
    surface_with_hands: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    reading: Ref[Reading],
    face: FaceSettings,
    figure: CharacterSettings,
    color: ColorSettings,
) -> tuple[Ref[Reconstruction], Ref[Surface]]:
    """Look at the face of the canonical character; if it is none, take a simpler one.

    Returns the character and its colored surface.
    """
    from a2v.reconstruction.canonical import canonical_person, face_note
    from a2v.reconstruction.colorings import color_person
    from a2v.reconstruction.sound_face import sound_face

    drafted = get(face_draft, Reconstruction)
    sight = Sight(
        get(subject, Subject),
        get(body, Body),
        get(photo_camera, PhotoCamera),
        get(surface_with_hands, Reconstruction),
        get(reading, Reading),
    )

    def rebuilt(simpler: FaceSettings) -> tuple[Reconstruction, Surface]:
        made = canonical_person(sight, settings=figure, face=simpler)
        return made, color_person(made, [sight], settings=color)

    made, colored = sound_face(drafted, get(color_draft, Surface), face, rebuilt)
    if text := face_note(made.surface):
        note(text)
    return (face_draft, color_draft) if made is drafted else (put(made), put(colored))


@memo()
def colored_surface(
    color_with_face: Ref[Surface],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
) -> Ref[Surface]:
    """Look at the colored surface beside the photo."""
    from a2v.reconstruction.beside_photo import repose
    from a2v.reconstruction.remarks import remarks

    made, fitted = get(color_with_face, Surface), get(body, Body)
    parts = fitted.parts[:0] if made.standing is None else made.standing.parts
    shown = repose(made, parts, get(subject, Subject), get(photo_camera, PhotoCamera))
    compared = shown.compared()
    measure(compared)
    for text in remarks(compared, fitted):
        note(text)
    return color_with_face


@memo()
def shaded_surface(
    surface_with_face: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    reading: Ref[Reading],
    color: ColorSettings,
) -> Ref[Surface]:
    """Color the surface with the photo's shading left in; without light it looks like the photo."""
    return put(
        _colored(
            surface_with_face,
            subject,
            body,
            photo_camera,
            reading,
            dataclasses.replace(color, delight=False),
        )
    )


def _colored(
    surface_with_face: Ref[Reconstruction],
    subject: Ref[Subject],
    body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    reading: Ref[Reading],
    color: ColorSettings,
) -> Surface:
    from a2v.reconstruction.colorings import color_person

    person = get(surface_with_face, Reconstruction)
    sight = Sight(
        get(subject, Subject),
        get(body, Body),
        get(photo_camera, PhotoCamera),
        person,
        get(reading, Reading),
    )
    return color_person(person, [sight], settings=color, progress=progress())
