"""Dense evidence of bodies with known ground truth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.body import FitSettings, fit_body
from a2v.body import terms as term
from a2v.body.dense import gather_dense
from a2v.errors import InputError
from tests.support.bodies import joint_errors, random_body, subject_of
from tests.support.bodymaps import bodymap_of


def test_the_vertices_are_where_and_as_deep_as_the_map_says() -> None:
    body = random_body(3, bend_legs=True, yaw=0.6)
    subject, camera = subject_of(body)
    height = camera.scale * float(np.ptp(body.vertices[:, 1]))
    found = gather_dense(
        bodymap_of(body, camera, 480), subject.keypoints, height=height, count=400, seed=0
    )
    assert found is not None
    assert len(found.pixels) == len(found.chosen) == 400
    np.testing.assert_allclose(found.shares.sum(axis=1), 1.0)
    around = body.vertices[found.vertex_ids].astype(np.float64)[found.chosen]
    skin = torch.from_numpy((found.shares[..., None] * around).sum(axis=1))
    gap = np.linalg.norm(camera.project(skin.numpy()) - found.pixels, axis=1)
    assert np.median(gap) < 0.01 * height  # vertices are some centimeters apart
    weights = torch.from_numpy(found.depth_weights)

    def deep(moved: torch.Tensor) -> float:
        told = torch.from_numpy(found.depths)
        return float(
            term.depths_agree(camera.scale * moved[:, 2], told, weights=weights, height=height)
        )

    at_truth = deep(skin)
    assert deep(skin + torch.tensor([0, 0, 0.5])) == pytest.approx(
        at_truth
    )  # the zero of the map is not known
    assert deep(skin * torch.tensor([1, 1, 1.5])) > 4 * at_truth
    assert deep(skin * torch.tensor([1, 1, -1.0])) > 20 * at_truth


def test_a_map_corrects_landmarks_that_are_too_far_to_the_front() -> None:
    body = random_body(8, bend_legs=True, yaw=0.3)
    subject, camera = subject_of(body, noise=0.005)
    wrong = subject.keypoints_3d.copy()
    wrong[[13, 15, 17, 19, 21], 2] += 0.12  # the left arm
    subject = dataclasses.replace(subject, keypoints_3d=wrong)
    settings = FitSettings(rounds=5, starts=0, distance=0.0)  # as the detector saw the subject
    without = joint_errors(body, camera, fit_body(subject, settings=settings))
    told = dataclasses.replace(subject, bodymap=bodymap_of(body, camera, 480))
    errors = joint_errors(body, camera, fit_body(told, settings=settings))
    assert errors.mean() < 0.75 * without.mean()
    assert errors.max() < 0.7 * without.max()
    left_out = fit_body(
        told, settings=dataclasses.replace(settings, dense_weight=0.0, dense_depth_weight=0.0)
    )
    np.testing.assert_array_equal(joint_errors(body, camera, left_out), without)


def test_a_map_that_sees_nobody_says_nothing() -> None:
    body = random_body(3)
    subject, camera = subject_of(body)
    found = bodymap_of(body, camera, 480)
    empty = dataclasses.replace(found, inside=np.zeros_like(found.inside))
    assert gather_dense(empty, subject.keypoints, height=400.0, count=10, seed=0) is None


def test_pixels_beside_landmarks_that_lie_elsewhere_count_less() -> None:
    body = random_body(3)
    subject, camera = subject_of(body)
    found = bodymap_of(body, camera, 480)
    height = camera.scale * float(np.ptp(body.vertices[:, 1]))
    moved = subject.keypoints.copy()
    moved[[13, 15, 17, 19, 21], 0] += 0.1 * height  # the left arm
    whole, less = (
        gather_dense(found, points, height=height, count=4096, seed=0)
        for points in (subject.keypoints, moved)
    )
    assert whole is not None
    assert less is not None
    changed = less.weights < 0.5 * whole.weights
    arm = found.landmarks[[13, 15, 17, 19, 21], :2]
    away = np.linalg.norm(whole.pixels[changed, None] - arm, axis=-1).min(axis=1) / height
    assert 10 < changed.sum() < 0.2 * len(changed)
    assert away.max() < 0.1


def test_of_standing_people_depths_and_the_head_have_no_weight() -> None:
    body = random_body(3)
    subject, camera = subject_of(body)
    found = bodymap_of(body, camera, 480)
    height = camera.scale * float(np.ptp(body.vertices[:, 1]))
    plain, standing = (
        gather_dense(found, subject.keypoints, height=height, count=4096, seed=0, standing=own)
        for own in (False, True)
    )
    assert plain is not None
    assert standing is not None
    assert not standing.depth_weights.any()
    head = standing.weights == 0
    assert 0.03 < head.mean() < 0.25
    chin = found.landmarks[[9, 10], 1].mean()
    assert standing.pixels[head, 1].max() < chin + 0.12 * height  # the neck
    np.testing.assert_array_equal(standing.weights[~head], plain.weights[~head])


def test_bad_numbers_of_pixels_are_refused() -> None:
    with pytest.raises(InputError, match="dense_pixels"):
        FitSettings(dense_pixels=-1)


def test_the_places_do_not_jump_when_the_map_moves_a_little() -> None:
    body = random_body(3)
    subject, camera = subject_of(body)
    found = bodymap_of(body, camera, 480)
    random = np.random.default_rng(0)
    moved = dataclasses.replace(
        found,
        places=found.places
        + np.float32(1e-5) * random.standard_normal(found.places.shape).astype(np.float32),
    )
    first, then = (
        gather_dense(one, subject.keypoints, height=400.0, count=4096, seed=0)
        for one in (found, moved)
    )
    assert first is not None
    assert then is not None
    skins = [
        (one.shares[..., None] * body.vertices[one.vertex_ids][one.chosen]).sum(axis=1)
        for one in (first, then)
    ]
    assert np.linalg.norm(skins[0] - skins[1], axis=1).max() < 0.001


def test_a_pixel_more_inside_changes_no_other_pixel() -> None:
    body = random_body(3)
    subject, camera = subject_of(body)
    found = bodymap_of(body, camera, 480)
    less = found.inside.copy()
    less[tuple(np.argwhere(less)[0])] = False
    samples = [
        gather_dense(one, subject.keypoints, height=400.0, count=100, seed=0)
        for one in (found, dataclasses.replace(found, inside=less))
    ]
    both = [{tuple(pixel) for pixel in one.pixels.tolist()} for one in samples if one is not None]
    assert len(both[0] ^ both[1]) <= 2
