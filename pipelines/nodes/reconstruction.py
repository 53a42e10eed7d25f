"""From the fitted body to a surface with the photo's colours."""

from __future__ import annotations

from a2v.reconstruction import ColorSettings, SurfaceSettings
from a2v.types import Body, OrthographicCamera, Subject, Surface
from pipelines.memo import memo, progress
from pipelines.store import Ref, get, put


@memo(uses=("reconstruction", "body.parts"))
def surface(subject: Ref[Subject], body: Ref[Body], photo_camera: Ref[OrthographicCamera], shape: SurfaceSettings) -> Ref[Surface]:
    """Push the fitted body out to the silhouette: clothes and hair."""
    from a2v.reconstruction import body_prior_surface

    return put(
        body_prior_surface(
            get(subject, Subject), get(body, Body), get(photo_camera, OrthographicCamera), settings=shape, progress=progress()
        )
    )


@memo(uses=("reconstruction", "body.parts"))
def colored(
    surface: Ref[Surface], subject: Ref[Subject], body: Ref[Body], photo_camera: Ref[OrthographicCamera], color: ColorSettings
) -> Ref[Surface]:
    """Project the photo on what it sees and colour the rest (Eq. 14); the fitted body says what is the head."""
    from a2v.body import nearest_parts
    from a2v.reconstruction import color_surface

    shape = get(surface, Surface)
    camera = get(photo_camera, OrthographicCamera)
    parts = nearest_parts(shape.vertices, get(body, Body))
    return put(color_surface(shape, get(subject, Subject), camera, parts=parts, settings=color, progress=progress()))
