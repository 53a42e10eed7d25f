"""PaMIR's refinement of the body by its field."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.body import load_body_model, make_body
from a2v.camera import OrthographicCamera
from a2v.errors import InputError
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import RayScene
from a2v.lab.papers.body_refinement import (
    Pixels,
    RefinementSettings,
    _surface_term,
    refine_body,
)

SOFT = 0.03
"""Distance in which the chance of the tests' fields falls from one half to a quarter, meters."""


@pytest.fixture(scope="module")
def model():
    return load_body_model()


def posed(model, angle):
    """A body with its left arm turned by `angle` radians."""
    rotations = np.zeros((model.n_bones, 3), np.float32)
    rotations[model.bone("upperarm01.L"), 0] = angle
    return make_body(model, rotations)


def field_of_body(body):
    """The chance that points lie in a body, by their distance from its skin."""

    skin, normals = RayScene(body.vertices, body.faces), vertex_normals(body.vertices, body.faces)

    def chance(points):
        foot = skin.closest(points)
        outwards = foot.interpolate(normals, body.faces)
        away = ((points - foot.interpolate(body.vertices, body.faces)) * outwards).sum(1)
        return 1 / (1 + np.exp(away / SOFT))

    return chance


def landmarks(model, body):
    """The landmarks (33, 3) of a body, meters."""
    state = model.forward(
        *(torch.from_numpy(body.parameters[key]) for key in ("rotations", "shape", "translation"))
    )
    return model.landmarks(state).numpy()


def test_the_gradient_is_that_of_the_weighted_difference_from_one_half():
    def field(points):
        return 0.5 - points[:, 0]

    value, slope = _surface_term(field, np.array([[0.1, 0, 0], [-0.3, 0, 0]], np.float32), 0.01)
    assert value == pytest.approx((0.1 + 0.5 * 0.3) / 2)  # the second point lies inside
    assert slope[:, 0] == pytest.approx([0.5, -0.25], rel=1e-3)
    assert np.abs(slope[:, 1:]).max() < 1e-6


def test_a_turned_arm_is_drawn_to_the_field(model):
    true, start = posed(model, 0.15), posed(model, 0.0)
    field = field_of_body(true)
    settings = RefinementSettings(iterations=20, rate=1e-2, vertices=600)
    refined = refine_body(model, start, lambda _: field, settings=settings)
    assert refined.terms[-1] < 0.5 * refined.terms[0]
    arm = np.linalg.norm(start.vertices - true.vertices, axis=1) > 0.03
    gap = [
        np.linalg.norm(body.vertices - true.vertices, axis=1)[arm].mean()
        for body in (start, refined.body)
    ]
    assert gap[1] < 0.3 * gap[0]
    for name in ("shape", "translation"):
        assert (refined.body.parameters[name] == start.parameters[name]).all()
    assert (refined.body.parameters["rotations"][0] == start.parameters["rotations"][0]).all()


def test_landmarks_draw_the_body_to_their_pixels(model):
    true, start = posed(model, 0.15), posed(model, 0.0)
    camera = OrthographicCamera(scale=300.0, center_u=256.0, center_v=500.0)
    places = camera.project(landmarks(model, true))
    refined = refine_body(
        model,
        start,
        lambda _: lambda points: np.full(len(points), 0.5),
        pixels=Pixels(places, np.ones(33), camera, 240.0),
        settings=RefinementSettings(iterations=40, rate=4e-3, vertices=300),
    )
    gap = [
        np.linalg.norm(camera.project(landmarks(model, body)) - places, axis=1).mean()
        for body in (start, refined.body)
    ]
    assert gap[1] < 0.5 * gap[0]


def test_the_field_is_made_again_for_the_current_body(model):
    start, seen = posed(model, 0.0), []
    field = field_of_body(posed(model, 0.15))

    def field_of(vertices):
        seen.append(vertices.copy())
        return field

    refine_body(
        model,
        start,
        field_of,
        settings=RefinementSettings(iterations=5, renew=2, rate=1e-2, vertices=300),
    )
    assert len(seen) == 3
    assert np.abs(seen[0] - start.vertices).max() < 1e-5
    assert np.abs(seen[2] - seen[1]).max() > 1e-4


def test_a_flattened_body_keeps_its_difference_from_the_models(model):
    start = posed(model, 0.0)
    moved = dataclasses.replace(start, vertices=start.vertices + np.float32([0.1, 0, 0.2]))
    refined = refine_body(
        model,
        moved,
        lambda _: lambda points: np.full(len(points), 0.5),
        settings=RefinementSettings(iterations=2, vertices=300),
    )
    assert refined.body.vertices == pytest.approx(moved.vertices, abs=1e-5)


def test_another_models_body_is_refused(model):
    body = dataclasses.replace(posed(model, 0.0), model="smpl")
    with pytest.raises(InputError, match="expected a"):
        refine_body(model, body, lambda _: lambda points: np.full(len(points), 0.5))
    with pytest.raises(InputError, match="at least 1"):
        RefinementSettings(iterations=0)
