"""Widths of silhouettes, ways through solids, and slabs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh

from a2v.body import load_body_model, make_body
from a2v.lab.evaluation.reconstruction.thickness import local_radius, longest_ways, slab_share
from a2v.types import OrthographicCamera, Surface

CAMERA = OrthographicCamera(scale=100.0, center_u=100.0, center_v=100.0)


def disc(size: int, middle: tuple[float, float], radius: float) -> np.ndarray:
    rows, columns = np.mgrid[:size, :size]
    return np.hypot(rows - middle[0], columns - middle[1]) <= radius


def test_a_bar_and_a_ball_are_as_wide_as_they_are_everywhere() -> None:
    bar = np.zeros((100, 200), bool)
    bar[40:60, 10:190] = True
    radius = local_radius(bar)
    assert radius[~bar].max() == 0
    assert np.abs(radius[40:60, 30:170] - 10).max() < 1.5
    ball = disc(121, (60, 60), 40)
    assert local_radius(ball)[60, 60] == pytest.approx(40, abs=1.5)
    assert local_radius(ball)[60, 84] == pytest.approx(40, abs=2)


def test_ways_through_solids_that_stand_apart() -> None:
    near, far = (trimesh.creation.box((0.5, 0.5, deep)) for deep in (0.2, 0.1))
    near.apply_translation([0.1, 0, 0.5])
    both = trimesh.util.concatenate([near, far])
    pixels = np.array(
        [[100.3, 100.7], [80.3, 100.7], [10.0, 10.0]]
    )  # both, the far one alone, none
    ways = longest_ways(np.asarray(both.vertices), np.asarray(both.faces), CAMERA, pixels)
    np.testing.assert_allclose(ways, [0.2, 0.1, 0], atol=1e-5)


def test_slabs_are_what_neither_width_nor_body_explains() -> None:
    body = make_body(load_body_model(), grounded=True)
    size, scale = 400, 200.0
    camera = OrthographicCamera(scale=scale, center_u=size / 2, center_v=size - 20)
    vertices = body.vertices.astype(np.float32)
    person = Surface(
        vertices=vertices,
        faces=body.faces.astype(np.int32),
        colors=np.full(vertices.shape, 0.5, np.float32),
    )
    pixels = np.stack(np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5), axis=-1).reshape(
        -1, 2
    )
    mask = (
        (longest_ways(vertices.astype(float), body.faces, camera, pixels) > 0)
        .reshape(size, size)
        .astype(np.float32)
    )
    assert slab_share(person, body, camera, mask) < 0.005
    deep = vertices.copy()
    legs = deep[:, 1] < 0.75
    deep[legs, 2] *= 4  # legs of half a meter
    share = slab_share(dataclasses.replace(person, vertices=deep), body, camera, mask)
    assert 0.2 < share < 0.6
