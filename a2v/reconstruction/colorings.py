"""Colorings of a reconstruction, by name. They are separate from the backends, so that stored
surfaces stay valid when a coloring changes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from a2v.errors import InputError
from a2v.geometry.images import sample_image
from a2v.reconstruction.canonical.several import Sight
from a2v.reconstruction.coloring import ColorEvidence, ColorSettings, color_surface
from a2v.types import Body, Camera, Progress, Reconstruction, Subject, Surface

Coloring = Callable[[Reconstruction, Subject, Body, Camera], Surface]
"""``(reconstruction, subject, fitted body, its camera) -> colored surface``."""


def color_by_photo(
    person: Reconstruction,
    subject: Subject,
    body: Body,
    camera: Camera,
    *,
    settings: ColorSettings | None = None,
    progress: Progress | None = None,
) -> Surface:
    """Color as the pipeline does, by one photo (`color_person`)."""
    sight = Sight(subject, body, camera, person)
    return color_person(person, [sight], settings=settings, progress=progress)


def color_person(
    person: Reconstruction,
    sights: Sequence[Sight],
    *,
    settings: ColorSettings | None = None,
    progress: Progress | None = None,
) -> Surface:
    """Color as the pipeline does: visible places by the photos, others by Eq. 14 with the prior of
    the backend (or the default one).

    A person that is not canonical has one of `sights`. A canonical one stands as in the first; the
    main photo is then the one that gives the face (``provenance["face_photo"]``).
    """
    settings = settings or ColorSettings()
    if person.surface.standing is not None:
        from a2v.reconstruction.canonical.coloring import color_canonical

        return color_canonical(person, sights, settings=settings, progress=progress)
    from a2v.body.spots import nearest_spots

    (sight,) = sights
    flat = sight.camera.flatten(person.surface.vertices)
    colored = color_surface(
        dataclasses.replace(person.surface, vertices=flat),
        sight.subject,
        sight.camera.flat,
        evidence=ColorEvidence(
            prior=person.expected_colors,
            spots=nearest_spots(person.surface.vertices, sight.body),
        ),
        settings=settings,
        progress=progress,
    )
    return dataclasses.replace(colored, vertices=person.surface.vertices)


def color_by_equation(
    person: Reconstruction, subject: Subject, body: Body, camera: Camera
) -> Surface:
    """Ablation: the photo and Eq. 14 alone, without continuation over the unseen side
    (`ColorSettings.synthesis`)."""
    return color_by_photo(person, subject, body, camera, settings=ColorSettings(synthesis=False))


def color_mirrored(person: Reconstruction, subject: Subject, body: Body, camera: Camera) -> Surface:
    """Ablation: every point, visible or not, has the color of its pixel; the back is the mirrored
    front."""
    from a2v.geometry.colors import to_bytes
    from a2v.reconstruction.coloring.projection import clean_colors

    clean = clean_colors(subject)
    height, width = clean.shape[:2]
    pixels = camera.project(person.surface.vertices)
    corners = pixels[person.surface.faces] / np.array([width, height])
    return dataclasses.replace(
        person.surface,
        colors=np.clip(sample_image(clean, pixels), 0, 1).astype(np.float32),
        uv=np.stack([corners[..., 0], 1 - corners[..., 1]], axis=-1).astype(np.float32),
        texture=to_bytes(clean),
    )


def color_by_network(
    person: Reconstruction, subject: Subject, body: Body, camera: Camera
) -> Surface:
    """Ablation: only the colors of the backend, on the vertices.

    Raises
    ------
    InputError
        The backend has no colors.
    """
    if person.expected_colors is None:
        raise InputError(
            "this backend predicts no colors; choose another one for the coloring 'network'"
        )
    known = np.isfinite(person.expected_colors).all(axis=1)
    colors = np.where(
        known[:, None],
        np.nan_to_num(person.expected_colors),
        person.expected_colors[known].mean(axis=0),
    )
    return dataclasses.replace(
        person.surface, colors=colors.astype(np.float32), uv=None, texture=None
    )


COLORINGS: Mapping[str, Coloring] = {
    "ours": color_by_photo,
    "eq14": color_by_equation,
    "mirrored": color_mirrored,
    "network": color_by_network,
}
"""Colorings by name: "ours" is used in the product, the others are ablations."""
