"""The body's hands on a surface: it stays closed, fingers move, touching hands are kept."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree

from a2v.animation import bind, deform
from a2v.body import bend_fingers
from a2v.geometry.mesh import is_closed
from a2v.reconstruction import HandSettings, add_hands
from a2v.reconstruction.hands import hand_patch
from a2v.types import Body, OrthographicCamera, Reconstruction
from tests.support.subjects import blank_subject
from tests.support.surfaces import coated

CAMERA = OrthographicCamera(scale=500.0, center_u=500.0, center_v=950.0)


@pytest.fixture(scope="module")
def relaxed(body: Body) -> Body:
    return bend_fingers(body, blank_subject(), CAMERA)


@pytest.fixture(scope="module")
def mittens(body: Body) -> Reconstruction:
    """Around the body's straight hands: no fingers, a centimeter too thick, 13 mm off."""
    made = coated(body, cell=0.012, coat=0.01)
    return dataclasses.replace(
        made,
        surface=dataclasses.replace(
            made.surface, vertices=made.surface.vertices + np.float32([0, 0.01, 0.008])
        ),
    )


@pytest.fixture(scope="module")
def handed(mittens: Reconstruction, relaxed: Body) -> Reconstruction:
    return add_hands(mittens, relaxed)


def test_both_hands_are_the_bodys_and_the_surface_stays_closed(
    handed: Reconstruction, mittens: Reconstruction, relaxed: Body
) -> None:
    surface = handed.surface
    assert surface.provenance["hands"] == ["left", "right"]
    assert is_closed(surface.vertices, surface.faces)
    assert surface.twins is not None
    own = surface.twins >= 0
    assert own.sum() == sum(len(hand_patch(letter).vertices) for letter in (".L", ".R"))
    for letter in (".L", ".R"):
        tips = np.flatnonzero(hand_patch(letter).out > 0.12)
        made = surface.vertices[np.isin(surface.twins, tips)]
        assert made == pytest.approx(
            relaxed.vertices[np.sort(surface.twins[np.isin(surface.twins, tips)])], abs=1e-6
        )
    rest = surface.vertices[~own]
    assert cKDTree(mittens.surface.vertices).query(rest)[0].max() < 1e-6
    assert handed.expected_colors is not None
    assert handed.expected_colors.shape == surface.vertices.shape


def test_the_wrist_has_no_step(handed: Reconstruction) -> None:
    surface = handed.surface
    assert surface.twins is not None
    for letter in (".L", ".R"):
        rim = np.isin(surface.twins, hand_patch(letter).vertices[hand_patch(letter).rim])
        ring = surface.vertices[rim]
        before = cKDTree(surface.vertices[surface.twins < 0]).query(ring)[0]
        assert (
            np.median(before) < 0.021
        )  # the strip is a centimeter wide, and thickening ends at 1.3 times, 4 mm below the coat


def test_fingers_move_with_their_bones(handed: Reconstruction, relaxed: Body) -> None:
    character = bind(handed.surface, relaxed)
    surface = handed.surface
    assert surface.twins is not None
    own = surface.twins >= 0
    assert np.array_equal(character.anchors[own], surface.twins[own])
    bone = relaxed.bone_names.index("finger2-2.L")
    moved = relaxed.bone_transforms.astype(np.float64).copy()
    moved[bone, :3, 3] += [0, 0.02, 0]
    change = np.linalg.norm(deform(character, moved) - surface.vertices, axis=1)
    index = relaxed.weights[:, bone] > 0.9
    others = (
        relaxed.weights[:, [relaxed.bone_names.index(f"finger{k}-2.L") for k in (1, 3, 4, 5)]].sum(
            axis=1
        )
        > 0.9
    )
    assert change[own & index[np.maximum(surface.twins, 0)]].min() > 0.015
    assert change[own & others[np.maximum(surface.twins, 0)]].max() < 1e-3


def test_a_hand_that_cannot_be_cut_off_stays_as_it_is(
    mittens: Reconstruction, relaxed: Body
) -> None:
    surface = mittens.surface
    far = dataclasses.replace(
        mittens,
        surface=dataclasses.replace(surface, vertices=surface.vertices + np.float32([0, 0.06, 0])),
    )
    assert add_hands(far, relaxed).surface.provenance["hands"] == []  # the wrist is elsewhere
    tip = relaxed.vertices[np.argmax(hand_patch(".L").out)].astype(np.float64)
    ball = coated(relaxed, cell=0.012, coat=0.01, ball=(tip - [0, 0.06, 0], 0.08))
    assert add_hands(ball, relaxed).surface.provenance["hands"] == ["right"]


def test_what_has_hands_already_is_left_alone(mittens: Reconstruction, relaxed: Body) -> None:
    assert add_hands(mittens, relaxed, settings=HandSettings(replace=False)) is mittens
    pushed = dataclasses.replace(mittens, from_body=True)
    assert add_hands(pushed, relaxed) is pushed
    assert add_hands(mittens, dataclasses.replace(relaxed, model="smpl")) is mittens
