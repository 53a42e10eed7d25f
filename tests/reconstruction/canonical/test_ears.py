"""Ears: whether hair covers them in the photo, and their shape."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body.face import SKIN
from a2v.body.parts import PARTS
from a2v.geometry.mesh import vertex_normals
from a2v.reconstruction.canonical import Sight, canonical_person
from a2v.reconstruction.canonical.build import with_teeth
from a2v.reconstruction.canonical.ears import ears, ears_covered, flat_ears
from a2v.reconstruction.canonical.topology import topology
from a2v.types import Body, Reconstruction, Surface
from tests.support.faces import BLACK, CAMERA, with_hair
from tests.support.faces import SKIN as TONE
from tests.support.sights import with_skirt
from tests.support.surfaces import coated

TO_THE_LIPS, TO_THE_FOREHEAD = 0.05, 0.15
"""Heights of the ends of hair above the chin, meters."""


@pytest.fixture(scope="module")
def dressed(body: Body) -> Reconstruction:
    return coated(body, cell=0.012, coat=0.012)


def _made(body: Body, dressed: Reconstruction, hair: float) -> Surface:
    return canonical_person(
        with_skirt(Sight(with_hair(body, hair), body, CAMERA, dressed), False)
    ).surface


def _width(vertices: np.ndarray) -> float:
    """Distance between both ears' outermost places, meters."""
    return float(np.ptp(vertices[np.flatnonzero(ears()), 0]))


def test_ears_are_the_widest_places_of_the_head_on_both_sides(body: Body) -> None:
    rest = with_teeth(body)[1]
    own, head = np.flatnonzero(ears()), np.flatnonzero(body.parts == PARTS.index("head"))
    assert np.isin(own, head).all()
    assert np.isin(topology().twin[own], own).all()
    assert np.ptp(rest[own, 0]) == np.ptp(rest[head, 0])
    assert len(own) < 0.2 * len(head)


def test_flat_ears_continue_the_skin_around_them(body: Body) -> None:
    rest = with_teeth(body)[1]
    flat, own = flat_ears(rest), ears()
    np.testing.assert_array_equal(flat[~own], rest[~own])
    assert _width(rest) - _width(flat) > 0.02
    faces = body.faces[body.faces.max(axis=1) < SKIN.stop].astype(np.int64)
    outward = vertex_normals(flat[: SKIN.stop], faces)[:, 0] * np.sign(flat[: SKIN.stop, 0])
    assert outward[own[: SKIN.stop]].min() > 0.3  # without folds


@pytest.mark.parametrize(("hair", "covers"), [(TO_THE_LIPS, True), (TO_THE_FOREHEAD, False)])
def test_ears_without_any_color_of_skin_are_covered(body: Body, hair: float, covers: bool) -> None:
    posed = with_teeth(body)[0]
    photo = with_hair(body, hair)
    assert ears_covered(photo, posed, CAMERA) is covers
    assert ears_covered(dataclasses.replace(photo, face=None), posed, CAMERA) is None


def test_ears_beside_the_picture_of_the_person_are_unknown(body: Body) -> None:
    photo = with_hair(body, TO_THE_LIPS)
    nobody = dataclasses.replace(photo, mask=np.zeros_like(photo.mask))
    assert ears_covered(nobody, with_teeth(body)[0], CAMERA) is None


def test_a_head_in_the_color_of_its_face_has_bare_ears(body: Body) -> None:
    photo = with_hair(body, TO_THE_LIPS)
    bald = np.where((photo.image == BLACK).all(axis=-1)[..., None], TONE, photo.image)
    photo = dataclasses.replace(photo, image=bald.astype(np.uint8))
    assert ears_covered(photo, with_teeth(body)[0], CAMERA) is False


def test_covered_ears_are_flat_and_visible_ears_are_those_of_the_model(
    body: Body, dressed: Reconstruction
) -> None:
    covered, bare = (_made(body, dressed, hair) for hair in (TO_THE_LIPS, TO_THE_FOREHEAD))
    assert covered.provenance["covered_ears"] is True
    assert bare.provenance["covered_ears"] is False
    assert covered.standing is not None
    assert bare.standing is not None
    model = _width(with_teeth(body)[1])
    assert _width(bare.standing.vertices) == pytest.approx(model, abs=0.006)  # without the coat
    mesh, folds = topology(), []
    for made in (covered, bare):
        points = made.standing.vertices.astype(np.float64)
        outward = vertex_normals(points, mesh.faces)[:, 0] * np.sign(points[:, 0])
        folds.append((outward[np.flatnonzero(ears())] < 0).mean())
    assert folds[0] < 0.02
    assert folds[1] > 0.05
