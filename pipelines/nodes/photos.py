"""From several photos of one person to one character: what takes the place of the nodes between the photo and its colours."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from a2v.body import FitSettings
from a2v.perception import PerceptionSettings
from a2v.reconstruction import ColorSettings, FaceSettings, HandSettings
from a2v.reconstruction.backends import BackendSettings
from a2v.reconstruction.canonical import CharacterSettings
from a2v.types import Body, PhotoCamera, Reconstruction, Subject, Surface
from pipelines.engine.memo import measure, memo, note, progress
from pipelines.engine.store import Ref, get, put
from pipelines.nodes.subject import found_in
from pipelines.nodes.values import Blob, Fitted


@memo()
def other_subject(other: Ref[Blob], perception: PerceptionSettings) -> Ref[Subject]:
    """As `subject`, of a further photo."""
    return put(found_in(other, None, None, perception))


@memo(remember=False)
def seen(subject: Ref[Subject], other_subject: np.ndarray) -> list[Ref[Subject]]:
    """The person in every photo, the first one first."""
    return [subject, *other_subject]


@memo()
def alone(seen: Ref[Subject], fit: FitSettings) -> Ref[Fitted]:
    """Fit the body to one of the photos alone."""
    from a2v.body import doubts, fit_body

    result = fit_body(get(seen, Subject), settings=fit, progress=progress())
    measure(result.residuals)
    for text in doubts(result.residuals):
        note(text)
    return put(Fitted(body=result.body, camera=result.camera))


@memo()
def joined(seen: np.ndarray, alone: np.ndarray, fit: FitSettings) -> list[Ref[Fitted]]:
    """One shape for all photos, a pose and a camera for each."""
    from a2v.body.together import doubts_of, fit_together

    subjects, fits = [get(ref, Subject) for ref in seen], [get(ref, Fitted).result for ref in alone]
    results = fit_together(subjects, fits, settings=fit, progress=progress())
    measure({**results[0].residuals, "other_photos": [result.residuals for result in results[1:]]})
    for text in doubts_of(fits, results):
        note(text)
    return [put(Fitted(body=result.body, camera=result.camera)) for result in results]


@memo()
def shaped(seen: Ref[Subject], joined: Ref[Fitted], shape: BackendSettings) -> Ref[Reconstruction]:
    """As `surface`, of each photo."""
    from a2v.reconstruction.backends import reconstruct

    own = get(joined, Fitted)
    return put(reconstruct(get(seen, Subject), own.body, own.camera, shape, progress=progress()))


@memo()
def settled(seen: np.ndarray, joined: np.ndarray, shaped: np.ndarray, fit: FitSettings, hands: HandSettings) -> list[Ref[Fitted]]:
    """As `body`, of all photos: one shape and their poses by the reconstructed surfaces (Eq. 15-18), and bent fingers."""
    from a2v.body import bend_fingers
    from a2v.body.together import fit_together

    subjects, people = [get(ref, Subject) for ref in seen], [get(ref, Reconstruction) for ref in shaped]
    fits = [get(ref, Fitted).result for ref in joined]
    if not any(person.from_body for person in people):
        fits = fit_together(subjects, fits, settings=fit, surfaces=[person.surface for person in people], progress=progress())
        measure(fits[0].residuals)
    bodies = [bend_fingers(one.body, subject, one.camera) if hands.bend else one.body for one, subject in zip(fits, subjects, strict=True)]
    return [put(Fitted(body=body, camera=one.camera)) for body, one in zip(bodies, fits, strict=True)]


@memo(remember=False)
def first(joined: np.ndarray, shaped: np.ndarray, settled: np.ndarray) -> tuple[Ref[Body], Ref[PhotoCamera], Ref[Reconstruction], Ref[Body]]:
    """What the first photo gives, in whose pose the character is made: the body by the photo, its camera, the surface, the body by the surface."""
    by_photo = get(joined[0], Fitted)
    return put(by_photo.body), put(by_photo.camera), shaped[0], put(get(settled[0], Fitted).body)


@memo()
def faced_together(
    seen: np.ndarray, shaped: np.ndarray, settled: np.ndarray, face: FaceSettings, figure: CharacterSettings
) -> Ref[Reconstruction]:
    """As `faced`: the canonical character by what all photos show."""
    from a2v.reconstruction.canonical import SMALL_FACE, canonical_person, hangs_between_legs

    main, *others = _sights(seen, shaped, settled)
    hangs = hangs_between_legs(main.person.surface, main.body, main.subject, main.camera)
    made = canonical_person(main.person, main.subject, main.body, main.camera, settings=figure, face=face, hangs=hangs, others=others)
    if made.surface.provenance.get("small_face"):
        note(SMALL_FACE)
    return put(made)


@memo()
def colored_together(faced: Ref[Reconstruction], seen: np.ndarray, shaped: np.ndarray, settled: np.ndarray, color: ColorSettings) -> Ref[Surface]:
    """As `colored`: each place in the colours of the photo that saw it best."""
    return put(_colored(faced, seen, shaped, settled, color))


@memo()
def shown_together(faced: Ref[Reconstruction], seen: np.ndarray, shaped: np.ndarray, settled: np.ndarray, color: ColorSettings) -> Ref[Surface]:
    """As `shown`."""
    return put(_colored(faced, seen, shaped, settled, dataclasses.replace(color, delight=False)))


def _colored(faced: Ref[Reconstruction], seen: Any, shaped: Any, settled: Any, color: ColorSettings) -> Surface:
    from a2v.reconstruction.backends import color_by_photo

    main, *others = _sights(seen, shaped, settled)
    colored = color_by_photo(get(faced, Reconstruction), main.subject, main.body, main.camera, settings=color, progress=progress(), others=others)
    measure({"exposures": colored.provenance.get("exposures", [])})
    return colored


def _sights(seen: Any, shaped: Any, settled: Any) -> list[Any]:
    from a2v.reconstruction.canonical.several import Sight

    found = []
    for subject, person, fitted in zip(seen, shaped, settled, strict=True):
        own = get(fitted, Fitted)
        found.append(Sight(get(subject, Subject), own.body, own.camera, get(person, Reconstruction)))
    return found
