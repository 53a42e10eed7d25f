"""The shipped networks on a body in a jacket, hair and a skirt unlike their training."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from a2v.body import PARTS, nearest_spots
from a2v.errors import InputError
from a2v.geometry.visibility import silhouette_iou
from a2v.reconstruction import (
    ColorEvidence,
    ColorSettings,
    ImplicitSettings,
    color_surface,
    implicit_surface,
)
from a2v.reconstruction.implicit import ImplicitModel
from a2v.types import Body, OrthographicCamera, Subject, Surface
from tests.support.photographs import JACKET

Scene = tuple[Subject, Body, OrthographicCamera]


@pytest.fixture(scope="module")
def surface(scene: Scene) -> Surface:
    return implicit_surface(
        *scene, settings=ImplicitSettings(resolution=256, vertices=25_000, threads=1)
    )


def test_the_surface_is_one_closed_person_in_the_mask(scene: Scene, surface: Surface) -> None:
    subject, body, camera = scene
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.body_count == 1
    assert mesh.volume > 0
    assert len(surface.vertices) >= 24_000
    assert silhouette_iou(surface.vertices, surface.faces, camera, subject.mask) > 0.95
    distance, _ = cKDTree(surface.vertices).query(body.vertices)
    assert np.median(distance) < 0.02
    found = nearest_spots(surface.vertices, body).parts
    assert {
        PARTS.index(name) for name in ("head", "left_hand", "right_hand", "left_foot", "right_foot")
    } <= set(found.tolist())


def test_the_unseen_side_takes_the_networks_colors(scene: Scene, surface: Surface) -> None:
    subject, body, camera = scene
    evidence = ColorEvidence(prior=surface.colors, spots=nearest_spots(surface.vertices, body))
    colored = color_surface(
        surface, subject, camera, evidence=evidence, settings=ColorSettings(texture=0)
    )
    height = surface.vertices[:, 1] / np.ptp(surface.vertices[:, 1])
    back = (
        (height > 0.6)
        & (height < 0.75)
        & (surface.vertices[:, 2] < np.median(surface.vertices[:, 2]) - 0.05)
    )
    back &= np.abs(surface.vertices[:, 0]) < 0.1
    assert back.sum() > 100
    jacket = np.median(colored.colors[back], axis=0)
    assert np.abs(jacket - JACKET).max() < 0.25
    assert jacket.argmax() == 2  # blue


def test_wrong_weights_are_told(scene: Scene, tmp_path) -> None:
    with pytest.raises(InputError, match="digest"):
        implicit_surface(*scene, settings=ImplicitSettings(digest="0" * 64))
    with pytest.raises(InputError, match="does not exist"):
        ImplicitModel.load(tmp_path)
    subject, body, camera = scene
    with pytest.raises(InputError, match="mask is empty"):
        implicit_surface(
            dataclasses.replace(subject, mask=np.zeros_like(subject.mask)), body, camera
        )
