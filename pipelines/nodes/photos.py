"""Nodes that make one character from several photos of a person.

They replace the nodes between the photo and the colored surface.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from a2v.body import FitSettings
from a2v.perception import Corrections, PerceptionSettings
from a2v.reconstruction import ColorSettings, FaceSettings, HandSettings
from a2v.reconstruction.backends import BackendSettings
from a2v.reconstruction.canonical import CharacterSettings
from a2v.reconstruction.reading import Reading, ReadingSettings
from a2v.types import Body, PhotoCamera, Reconstruction, Subject, Surface
from pipelines.engine.memo import measure, memo, note, progress
from pipelines.engine.refs import Ref
from pipelines.engine.store import get, put
from pipelines.nodes.fits import Fitted
from pipelines.nodes.subject import found_in
from pipelines.nodes.values import Blob


@memo()
def other_subject(other: Ref[Blob], perception: PerceptionSettings) -> Ref[Subject]:
    """Find the person in a further photo, as `subject` does."""
    return put(found_in(other, None, None, Corrections(), perception))


@memo(remember=False)
def each_subject(subject: Ref[Subject], other_subject: np.ndarray) -> list[Ref[Subject]]:
    """Return the person in every photo, the first one first."""
    return [subject, *other_subject]


@memo()
def each_fit(each_subject: Ref[Subject], fit: FitSettings) -> Ref[Fitted]:
    """Fit the body to one of the photos alone."""
    from a2v.body import doubts, fit_body
    from a2v.body.confidence import looks_wrong

    result = fit_body(get(each_subject, Subject), settings=fit, progress=progress())
    measure(result.residuals)
    for text in doubts(result.residuals):
        note(text)
    return put(
        Fitted(body=result.body, camera=result.camera, understood=not looks_wrong(result.residuals))
    )


@memo()
def joint_fit(
    each_subject: np.ndarray, each_fit: np.ndarray, fit: FitSettings
) -> list[Ref[Fitted]]:
    """Fit one shape for all photos, and a pose and a camera for each."""
    from a2v.body.together import doubts_of, fit_together

    alone = [get(ref, Fitted) for ref in each_fit]
    used = _used(alone)
    if len(used) < len(alone):
        note(
            f"{len(alone) - len(used)} of the further photos are left out, because "
            "their fits look wrong"
        )
    fits = [alone[number].result for number in used]
    results = fit_together(
        [get(each_subject[number], Subject) for number in used],
        fits,
        settings=fit,
        progress=progress(),
    )
    measure({**results[0].residuals, "other_photos": [result.residuals for result in results[1:]]})
    for text in doubts_of(fits, results):
        note(text)
    return _replaced(
        alone, used, [Fitted(body=result.body, camera=result.camera) for result in results]
    )


def _used(fits: Sequence[Fitted]) -> list[int]:
    """Return the numbers of the used photos: the first, and further ones whose fits are right."""
    return [number for number, one in enumerate(fits) if one.understood or number == 0]


def _replaced(
    fits: Sequence[Fitted], used: Sequence[int], new: Sequence[Fitted]
) -> list[Ref[Fitted]]:
    """Return the fits of all photos, with those that are `used` replaced by the `new` ones."""
    found = dict(zip(used, new, strict=True))
    return [put(found.get(number, one)) for number, one in enumerate(fits)]


@memo()
def each_surface(
    each_subject: Ref[Subject], joint_fit: Ref[Fitted], shape: BackendSettings
) -> Ref[Reconstruction]:
    """Reconstruct each photo, as `surface` does."""
    from a2v.reconstruction.backends import reconstruct

    own = get(joint_fit, Fitted)
    return put(
        reconstruct(get(each_subject, Subject), own.body, own.camera, shape, progress=progress())
    )


@memo()
def surface_fit(
    each_subject: np.ndarray,
    joint_fit: np.ndarray,
    each_surface: np.ndarray,
    fit: FitSettings,
    hands: HandSettings,
) -> list[Ref[Fitted]]:
    """Fit one shape and a pose per photo to all surfaces (Eq. 15-18); bend the fingers."""
    from a2v.body import bend_fingers
    from a2v.body.together import fit_together

    before = [get(ref, Fitted) for ref in joint_fit]
    used = _used(before)
    subjects, people = (
        [get(each_subject[number], Subject) for number in used],
        [get(each_surface[number], Reconstruction) for number in used],
    )
    fits = [before[number].result for number in used]
    if not any(person.from_body for person in people):
        fits = fit_together(
            subjects,
            fits,
            settings=fit,
            surfaces=[person.surface for person in people],
            progress=progress(),
        )
        measure(fits[0].residuals)
    bodies = [
        bend_fingers(one.body, subject, one.camera) if hands.bend else one.body
        for one, subject in zip(fits, subjects, strict=True)
    ]
    return _replaced(
        before,
        used,
        [Fitted(body=body, camera=one.camera) for body, one in zip(bodies, fits, strict=True)],
    )


@memo(remember=False)
def first_photo(
    joint_fit: np.ndarray, each_surface: np.ndarray, surface_fit: np.ndarray
) -> tuple[Ref[Body], Ref[PhotoCamera], Ref[Reconstruction], Ref[Body]]:
    """Return the results of the first photo, in whose pose the character is made.

    They are the body by the photo, its camera, the surface, and the body by the surface.
    """
    by_photo = get(joint_fit[0], Fitted)
    return (
        put(by_photo.body),
        put(by_photo.camera),
        each_surface[0],
        put(get(surface_fit[0], Fitted).body),
    )


@memo()
def each_reading(
    each_subject: Ref[Subject],
    each_surface: Ref[Reconstruction],
    surface_fit: Ref[Fitted],
    readers: ReadingSettings,
) -> Ref[Reading]:
    """Read each photo, as `reading` does."""
    from a2v.reconstruction.reading import Source, read_photo

    fit, person = get(surface_fit, Fitted), get(each_surface, Reconstruction)
    source = Source(get(each_subject, Subject), fit.body, fit.camera, person.surface)
    return put(read_photo(source, readers.readers))


@memo()
def person_of_photos(
    each_subject: np.ndarray,
    each_surface: np.ndarray,
    surface_fit: np.ndarray,
    each_reading: np.ndarray,
    face: FaceSettings,
    figure: CharacterSettings,
) -> Ref[Reconstruction]:
    """Make the canonical character from all photos, as `surface_with_face` does for one."""
    from a2v.reconstruction.canonical import canonical_person, face_note

    main, *others = _sights(each_subject, each_surface, surface_fit, each_reading)
    made = canonical_person(main, settings=figure, face=face, others=others)
    if text := face_note(made.surface):
        note(text)
    return put(made)


@memo()
def colored_by_photos(
    surface_with_face: Ref[Reconstruction],
    each_subject: np.ndarray,
    each_surface: np.ndarray,
    surface_fit: np.ndarray,
    each_reading: np.ndarray,
    color: ColorSettings,
) -> Ref[Surface]:
    """Color each place from the photo that shows it best, as `colored_surface` does for one."""
    return put(
        _colored(surface_with_face, each_subject, each_surface, surface_fit, each_reading, color)
    )


@memo()
def shaded_by_photos(
    surface_with_face: Ref[Reconstruction],
    each_subject: np.ndarray,
    each_surface: np.ndarray,
    surface_fit: np.ndarray,
    each_reading: np.ndarray,
    color: ColorSettings,
) -> Ref[Surface]:
    """Color the surface with the shading of the photos, as `shaded_surface` does for one."""
    return put(
        _colored(
            surface_with_face,
            each_subject,
            each_surface,
            surface_fit,
            each_reading,
            dataclasses.replace(color, delight=False),
        )
    )


def _colored(
    surface_with_face: Ref[Reconstruction],
    each_subject: Any,
    each_surface: Any,
    surface_fit: Any,
    each_reading: Any,
    color: ColorSettings,
) -> Surface:
    from a2v.reconstruction.colorings import color_person

    colored = color_person(
        get(surface_with_face, Reconstruction),
        _sights(each_subject, each_surface, surface_fit, each_reading),
        settings=color,
        progress=progress(),
    )
    measure({"exposures": colored.provenance.get("exposures", [])})
    return colored


def _sights(each_subject: Any, each_surface: Any, surface_fit: Any, each_reading: Any) -> list[Any]:
    from a2v.reconstruction.canonical.several import Sight

    found = list[Any]()
    for subject, person, fitted, seen in zip(
        each_subject, each_surface, surface_fit, each_reading, strict=True
    ):
        own = get(fitted, Fitted)
        if found and not own.understood:
            continue
        found.append(
            Sight(
                get(subject, Subject),
                own.body,
                own.camera,
                get(person, Reconstruction),
                get(seen, Reading),
            )
        )
    return found
