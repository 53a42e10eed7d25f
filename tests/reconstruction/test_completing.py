"""Heads that are completed by a network in the head chart."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from a2v.body.head_chart import HEIGHT, WIDTH, head_cells
from a2v.reconstruction import ColorSettings
from a2v.reconstruction.backs.seen import SKIN
from a2v.reconstruction.canonical import Sight
from a2v.reconstruction.canonical.coloring import canonical_painting
from a2v.reconstruction.coloring import finished
from a2v.reconstruction.coloring.completing import (
    CHANNELS,
    complete_head,
    completed,
    observed_chart,
    paint_head,
)
from a2v.reconstruction.coloring.continuing import label
from a2v.reconstruction.coloring.painting import Painting
from a2v.reconstruction.coloring.steps import STEPS
from a2v.reconstruction.palettes import lab_of
from a2v.samples import load_ready_person
from a2v.types import BoolArray, Reconstruction

SETTINGS = ColorSettings(texture=256, delight=False, tolerance=0.1)
GINGER = np.array([0.9, 0.4, 0.15])


@functools.cache
def plain() -> Painting:
    """The person of the sample before any step."""
    ready = load_ready_person()
    person = Reconstruction(surface=ready.colored_surface, backend="pifu")
    sight = Sight(ready.subject, ready.body, ready.photo_camera, person)
    return canonical_painting(person, [sight], SETTINGS)


@functools.cache
def after(count: int) -> Painting:
    """The same after the first `count` steps."""
    if count == 0:
        return plain()
    step, before = STEPS[count - 1], after(count - 1)
    return before if step.__name__ in SETTINGS.off else step(before)


def back_of_head(painting: Painting) -> BoolArray:
    """Hidden vertices on the back of the scalp, above the nape."""
    assert painting.canvas is not None
    assert painting.canvas.head is not None
    rest = painting.canvas.rest
    own = painting.canvas.head.outermost & painting.on("head")
    top = rest[own, 1].max()
    return np.asarray(own & (rest[:, 1] > top - 0.1) & (rest[:, 2] < 0.0) & ~painting.known)


def tinted(painting: Painting) -> Painting:
    """The painting with what the photo shows above the forehead in ginger."""
    photo = painting.photo
    assert photo.subject.face is not None
    lightness = photo.clean.mean(axis=2, keepdims=True)
    above = np.arange(len(photo.clean)) < photo.subject.face[10, 1] - 4
    clean = np.where(above[:, None, None], (0.3 + lightness) * GINGER, photo.clean)
    return painting.reprojected(clean.astype(np.float32))


def test_the_chart_shows_the_side_that_the_photo_shows() -> None:
    chart = observed_chart(plain())
    assert chart.shape == (CHANNELS, HEIGHT, WIDTH)
    trust = chart[3]
    front, back = trust[:, WIDTH // 4 : 3 * WIDTH // 4], trust[:, [*range(16), *range(112, 128)]]
    assert front[head_cells().valid[:, 32:96]].mean() > 0.3
    assert back.max() < 0.05
    found = completed(chart)
    middle = np.s_[int(0.55 * HEIGHT) : int(0.8 * HEIGHT), 58:70]
    assert found.cover[middle].mean() < 0.2
    # the rows above are the pole: a few square centimeters, on which the network is unsure
    assert found.cover[HEIGHT // 12 : HEIGHT // 4].mean() > 0.8


def test_hair_goes_around_in_the_color_of_the_photo() -> None:
    behind = back_of_head(plain())
    assert behind.sum() > 100
    own = lab_of(after(len(STEPS)).finished().colors)
    ginger = lab_of(finished(tinted(plain())).colors)
    assert np.median((ginger - own)[behind, 2]) > 15
    # and the nape stays skin
    look = complete_head(plain()).head_cover
    assert look is not None
    nape = look.told & ~look.covered & ~plain().known & (plain().normals[:, 2] < -0.5)
    assert nape.sum() > 50
    assert abs(np.median((ginger - own)[nape, 2])) < 8


def test_hair_in_the_color_of_the_skin_is_hair() -> None:
    painting = after(STEPS.index(label))
    cover, spots, evidence = painting.head_cover, painting.spots, painting.evidence
    assert cover is not None
    assert spots is not None
    assert evidence is not None
    grown = cover.told & cover.covered & spots.scalp
    assert grown.sum() > 500
    alike = dataclasses.replace(
        evidence, colors=np.where(grown[:, None], evidence.skin, evidence.colors)
    )
    materials = label(dataclasses.replace(painting, evidence=alike)).materials
    assert materials is not None
    assert not (materials.labels[grown] == SKIN).any()


def test_only_hidden_places_of_the_head_are_painted() -> None:
    before = complete_head(plain())
    after = paint_head(before)
    assert before.head_cover is not None
    changed = (after.colors != before.colors).any(axis=1)
    assert changed.any()
    assert not (changed & (before.known | ~before.head_cover.told)).any()
    assert not before.head_cover.told[~(before.on("head", "neck"))].any()


def test_what_another_photo_shows_stays_known() -> None:
    first = plain()
    behind = back_of_head(first)
    given = dataclasses.replace(first, known=first.known | behind)
    assert complete_head(given).known[behind].all()
    assert not complete_head(first).known[behind].any()


def test_the_inside_of_the_mouth_keeps_its_color() -> None:
    painting = after(len(STEPS))
    assert painting.paint is not None
    inner = painting.paint.inner
    np.testing.assert_array_equal(painting.colors[inner], painting.paint.colors)
