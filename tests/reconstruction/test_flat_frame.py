"""Surfaces and colors of a perspective camera are made in its flat frame and moved back."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.geometry.rays import ray_scene
from a2v.geometry.visibility import silhouette_iou
from a2v.reconstruction import SurfaceSettings
from a2v.reconstruction.backends import reconstruct
from a2v.types import Body, PhotoCamera, Reconstruction, Subject
from tests.support.bodies import near_view, random_body


@pytest.fixture(scope="module")
def made() -> tuple[Body, Subject, PhotoCamera, Reconstruction]:
    body = random_body(7, spread=0.4, yaw=0.2)
    subject, camera = near_view(body, distance=1.7, pitch=0.3)
    return body, subject, camera, reconstruct(subject, body, camera, SurfaceSettings())


def test_the_surface_covers_the_photos_mask(
    made: tuple[Body, Subject, PhotoCamera, Reconstruction],
) -> None:
    _, subject, camera, person = made
    assert (
        silhouette_iou(
            camera.flatten(person.surface.vertices), person.surface.faces, camera.flat, subject.mask
        )
        > 0.9
    )


def test_the_surface_lies_on_the_body_in_the_world(
    made: tuple[Body, Subject, PhotoCamera, Reconstruction],
) -> None:
    body, _, camera, person = made
    scene = ray_scene(body.vertices, body.faces)

    def distance(vertices: np.ndarray) -> float:
        return float(scene.compute_distance(vertices.astype(np.float32)).numpy().mean())

    assert distance(person.surface.vertices) < 0.015
    assert distance(camera.flatten(person.surface.vertices)) > 2 * distance(person.surface.vertices)
