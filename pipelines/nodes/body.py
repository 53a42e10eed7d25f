"""Nodes from the person to a parametric body and the photo's camera."""

from __future__ import annotations

import dataclasses

from a2v.body import FitSettings
from a2v.reconstruction import HandSettings
from a2v.types import Body, PhotoCamera, Reconstruction, Subject
from pipelines.engine.memo import measure, memo, note, progress
from pipelines.engine.refs import File, Ref
from pipelines.engine.store import get, put


@memo()
def photo_body(
    subject: Ref[Subject], fit: FitSettings, body_model: File | None
) -> tuple[Ref[Body], Ref[PhotoCamera]]:
    """Fit the body model's shape and pose to landmarks and silhouette.

    Whether a fit that looks wrong gave a wrong character is noted where the character is colored.
    """
    from a2v.body import doubts, fit_body
    from a2v.body.confidence import looks_wrong

    result = fit_body(
        get(subject, Subject), settings=_with_model(fit, body_model), progress=progress()
    )
    measure(result.residuals)
    if not looks_wrong(result.residuals):
        for text in doubts(result.residuals):
            note(text)
    return put(result.body), put(result.camera)


@memo()
def body(
    subject: Ref[Subject],
    surface: Ref[Reconstruction],
    photo_body: Ref[Body],
    photo_camera: Ref[PhotoCamera],
    fit: FitSettings,
    body_model: File | None,
    hands: HandSettings,
) -> Ref[Body]:
    """Fit the body to the surface (Eq. 15-18), starting from the fit to the photo; bend fingers.

    A surface that was made from the body itself is not used.
    """
    from a2v.body import FitResult, bend_fingers, fit_body

    person, first, camera = (
        get(surface, Reconstruction),
        get(photo_body, Body),
        get(photo_camera, PhotoCamera),
    )
    if person.from_body:
        return photo_body
    start = FitResult(first, camera)
    result = fit_body(
        get(subject, Subject),
        settings=_with_model(fit, body_model),
        surface=person.surface,
        camera=camera,
        initial=start,
        progress=progress(),
    )
    measure(result.residuals)
    return put(
        bend_fingers(result.body, get(subject, Subject), camera) if hands.bend else result.body
    )


def _with_model(fit: FitSettings, body_model: File | None) -> FitSettings:
    """Return the settings with a custom body model, which counts by its content."""
    return fit if body_model is None else dataclasses.replace(fit, model=body_model.path)
