"""Binding: four weights per vertex that no pose tears, and legs that stay under the skirt."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body import load_body_model, make_body
from a2v.body.face import teeth
from a2v.body.parts import on_parts
from a2v.body.spots import rest_vertices
from a2v.io import read_npz
from a2v.reconstruction.canonical import Sight
from a2v.reconstruction.canonical.binding import (
    WEIGHTS,
    binding_key,
    found_weights,
    four_weights,
    one_of_alike,
    softened,
)
from a2v.reconstruction.canonical.build import posed_vertices
from a2v.reconstruction.canonical.skirt import make_skirt, skirt_faces
from a2v.reconstruction.canonical.topology import topology
from a2v.reconstruction.canonical.wear import thin_under_skirt
from a2v.types import Body, FloatArray, Standing
from tests.support.bodies import with_turned_limb
from tests.support.faces import CAMERA, photographed
from tests.support.sights import with_skirt
from tests.support.surfaces import coated


@pytest.fixture(scope="module")
def rest_body() -> Body:
    model = load_body_model("anny")
    return make_body(model, np.zeros((len(model.bone_names), 3), np.float32), model.shape_default)


def _longest_of_stretched(standing: Standing, body: Body, faces: FloatArray) -> float:
    """Longest edge, meters, of those that are over three times as long as at rest."""
    posed, rest = posed_vertices(standing, body), standing.vertices
    ends = faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]
    long, own = (
        np.concatenate(
            [np.linalg.norm(points[pair[:, 0]] - points[pair[:, 1]], axis=1) for pair in ends]
        )
        for points in (posed, rest)
    )
    return float(np.where(long > 3 * own, long, 0.0).max())


@pytest.mark.parametrize(
    ("bone", "turn"), [("upperleg01.L", [-100.0, 0, 0]), ("upperarm01.R", [0, 0, -110.0])]
)
def test_no_kick_and_no_raised_arm_tears_the_mesh(
    rest_body: Body, bone: str, turn: list[float]
) -> None:
    mesh = topology()
    weights, bones = four_weights(mesh, rest_body)
    assert weights.shape == (len(mesh.nearest), 4)
    assert np.allclose(weights.sum(axis=1), 1)
    assert (np.diff(weights, axis=1) <= 1e-9).all()
    rest = mesh.refined(np.concatenate([rest_vertices(rest_body), teeth().vertices]))
    faces = mesh.faces[mesh.skin[mesh.faces].all(axis=1)]
    standing = Standing(
        vertices=rest.astype(np.float32),
        weights=weights.astype(np.float32),
        bones=bones.astype(np.int32),
        anchors=mesh.nearest.astype(np.int32),
        parts=rest_body.parts[mesh.nearest].astype(np.int8),
    )
    posed = with_turned_limb(rest_body, bone, turn)
    assert np.abs(posed_vertices(standing, posed) - rest).max() > 0.3
    assert _longest_of_stretched(standing, posed, faces) < 0.04


def test_no_kick_tears_a_skirt(rest_body: Body) -> None:
    knees = rest_body.rest_transforms[
        [rest_body.bone_names.index(f"lowerleg01{side}") for side in (".L", ".R")], :3, 3
    ].mean(axis=0)
    person = coated(rest_body, cell=0.02, coat=0.01, ball=(knees + np.array([0, 0.12, 0]), 0.26))
    sight = with_skirt(Sight(photographed(rest_body), rest_body, CAMERA, person), True)
    hem = np.full(2, float(knees[1]) - 0.05)
    sight = dataclasses.replace(sight, given=dataclasses.replace(sight.reading, hem=hem))
    skirt = make_skirt(sight, rest_body, rest_vertices(rest_body))
    assert skirt is not None
    standing = Standing(
        vertices=skirt.vertices.astype(np.float32),
        weights=skirt.weights.astype(np.float32),
        bones=skirt.bones.astype(np.int32),
        anchors=skirt.anchors.astype(np.int32),
        parts=rest_body.parts[skirt.anchors].astype(np.int8),
    )
    posed = with_turned_limb(rest_body, "upperleg01.L", [-100.0, 0, 0])
    faces = skirt_faces(len(skirt.vertices))
    assert np.abs(posed_vertices(standing, posed) - skirt.vertices).max() > 0.3
    assert _longest_of_stretched(standing, posed, faces) < 0.04


def test_weights_are_softened_where_they_are_steep_alone() -> None:
    side = 40
    row, column = np.divmod(np.arange(side * side), side)
    one = (row * side + column)[(row < side - 1) & (column < side - 1)]
    faces = np.concatenate(
        [
            np.stack([one, one + 1, one + side], axis=1),
            np.stack([one + 1, one + side + 1, one + side], axis=1),
        ]
    )
    left = (column < side // 2).astype(float)
    weights = np.stack([left, 1 - left], axis=1)
    soft = softened(weights, faces, np.ones(len(weights), bool))
    assert np.allclose(soft.sum(axis=1), 1)
    steepest = np.abs(np.diff(soft[:, 0].reshape(side, side), axis=1)).max()
    assert steepest < 0.2
    assert (soft[column < 8] == weights[column < 8]).all()
    assert (softened(weights, faces, np.zeros(len(weights), bool)) == weights).all()


def test_bones_that_move_alike_are_one_where_a_vertex_has_too_many(rest_body: Body) -> None:
    names = rest_body.bone_names
    own = {
        "clavicle.L": 0.3,
        "shoulder01.L": 0.2,
        "upperarm01.L": 0.2,
        "spine01": 0.2,
        "neck01": 0.1,
    }
    weights = np.zeros((2, len(names)))
    for name, share in own.items():
        weights[0, names.index(name)] = share
    weights[1, [names.index("clavicle.L"), names.index("shoulder01.L")]] = 0.5
    found = one_of_alike(weights, names)
    assert found[0, names.index("clavicle.L")] == pytest.approx(0.5)
    assert (found[0] > 0).sum() == 4
    assert (found[1] == weights[1]).all()


def test_legs_are_thin_under_a_skirt_and_whole_below_its_hem(rest_body: Body) -> None:
    skin = rest_vertices(rest_body)
    legs = on_parts(rest_body.parts, "left_thigh", "left_shin", "right_thigh", "right_shin")
    knee = float(rest_body.rest_transforms[rest_body.bone_names.index("lowerleg01.L"), 1, 3])
    thin = thin_under_skirt(skin, rest_body, legs, knee)
    assert (thin[~legs] == skin[~legs]).all()
    assert (thin[skin[:, 1] < knee] == skin[skin[:, 1] < knee]).all()
    band = legs & (skin[:, 0] > 0) & (np.abs(skin[:, 1] - knee - 0.15) < 0.02)
    assert np.ptp(thin[band, 2]) < 0.6 * np.ptp(skin[band, 2])
    assert (thin[:, 1] == skin[:, 1]).all()


def test_the_shipped_weights_are_those_of_the_mesh(rest_body: Body) -> None:
    weights, bones = four_weights(topology(), rest_body)
    found, where = found_weights(topology(), rest_body)
    key = binding_key(topology(), rest_body)
    assert np.array_equal(read_npz(WEIGHTS)["key"], key)  # or they are computed for each person
    np.testing.assert_allclose(weights, found, atol=1e-6)
    assert (bones == where).mean() > 0.9999  # equal weights may change their order
    assert weights.dtype == found.dtype == np.float32
    assert bones.dtype == where.dtype == np.int32


def test_weights_of_another_body_are_not_the_shipped_ones(rest_body: Body) -> None:
    other = rest_body.weights.copy()
    near = on_parts(rest_body.parts, "left_hand")
    other[near] = 0.0
    other[near, rest_body.bone_names.index("lowerarm01.L")] = 1.0
    body = dataclasses.replace(rest_body, weights=other)
    assert not np.array_equal(binding_key(topology(), body), binding_key(topology(), rest_body))
    weights, bones = four_weights(topology(), body)
    stiff = np.flatnonzero(near[topology().nearest] & topology().skin)
    assert np.array_equal(weights, found_weights(topology(), body)[0])
    assert (bones[stiff, 0] == rest_body.bone_names.index("lowerarm01.L")).mean() > 0.9
