"""Long hair that swings: which hair gets a layer, and how it hangs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v import Character
from a2v.animation import prepare_rig
from a2v.formats.gltf.hair import CHAINS, JOINTS, hang_hair
from a2v.types import MATERIALS
from tests.support.hair import head_of, with_hair


@pytest.fixture(scope="module")
def bare(expressive: Character) -> Character:
    return prepare_rig(expressive, {}, rig="vrm")[0]


@pytest.fixture(scope="module")
def long(bare: Character) -> Character:
    return with_hair(bare, length=0.25)


def test_long_hair_is_a_layer_on_chains_below_the_head(long: Character) -> None:
    hung, springs = hang_hair(long)
    assert springs is not None
    assert 1 <= len(springs.chains) <= CHAINS
    assert all(len(chain) == JOINTS + 1 for chain in springs.chains)
    count, head = len(long.surface.vertices), long.body.bone_names.index("head")
    for chain in springs.chains:
        assert [int(hung.body.bone_parents[bone]) for bone in chain] == [head, *chain[:-1]]
    np.testing.assert_array_equal(hung.surface.vertices[:count], long.surface.vertices)
    np.testing.assert_array_equal(hung.weights[:count], long.weights)
    np.testing.assert_allclose(hung.weights.sum(axis=1), 1, atol=1e-5)
    layer = hung.surface.vertices[count:]
    assert len(layer) > 100
    assert hung.surface.materials is not None
    assert (hung.surface.materials[len(long.surface.faces) :] == MATERIALS.index("hair")).all()
    tips = np.argsort(layer[:, 1])[: len(layer) // 10] + count
    moved = hung.weights[tips] * (hung.bones[tips] >= len(long.body.bone_names))
    np.testing.assert_allclose(moved.sum(axis=1), 1, atol=1e-5)  # tips follow only the chains
    np.testing.assert_array_less(np.abs(hung.surface.vertices[tips, 0]), 0.4)


def test_a_layer_that_is_there_already_swings_itself(bare: Character) -> None:
    """A curtain of two sides behind head and back: below the skull it hangs on chains."""
    surface, skull, names = bare.surface, head_of(bare), bare.body.bone_names
    heights, across = np.linspace(skull[1] + 0.1, skull[1] - 0.3, 30), np.linspace(-0.1, 0.1, 12)
    side = np.stack(
        [
            np.tile(across, 30),
            np.repeat(heights, 12),
            np.full(360, surface.vertices[:, 2].min() - 0.02),
        ],
        axis=1,
    )
    one = (np.arange(29)[:, None] * 12 + np.arange(11)).ravel()
    sheet = np.concatenate(
        [
            np.stack([one, one + 1, one + 12], axis=1),
            np.stack([one + 1, one + 13, one + 12], axis=1),
        ]
    )
    count, black = len(surface.vertices), np.zeros((360, 3), np.float32)
    kinds = np.repeat(
        np.array([MATERIALS.index("cloth"), MATERIALS.index("hair")], np.uint8),
        [len(surface.faces), len(sheet)],
    )
    layered = dataclasses.replace(
        surface,
        vertices=np.concatenate([surface.vertices, side.astype(np.float32)]),
        faces=np.concatenate([surface.faces, (sheet + count).astype(np.int32)]),
        colors=np.concatenate([surface.colors, black]),
        uv=None,
        texture=None,
        normal_map=None,
        materials=kinds,
    )

    def grown(values: np.ndarray, value: int) -> np.ndarray:
        return np.concatenate([values, np.full((360, *values.shape[1:]), value, values.dtype)])

    weights = grown(bare.weights, 0)
    weights[count:, 0] = 1
    person = dataclasses.replace(
        bare,
        surface=layered,
        weights=weights,
        bones=grown(bare.bones, names.index("head")),
        anchors=grown(bare.anchors, 0),
        parts=grown(bare.parts, 0),
    )
    hung, springs = hang_hair(person)
    assert springs is not None
    assert len(hung.surface.vertices) == len(layered.vertices)  # no copy
    low = np.flatnonzero(layered.vertices[count:, 1] < skull[1] - 0.15) + count
    on_chains = hung.weights[low] * (hung.bones[low] >= len(names))
    np.testing.assert_allclose(on_chains.sum(axis=1), 1, atol=1e-5)
    high = np.flatnonzero(layered.vertices[count:, 1] > skull[1]) + count
    np.testing.assert_array_equal(hung.bones[high], person.bones[high])
    np.testing.assert_array_equal(hung.weights[:count], person.weights[:count])


def test_no_joint_of_the_hair_is_in_a_capsule_at_rest(long: Character) -> None:
    hung, springs = hang_hair(long)
    assert springs is not None
    assert springs.capsules
    places = hung.body.bone_transforms[:, :3, 3].astype(np.float64)
    joints = places[[bone for chain in springs.chains for bone in chain[1:]]]
    for capsule in springs.capsules:
        away = joints - places[capsule.bone]
        along = np.clip(away @ capsule.tail / (capsule.tail @ capsule.tail), 0, 1)
        distance = np.linalg.norm(away - along[:, None] * capsule.tail, axis=1).min()
        assert distance >= capsule.radius + springs.swing.radius - 1e-3


def test_other_hair_stays_as_it_is(bare: Character, long: Character) -> None:
    short = with_hair(bare, length=0.02)
    one_color = dataclasses.replace(
        long, surface=dataclasses.replace(long.surface, colors=np.zeros_like(long.surface.colors))
    )
    unnamed = dataclasses.replace(long, surface=dataclasses.replace(long.surface, materials=None))
    for character in (bare, short, one_color, unnamed):
        assert hang_hair(character) == (character, None)
    assert head_of(long)[1] > 1
