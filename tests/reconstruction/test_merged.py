"""Colors of several photos: exposures, the best view of a place, and places that are hidden."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.reconstruction.coloring.other_photos import OtherPhoto, exposure, mixed, on_vertices
from a2v.types import OrthographicCamera, Subject, Surface


def test_the_photo_that_sees_a_place_best_has_it_nearly_alone():
    red, blue = np.array([[1.0, 0, 0]]), np.array([[0, 0, 1.0]])
    trust, color = mixed([np.array([[0.9]]), np.array([[0.3]])], [red, blue])
    assert trust[0, 0] == 0.9
    assert color[0, 0] > 0.98
    assert mixed([np.array([[0.5]]), np.array([[0.5]])], [red, blue])[1][0] == pytest.approx(
        [0.5, 0, 0.5]
    )


def test_vertices_that_the_main_photo_shows_alone_keep_its_colors_to_the_bit():
    rng = np.random.default_rng(0)
    colors, theirs, trust = rng.random((4, 3)), rng.random((4, 3)), np.array([0.9, 0.9, 0.0, 0.0])
    shown = np.array([False, True, True, False])
    other = SimpleNamespace(known=shown, trust=np.full(4, 0.9), allowed=np.ones(4), colors=theirs)
    known, found = on_vertices(trust, trust > 0.5, colors, [other])  # type: ignore[list-item]
    assert known.tolist() == [True, True, True, False]
    assert np.array_equal(found[[0, 3]], colors[[0, 3]])
    assert found[2] == pytest.approx(theirs[2], abs=1e-6)
    assert found[1] == pytest.approx((colors[1] + theirs[1]) / 2)


def test_an_exposure_is_found_by_parts_that_both_photos_show():
    rng = np.random.default_rng(1)
    parts = np.repeat([PARTS.index(name) for name in ("torso", "left_thigh", "head")], 400)
    albedo = np.repeat(
        [[0.3, 0.25, 0.2], [0.1, 0.12, 0.3], [0.4, 0.3, 0.2]], 400, axis=0
    ) * rng.uniform(0.8, 1.2, (1200, 1))
    gain = np.array([1.5, 1.2, 0.9])
    front = np.arange(1200) % 2 == 0
    theirs = albedo.copy()
    theirs[parts == PARTS.index("head")] *= 3.0  # hair behind, a face in front
    canvas = SimpleNamespace(parts=parts)
    found = exposure(
        canvas, (front, linear_to_srgb(albedo)), (~front, linear_to_srgb(theirs / gain))
    )  # type: ignore[arg-type]
    assert found == pytest.approx(gain, rel=0.03)
    assert exposure(
        canvas, (front, linear_to_srgb(albedo)), (np.zeros(1200, bool), theirs)
    ) == pytest.approx(1.0)  # type: ignore[arg-type]
    assert srgb_to_linear(linear_to_srgb(albedo)) == pytest.approx(albedo, abs=1e-6)


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_an_exposure_does_not_follow_gloss(share: float):
    """Gloss adds white light: over a whole green shirt (twice its red), or as highlights on a
    share of all places."""
    rng = np.random.default_rng(2)
    parts = np.repeat([PARTS.index(name) for name in ("torso", "left_thigh")], [1200, 800])
    albedo = np.repeat([[0.02, 0.2, 0.1], [0.6, 0.45, 0.4]], [1200, 800], axis=0)
    albedo = albedo * rng.uniform(0.8, 1.2, (2000, 1))
    gain = np.array([1.2, 1.0, 0.9])
    front = np.arange(2000) % 2 == 0
    shirt = (parts == PARTS.index("torso")) * 0.02
    gloss = shirt if share == 1.0 else 0.2 * (rng.random(2000) < share)
    glossy = np.clip(gain * albedo + gloss[:, None], 0, 1)
    canvas = SimpleNamespace(parts=parts)
    found = exposure(canvas, (front, linear_to_srgb(glossy)), (~front, linear_to_srgb(albedo)))  # type: ignore[arg-type]
    assert found == pytest.approx(gain, rel=0.12)


def wall(half: float, depth: float, count: int = 41) -> tuple[np.ndarray, np.ndarray]:
    """A square grid at z = `depth` that faces the camera."""
    line = np.linspace(-half, half, count)
    x, y = np.meshgrid(line, line)
    vertices = np.stack([x.ravel(), y.ravel(), np.full(x.size, depth)], axis=1)
    at = np.arange(count * count).reshape(count, count)
    low, right, up, both = (
        part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:])
    )
    faces = np.concatenate([np.stack([low, right, both], 1), np.stack([low, both, up], 1)])
    return vertices, faces


def test_a_place_that_a_photo_does_not_show_never_takes_its_color():
    """Behind a board, behind the camera's side of a wall, and outside the mask."""
    rear, faces = wall(0.45, 0.0)
    board, more = wall(0.15, 0.1)
    surface = Surface(
        vertices=np.concatenate([rear, board]).astype(np.float32),
        faces=np.concatenate([faces, more + len(rear)]).astype(np.int32),
        colors=np.full((len(rear) + len(board), 3), 0.5, np.float32),
    )
    camera = OrthographicCamera(scale=200.0, center_u=100.0, center_v=100.0)
    image = np.full((200, 200, 3), (40, 40, 220), np.uint8)
    image[70:130, 70:130] = (220, 40, 40)  # the board
    mask = np.zeros((200, 200), np.float32)
    mask[10:150, 10:190] = 1.0
    subject = Subject(
        image=image,
        mask=mask,
        keypoints=np.zeros((33, 3), np.float32),
        keypoints_3d=np.zeros((33, 3), np.float32),
        crop=(0, 0, 200, 200),
        photo_size=(200, 200),
    )
    canvas = SimpleNamespace(
        owners=np.zeros(len(surface.vertices), np.int64),
        agrees=lambda pixels, parts: np.ones(len(pixels)),
    )
    other = OtherPhoto.of(surface, subject, camera, canvas, delight=False)  # type: ignore[arg-type]
    corner = np.asarray(surface.faces, np.int64)
    weight = np.full((len(corner), 3, 1), 1 / 3)
    trust, colors = other.at(corner, weight)
    middle = surface.vertices[corner].mean(axis=1)
    behind = (np.abs(middle[:, :2]).max(axis=1) < 0.14) & (middle[:, 2] == 0)
    outside = middle[:, 1] < -0.26
    assert behind.sum() > 250
    assert outside.sum() > 300
    assert not trust[behind | outside].any()
    assert not other.trust[: len(rear)][np.abs(rear[:, :2]).max(axis=1) < 0.14].any()
    shown = trust[:, 0] > 0.5
    assert shown.sum() > 1000
    blue = shown & (middle[:, 2] == 0)
    assert colors[blue] == pytest.approx(np.tile([40, 40, 220], (blue.sum(), 1)) / 255, abs=0.02)

    backward = dataclasses.replace(surface, faces=surface.faces[:, ::-1].copy())
    away = OtherPhoto.of(backward, subject, camera, canvas, delight=False)  # type: ignore[arg-type]
    assert not away.at(np.asarray(backward.faces, np.int64), weight)[0].any()
