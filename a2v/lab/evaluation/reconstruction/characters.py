"""Make canonical characters as the pipeline does, from one or several photos of a person, for the
benchmark."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from a2v.body import FitResult, fit_body
from a2v.body.settings import FitSettings
from a2v.body.together import fit_together
from a2v.reconstruction.backends import DEFAULT_BACKEND, reconstruct, settings_of
from a2v.reconstruction.canonical import Sight, canonical_person
from a2v.reconstruction.colorings import color_person
from a2v.types import Subject, Surface


def character_of(
    subjects: Sequence[Subject],
    fits: Sequence[FitResult],
    *,
    settings: FitSettings,
    weights: str = "",
) -> tuple[Surface, FitResult]:
    """The colored character in the pose of its first photo, and the fit to that photo.

    `fits` are the separate fits to each photo (`fit_body`).
    """
    shape = settings_of(DEFAULT_BACKEND, weights)
    if len(subjects) > 1:
        fits = fit_together(subjects, fits, settings=settings)
    people = [
        reconstruct(subject, fit.body, fit.camera, shape)
        for subject, fit in zip(subjects, fits, strict=True)
    ]
    if len(subjects) > 1:
        settled = fit_together(
            subjects, fits, settings=settings, surfaces=[person.surface for person in people]
        )
    else:
        settled = [
            fit_body(
                subjects[0],
                settings=settings,
                surface=people[0].surface,
                camera=fits[0].camera,
                initial=fits[0],
            )
        ]
    sights = [
        Sight(subject, fit.body, fit.camera, person)
        for subject, fit, person in zip(subjects, settled, people, strict=True)
    ]
    main, *others = sights
    made = canonical_person(main, others=others)
    colored = color_person(made, sights)
    return colored, dataclasses.replace(settled[0], residuals=fits[0].residuals)
