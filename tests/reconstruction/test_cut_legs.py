"""Legs that the photo's lower edge cuts off are dressed."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.reconstruction import ColorSettings
from a2v.reconstruction.backs.seen import HANDS, LEG_PARTS, LOWER, SHOES, SKIN
from a2v.reconstruction.canonical import CharacterSettings, Sight
from a2v.reconstruction.canonical.coloring import canonical_painting
from a2v.reconstruction.canonical.hanging import in_skirt
from a2v.reconstruction.coloring.cut_legs import dress_cut_legs
from a2v.reconstruction.coloring.painting import Painting
from a2v.reconstruction.coloring.steps import STEPS
from a2v.samples import load_ready_person
from a2v.types import BoolArray, Reconstruction


def cut(above: str) -> Sight:
    """The sample's photo down to a joint (empty: all of it), with its body."""
    ready = load_ready_person()
    person = Reconstruction(surface=ready.colored_surface, backend="pifu")
    sight = Sight(ready.subject, ready.body, ready.photo_camera, person)
    if not above:
        return sight
    bones = [at for at, name in enumerate(ready.body.bone_names) if name.split(".")[0] == above]
    row = int(sight.camera.project(sight.body.bone_transforms[bones, :3, 3])[:, 1].min())
    image, mask = ready.subject.image[:row], ready.subject.mask[:row]
    return dataclasses.replace(
        sight, subject=dataclasses.replace(ready.subject, image=image, mask=mask)
    )


@functools.cache
def labeled(above: str) -> Painting:
    """The person before the step."""
    sight = cut(above)
    painting = canonical_painting(sight.person, [sight], ColorSettings(texture=256))
    for step in STEPS[: STEPS.index(dress_cut_legs)]:
        painting = step(painting)
    return painting


def dressed(above: str, **chosen: str) -> Painting:
    """The person after it, with the options `legs` and `legs_color`."""
    painting = labeled(above)
    provenance = {**painting.surface.provenance, **chosen}
    return dress_cut_legs(
        dataclasses.replace(
            painting, surface=dataclasses.replace(painting.surface, provenance=provenance)
        )
    )


def hidden(painting: Painting, *parts: str) -> BoolArray:
    assert painting.evidence is not None
    return painting.evidence.on(*parts) & ~painting.evidence.known


def test_trousers_and_shoes_where_nothing_of_them_is_visible() -> None:
    made = dressed("spine03", legs_color="ff0000")
    assert made.materials is not None
    assert made.evidence is not None
    legs = hidden(made, *LEG_PARTS)
    assert (made.materials.labels[legs] == LOWER).mean() > 0.95
    red = legs & (made.materials.labels == LOWER)
    assert np.allclose(made.evidence.colors[red], [1, 0, 0])
    feet = hidden(made, "left_foot", "right_foot")
    assert (made.materials.labels[feet] == SHOES).all()
    below = hidden(made, *HANDS) & (made.pixels[:, 1] >= len(made.photo.subject.mask))
    assert (made.materials.labels[below] == SKIN).all()


def test_visible_trousers_go_on() -> None:
    before, made = labeled("lowerleg01"), dressed("lowerleg01", legs_color="ff0000")
    assert made.materials is not None
    assert before.evidence is not None
    assert made.evidence is not None
    shins = hidden(made, "left_shin", "right_shin")
    assert (made.materials.labels[shins] == LOWER).mean() > 0.95
    assert np.array_equal(made.evidence.colors[shins], before.evidence.colors[shins])


def test_shorts_leave_skin() -> None:
    made = dressed("spine03", legs="shorts")
    assert made.materials is not None
    assert made.evidence is not None
    assert made.evidence.skin is not None
    shins = hidden(made, "left_shin", "right_shin")
    assert (made.materials.labels[shins] == SKIN).mean() > 0.9
    assert np.allclose(made.evidence.colors[shins & (made.materials.labels == SKIN)],
                       made.evidence.skin)  # fmt: skip
    thighs = hidden(made, "left_thigh", "right_thigh")
    assert (made.materials.labels[thighs] == LOWER).mean() > 0.7


def test_whole_people_stay_as_they_are() -> None:
    sight = cut("")
    assert in_skirt(sight) is sight
    assert labeled("").materials is not None
    assert dress_cut_legs(labeled("")) is labeled("")


def test_a_skirt_is_chosen_for_cut_legs() -> None:
    sight = cut("spine03")
    knees = sight.body.bone_names.index("lowerleg01.L")
    found = in_skirt(sight).reading
    assert found.hangs
    assert found.hem is not None
    assert found.hem[0] == pytest.approx(sight.body.rest_transforms[knees, 1, 3], abs=0.02)


def test_other_clothes_and_colors_are_refused() -> None:
    with pytest.raises(InputError, match="trousers, shorts or skirt"):
        CharacterSettings(legs="kilt")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="six hex digits"):
        CharacterSettings(legs_color="blue")
