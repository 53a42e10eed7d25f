"""Several photos of one person: merged displacements and colors."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.reconstruction.canonical.observe import Observed
from a2v.reconstruction.canonical.several import face_of, merged


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


def test_a_person_before_and_behind_has_the_colors_of_both_photos():
    """The same body photographed in red from the front and in blue from behind."""
    from a2v.reconstruction import ColorSettings
    from a2v.reconstruction.canonical import canonical_person
    from a2v.reconstruction.canonical.several import Sight
    from a2v.reconstruction.colorings import color_by_photo
    from a2v.types import Reconstruction
    from tests.support.bodies import near_view, random_body, turned
    from tests.support.surfaces import coated

    front = random_body(5, spread=0.3, yaw=0.0)
    sights = []
    for body, color in ((front, (200, 90, 90)), (turned(front, np.pi), (90, 90, 200))):
        subject, camera = near_view(body, distance=3.0, pitch=0.1)
        subject = dataclasses.replace(
            subject, image=np.tile(np.array(color, np.uint8), (480, 480, 1))
        )
        person: Reconstruction = coated(body, cell=0.02, coat=0.01)
        sights.append(Sight(subject, body, camera, person))
    main, other = sights
    made = canonical_person(main, others=[other])
    assert made.surface.provenance["photos"] == 2
    plain = ColorSettings(texture=256, synthesis=False, delight=False)
    colored = color_by_photo(
        made, main.subject, main.body, main.camera, settings=plain, others=[other]
    )
    assert np.array_equal(colored.vertices, made.surface.vertices)
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
    gain = np.array(colored.provenance["exposures"][0])
    blue = linear_to_srgb(srgb_to_linear(np.array([90, 90, 200]) / 255) * gain)
    assert behind == pytest.approx(blue, abs=0.06)
