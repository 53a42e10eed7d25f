"""Several photos of one person: merged displacements and colors."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.mesh import vertex_normals
from a2v.lab.evaluation.reconstruction.maps import surface_maps
from a2v.reconstruction import ColorSettings
from a2v.reconstruction.canonical import canonical_person
from a2v.reconstruction.canonical.build import posed_vertices
from a2v.reconstruction.canonical.observe import Observed
from a2v.reconstruction.canonical.several import Sight, face_of, merged
from a2v.reconstruction.colorings import color_person
from a2v.types import Surface
from tests.support.bodies import near_view, random_body, turned
from tests.support.surfaces import coated

ROW = np.arange(480)


def observed(offset: float, ahead: float) -> Observed:
    normal = np.array([[np.sqrt(1 - ahead**2), 0.0, ahead]])
    return Observed(np.array([offset]), np.ones(1), normal)


def test_an_outline_tells_more_of_a_displacement_than_a_guess_along_the_ray():
    """Also if another photo than the first one shows the outline."""
    both = [np.ones(1), np.ones(1)]
    offset, weight = merged([observed(0.02, 0.0), observed(0.01, 1.0)], both)
    assert 0.0185 < offset[0] < 0.02
    assert weight[0] == 1.0
    ahead, outline = observed(0.02, 1.0), observed(0.01, 0.0)
    assert merged([ahead, outline], both)[0][0] < merged([ahead, observed(0.01, 1.0)], both)[0][0]


def test_the_first_photo_in_whose_pose_the_person_stands_counts_more():
    offset, _ = merged([observed(0.02, 0.0), observed(0.0, 0.0)], [np.ones(1), np.ones(1)])
    assert 0.015 < offset[0] < 0.02


def test_what_one_photo_alone_knows_is_taken_from_it():
    offset, weight = merged(
        [observed(0.02, 1.0), observed(0.0, 1.0)], [np.full(1, 0.35), np.zeros(1)]
    )
    assert offset[0] == pytest.approx(0.02)
    assert weight[0] == pytest.approx(0.35)


def test_the_order_of_further_observations_means_nothing():
    seen, weights = (
        [observed(0.02, 0.8), observed(0.01, 0.3), observed(0.03, -0.5)],
        [np.full(1, value) for value in (1.0, 0.8, 0.35)],
    )
    order = [0, 2, 1]
    first = merged(seen, weights)
    second = merged([seen[k] for k in order], [weights[k] for k in order])
    assert first[0] == pytest.approx(second[0])
    assert first[1] == pytest.approx(second[1])


def test_the_first_photo_keeps_the_face_unless_another_shows_it_much_larger():
    def showing(width: float) -> SimpleNamespace:
        landmarks = np.zeros((478, 3))
        landmarks[454, 0] = width
        return SimpleNamespace(face=landmarks)

    none = SimpleNamespace(face=None)
    assert face_of([showing(50), showing(60)]) == 0  # type: ignore[list-item]
    assert face_of([showing(50), none, showing(90)]) == 2  # type: ignore[list-item]
    assert face_of([none, showing(30)]) == 1  # type: ignore[list-item]
    assert face_of([none, none]) == 0  # type: ignore[list-item]


@pytest.fixture(scope="module")
def both_sides() -> tuple[Sight, Surface, Surface]:
    """A body photographed in red from the front and in bands of two blues from behind: the second
    photo, and the person before and after coloring."""
    front = random_body(5, spread=0.3, yaw=0.0)
    red = np.tile(np.array((200, 90, 90), np.uint8), (480, 480, 1))
    bands = np.where((ROW % 60 < 30)[:, None, None], (90, 90, 200), (60, 140, 150))
    blue = np.tile(bands.astype(np.uint8), (1, 480, 1))
    sights = []
    for body, image in ((front, red), (turned(front, np.pi), blue)):
        subject, camera = near_view(body, distance=3.0, pitch=0.1)
        subject = dataclasses.replace(subject, image=image)
        sights.append(Sight(subject, body, camera, coated(body, cell=0.02, coat=0.01)))
    main, other = sights
    made = canonical_person(main, others=[other])
    plain = ColorSettings(texture=512, synthesis=False, delight=False)
    colored = color_person(made, sights, settings=plain)
    return other, made.surface, colored


def test_a_person_before_and_behind_has_the_colors_of_both_photos(
    both_sides: tuple[Sight, Surface, Surface],
):
    _, made, colored = both_sides
    assert made.provenance["photos"] == 2
    assert np.array_equal(colored.vertices, made.vertices)
    assert colored.visible is not None
    assert colored.visible.mean() > 0.45  # teeth, mouth and what limbs hide are never seen
    assert colored.standing is not None
    depth = colored.vertices[:, 2] - np.median(colored.vertices[:, 2])
    trunk = colored.standing.parts == PARTS.index("torso")
    before, behind = (
        np.median(colored.colors[trunk & own & colored.visible], axis=0)
        for own in (depth > 0.05, depth < -0.08)
    )
    assert before[0] > before[2] + 0.1
    assert behind[2] > behind[0] + 0.1


def test_a_person_drawn_as_the_second_photo_sees_it_has_the_pattern_of_that_photo(
    both_sides: tuple[Sight, Surface, Surface],
):
    import cv2

    other, _, colored = both_sides
    assert colored.standing is not None
    seen = other.camera.flatten(posed_vertices(colored.standing, other.body))
    posed = dataclasses.replace(colored, vertices=seen.astype(np.float32))
    normals = vertex_normals(posed.vertices, posed.faces).astype(np.float32)
    drawn = surface_maps(posed, normals, other.camera.flat, (480, 480), size=480, side=1)
    gain = np.array(colored.provenance["exposures"][0])
    wanted = linear_to_srgb(srgb_to_linear(other.subject.image / 255.0) * gain)
    inner = cv2.erode((other.subject.mask > 0.5).astype(np.uint8), np.ones((13, 13))) > 0
    clear = (np.minimum(ROW % 30, 30 - ROW % 30) > 4)[:, None]  # away from the bands' borders
    asked = inner & clear & drawn.mask
    assert asked.sum() > 3000
    assert np.percentile(np.abs(drawn.colors - wanted)[asked].max(axis=1), 90) < 0.05
