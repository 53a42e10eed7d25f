"""From the fitted body to a surface with the photo's colours."""

from __future__ import annotations

import dataclasses

from a2v.reconstruction import ColorSettings, FaceSettings, HandSettings
from a2v.reconstruction.backends import BackendSettings
from a2v.types import Body, OrthographicCamera, Reconstruction, Subject, Surface
from pipelines.memo import memo, progress
from pipelines.store import Ref, get, put


@memo()
def surface(
    subject: Ref[Subject], photo_body: Ref[Body], photo_camera: Ref[OrthographicCamera], shape: BackendSettings
) -> Ref[Reconstruction]:
    """Reconstruct the person with clothes and hair; whose settings are given says by which backend."""
    from a2v.reconstruction.backends import reconstruct

    camera = get(photo_camera, OrthographicCamera)
    return put(reconstruct(get(subject, Subject), get(photo_body, Body), camera, shape, progress=progress()))


@memo()
def handed(surface: Ref[Reconstruction], body: Ref[Body], hands: HandSettings) -> Ref[Reconstruction]:
    """Sew in the body's own hands, whose fingers move."""
    from a2v.reconstruction import add_hands

    return put(add_hands(get(surface, Reconstruction), get(body, Body), settings=hands))


@memo()
def faced(
    handed: Ref[Reconstruction], subject: Ref[Subject], body: Ref[Body], photo_camera: Ref[OrthographicCamera], face: FaceSettings
) -> Ref[Reconstruction]:
    """Lay the body's own face, which has expressions, where the photo shows one."""
    from a2v.reconstruction.face import add_face

    person, camera = get(handed, Reconstruction), get(photo_camera, OrthographicCamera)
    return put(add_face(person, get(subject, Subject), get(body, Body), camera, settings=face))


@memo()
def colored(
    faced: Ref[Reconstruction], subject: Ref[Subject], body: Ref[Body], photo_camera: Ref[OrthographicCamera], color: ColorSettings
) -> Ref[Surface]:
    """Project the photo on what it sees and colour the rest (Eq. 14); the fitted body says what is the head."""
    from a2v.reconstruction.backends import color_by_photo

    person, fitted, camera = get(faced, Reconstruction), get(body, Body), get(photo_camera, OrthographicCamera)
    return put(color_by_photo(person, get(subject, Subject), fitted, camera, settings=color, progress=progress()))


@memo()
def shown(
    faced: Ref[Reconstruction], subject: Ref[Subject], body: Ref[Body], photo_camera: Ref[OrthographicCamera], color: ColorSettings
) -> Ref[Surface]:
    """As `colored`, but with the photo's shading left in: what looks as in the photo without any light."""
    from a2v.reconstruction.backends import color_by_photo

    person, fitted, camera = get(faced, Reconstruction), get(body, Body), get(photo_camera, OrthographicCamera)
    lit = dataclasses.replace(color, delight=False)
    return put(color_by_photo(person, get(subject, Subject), fitted, camera, settings=lit, progress=progress()))
