"""Color a surface from the photo by a list of steps: visible places by projection, others by
Eq. 14, in one texture."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from a2v.errors import InputError
from a2v.reconstruction.coloring.atlas import PaddedAtlas, make_atlas, padded_layout
from a2v.reconstruction.coloring.bake import bake
from a2v.reconstruction.coloring.completing import complete_head, paint_head
from a2v.reconstruction.coloring.continuing import (
    bare_crossed_arms,
    continue_materials,
    gather_evidence,
    keep_to_palette,
    label,
    pair_sides,
    run_borders,
    split_panels,
)
from a2v.reconstruction.coloring.cut_legs import dress_cut_legs
from a2v.reconstruction.coloring.expecting import (
    add_other_photos,
    delight,
    expect,
    move_face,
    paint_face,
    replace_strangers,
    tint_hidden_hands,
)
from a2v.reconstruction.coloring.painting import ColorEvidence, ColoringStep, Painting
from a2v.reconstruction.coloring.settings import ColorSettings
from a2v.reconstruction.coloring.solving import (
    comb,
    even,
    solve,
    wear_gloves,
)
from a2v.types import OrthographicCamera, Progress, Subject, Surface

STEPS: tuple[ColoringStep, ...] = (
    delight,
    move_face,
    paint_face,
    expect,
    add_other_photos,
    replace_strangers,
    tint_hidden_hands,
    complete_head,
    gather_evidence,
    pair_sides,
    bare_crossed_arms,
    label,
    run_borders,
    dress_cut_legs,
    split_panels,
    continue_materials,
    keep_to_palette,
    solve,
    wear_gloves,
    paint_head,
    even,
    comb,
)
"""What colors a surface, in this order, between the projection of the photo and the texture."""


def color_surface(
    surface: Surface,
    subject: Subject,
    camera: OrthographicCamera,
    *,
    evidence: ColorEvidence | None = None,
    settings: ColorSettings | None = None,
    progress: Progress | None = None,
) -> Surface:
    """Color `surface` from the photo (Sec. 4.2.1 and Eq. 14 of the journal paper).

    Parameters
    ----------
    surface : Surface
        Of any backend, in the frame of `camera`.
    subject : Subject
    camera : OrthographicCamera
        Of `subject.image`.
    evidence : ColorEvidence, optional
        What is known in addition to the photo.

    Returns
    -------
    Surface
        With `colors` (albedo, in light as bright as the photo's), `visible`, and `uv` and `texture`
        unless ``settings.texture`` is 0. `provenance["eq14"]` reports iterations, residual and
        objective.

    Raises
    ------
    InputError
        Arrays of the wrong shape, or a surface that the camera does not see.
    """
    evidence = evidence or ColorEvidence()
    _check_given(len(surface.vertices), evidence)
    painting = Painting.of(surface, subject, camera, evidence, settings or ColorSettings())
    return finished(painting, progress=progress)


def finished(
    painting: Painting, steps: Sequence[ColoringStep] = STEPS, *, progress: Progress | None = None
) -> Surface:
    """Take `steps` that are not left out, and bake the texture."""
    report, settings = progress or (lambda done, total: None), painting.settings
    # it makes the charts of the texture, while this thread makes the colors
    beside = ThreadPoolExecutor(1)
    atlas = beside.submit(_atlas, painting) if settings.texture else None
    beside.shutdown(wait=False)
    for number, step in enumerate(steps, 1):
        report(number, len(steps) + 2)
        if step.__name__ not in settings.off:
            painting = step(painting)
    if atlas is not None:
        uv, texture = bake(painting, atlas.result())
        painting = dataclasses.replace(painting, uv=uv, texture=texture)
    report(1, 1)
    return painting.finished()


def _check_given(count: int, evidence: ColorEvidence) -> None:
    """Check that the evidence fits a surface of `count` vertices."""
    prior, spots = evidence.prior, evidence.spots
    if prior is not None and np.shape(prior) != (count, 3):
        raise InputError(f"prior has shape {np.shape(prior)}; expected ({count}, 3)")
    if spots is not None and len(spots.parts) != count:
        raise InputError(
            f"spots has {len(spots.parts)} points; expected {count}, one for each vertex"
        )


def _atlas(painting: Painting) -> PaddedAtlas:
    """The layout of the texture."""
    if painting.canvas is not None:
        return padded_layout(painting.canvas.atlas)
    return PaddedAtlas.of(
        make_atlas(
            painting.vertices,
            painting.faces,
            size=painting.settings.texture,
            density=1.5 * painting.photo.camera.scale,
        )
    )
