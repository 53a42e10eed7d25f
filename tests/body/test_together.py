"""One shape for several photos of a person."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.body import FitResult, FitSettings, load_body_model, make_body
from a2v.body.terms import alike
from a2v.body.together import doubts_of, fit_together, shapes_differ
from a2v.errors import InputError
from a2v.types import Body, Subject
from tests.support.bodies import near_view, random_body, turned

QUICK = FitSettings(rounds=3, starts=0)


def guessed(body: Body, subject: Subject, camera: object, shape: np.ndarray) -> FitResult:
    """Return a start with the true pose and another shape."""
    from a2v.body.pose_space import pose_space

    parameters = body.parameters
    space = pose_space(load_body_model("anny"))
    wrong = make_body(
        load_body_model("anny"), parameters["rotations"], shape, parameters["translation"]
    )
    wrong = dataclasses.replace(
        wrong, parameters={**wrong.parameters, "angles": space.natural.astype(np.float32)}
    )
    return FitResult(wrong, camera, {"silhouette_iou": 0.9})  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def seen() -> tuple[list[Body], list[Subject], list[FitResult]]:
    truth = random_body(5, spread=0.3, yaw=0.0)
    bodies = [truth, turned(truth, np.pi / 2)]
    views = [near_view(body, distance=3.0, pitch=0.1) for body in bodies]
    shapes = [np.clip(truth.parameters["shape"] + shift, 0.05, 0.95) for shift in (0.03, -0.03)]
    fits = [
        guessed(body, *view, shape) for body, view, shape in zip(bodies, views, shapes, strict=True)
    ]
    return bodies, [subject for subject, _ in views], fits


def test_all_photos_get_one_shape_and_each_its_own_pose(seen):
    _, subjects, fits = seen
    found = fit_together(subjects, fits, settings=QUICK)
    assert np.array_equal(found[0].body.parameters["shape"], found[1].body.parameters["shape"])
    assert shapes_differ(found) < 1e-6 < shapes_differ(fits)
    assert not np.array_equal(
        found[0].body.parameters["rotations"], found[1].body.parameters["rotations"]
    )
    for result in found:
        assert result.residuals["keypoint_mean"] < 0.015
        assert result.residuals["silhouette_iou"] > 0.85
        assert abs(float(result.body.vertices[:, 1].min())) < 1e-4
    assert doubts_of(fits, found) == []


def test_every_photo_needs_its_fit(seen):
    _, subjects, fits = seen
    with pytest.raises(InputError, match="2 photos and 1 fits"):
        fit_together(subjects, fits[:1])


def test_who_does_not_fill_a_photo_may_be_somebody_else(seen):
    fits = seen[2]
    strange = [fits[0], dataclasses.replace(fits[1], residuals={"silhouette_iou": 0.5})]
    assert "different persons" in doubts_of(fits, strange)[0]


def test_poses_that_are_nearly_the_same_are_drawn_together_and_others_are_not():
    spread, first = torch.ones(1), torch.zeros(1)
    costs = [float(alike(first, torch.full((1,), angle), spread)) for angle in (0.0, 0.1, 1.5, 1.6)]
    assert costs[0] == 0.0
    assert costs[1] > 0.2
    assert (
        costs[3] - costs[2] < 0.05
    )  # another pose: a slightly larger difference costs nothing more
