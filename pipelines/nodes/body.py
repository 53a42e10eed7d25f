"""From the person to a parametric body and the photo's camera."""

from __future__ import annotations

from a2v.body import FitSettings
from a2v.types import Body, OrthographicCamera, Subject, Surface
from pipelines.memo import measure, memo, progress
from pipelines.store import Ref, get, put


@memo()
def photo_body(subject: Ref[Subject], fit: FitSettings) -> tuple[Ref[Body], Ref[OrthographicCamera]]:
    """Fit the body model's shape and pose to landmarks and silhouette."""
    from a2v.body import fit_body

    result = fit_body(get(subject, Subject), settings=fit, progress=progress())
    measure(result.residuals)
    return put(result.body), put(result.camera)


@memo()
def body(
    subject: Ref[Subject], surface: Ref[Surface], photo_body: Ref[Body], photo_camera: Ref[OrthographicCamera], fit: FitSettings
) -> Ref[Body]:
    """Fit the body to the reconstructed surface (Eq. 15-18), from where the photo alone has put it.

    A surface that was made of the body itself has nothing to add.
    """
    from a2v.body import FitResult, fit_body

    shape, first, camera = get(surface, Surface), get(photo_body, Body), get(photo_camera, OrthographicCamera)
    if shape.provenance.get("backend") == "body-prior":
        return photo_body
    result = fit_body(
        get(subject, Subject), settings=fit, surface=shape, camera=camera, initial=FitResult(first, camera), progress=progress()
    )
    measure(result.residuals)
    return put(result.body)
