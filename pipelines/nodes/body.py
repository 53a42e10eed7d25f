"""From the person to a parametric body and the photo's camera."""

from __future__ import annotations

from a2v.body import FitSettings
from a2v.reconstruction import HandSettings
from a2v.types import Body, OrthographicCamera, Reconstruction, Subject
from pipelines.memo import measure, memo, note, progress
from pipelines.store import Ref, get, put


@memo()
def photo_body(subject: Ref[Subject], fit: FitSettings) -> tuple[Ref[Body], Ref[OrthographicCamera]]:
    """Fit the body model's shape and pose to landmarks and silhouette."""
    from a2v.body import doubts, fit_body

    result = fit_body(get(subject, Subject), settings=fit, progress=progress())
    measure(result.residuals)
    for text in doubts(result.residuals):
        note(text)
    return put(result.body), put(result.camera)


@memo()
def body(
    subject: Ref[Subject],
    surface: Ref[Reconstruction],
    photo_body: Ref[Body],
    photo_camera: Ref[OrthographicCamera],
    fit: FitSettings,
    hands: HandSettings,
) -> Ref[Body]:
    """Fit the body to the reconstructed surface (Eq. 15-18), from where the photo alone has put it, and bend its fingers.

    A surface that was made of the body itself has nothing to add.
    """
    from a2v.body import FitResult, bend_fingers, fit_body

    person, first, camera = get(surface, Reconstruction), get(photo_body, Body), get(photo_camera, OrthographicCamera)
    if person.from_body:
        return photo_body
    start = FitResult(first, camera)
    result = fit_body(get(subject, Subject), settings=fit, surface=person.surface, camera=camera, initial=start, progress=progress())
    measure(result.residuals)
    return put(bend_fingers(result.body, get(subject, Subject), camera) if hands.bend else result.body)
