"""Large views with things, furniture, cut borders and photographs.

The ground truth is the whole person's; the mask is what the photo shows.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.geometry.colors import srgb_to_linear
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.studio import Studio
from a2v.lab.studio.view import View

MAPS = (
    "depth_front",
    "depth_back",
    "normals_front",
    "normals_back",
    "parts_front",
    "guide_depth_front",
    "guide_normals_back",
)
NUMBER = 2
"""Return a view in which furniture occludes something, and that is framed as without it."""


@pytest.fixture(scope="module")
def furnished(folder: Path, data: Path, studio: Studio) -> Studio:
    return Studio.open(folder, data, replace(studio.settings, furniture=1.0))


@pytest.fixture(scope="module")
def behind(furnished: Studio) -> View:
    return furnished.view("training", NUMBER)


@pytest.fixture(scope="module")
def bare(studio: Studio) -> View:
    return studio.view("training", NUMBER)


def test_the_truth_is_that_of_the_view_without(
    studio: Studio, furnished: Studio, behind: View, bare: View
) -> None:
    assert behind.camera == bare.camera
    assert behind.hidden.sum() > 500
    for name in MAPS:
        np.testing.assert_array_equal(getattr(behind, name), getattr(bare, name))
    np.testing.assert_array_equal(behind.guide_vertices, bare.guide_vertices)
    scene, among = (made.scene("training", NUMBER) for made in (studio, furnished))
    np.testing.assert_array_equal(among.surface.vertices, scene.surface.vertices)
    np.testing.assert_array_equal(among.landmarks, scene.landmarks)
    solid = scene.solid()
    np.testing.assert_allclose(
        solid.signed_distance(behind.points), behind.distance.astype(np.float32), atol=1e-3
    )
    assert np.abs(solid.signed_distance(behind.surface_points)).max() < 1e-4
    assert behind.provenance["around"]["furniture"] is True


def test_the_mask_is_what_the_photo_shows(behind: View, bare: View) -> None:
    whole, left = bare.mask > 127, behind.mask > 127
    assert left.sum() < whole.sum() - 1000
    assert (left & ~whole).sum() < 100
    assert (behind.things[whole & ~left] > 127).mean() > 0.95
    lost = (whole & ~left).reshape(512, 2, 512, 2).mean(axis=(1, 3))
    assert behind.hidden[lost == 1].all()
    assert not behind.hidden[(lost == 0) & np.isfinite(behind.depth_front)].sum() > 30
    assert not bare.surrounded
    assert not bare.things.any()
    assert not bare.hidden.any()


def test_points_behind_things_are_not_seen(behind: View) -> None:
    column, row = np.floor(behind.camera.project(behind.surface_points) / 2).astype(int).T
    assert not behind.surface_visible[behind.hidden[row, column]].mean() > 0.02  # but at rims
    seen = behind.surface_visible & (behind.surface_normals[:, 2] > 60)
    column, row = np.floor(behind.camera.project(behind.surface_points[seen])).astype(int).T
    photo, said = (
        srgb_to_linear(behind.image[row, column] / 255),
        srgb_to_linear(behind.surface_colors[seen] / 255),
    )
    assert 0.7 < np.median(photo.mean(axis=1) / np.maximum(said.mean(axis=1), 0.02)) < 1.4


def test_what_the_border_cuts_off_is_in_the_samples_alone(
    folder: Path, data: Path, studio: Studio, bare: View
) -> None:
    view = Studio.open(folder, data, replace(studio.settings, cut=1.0)).view("training", NUMBER)
    rim = np.concatenate([view.mask[0], view.mask[-1], view.mask[:, 0], view.mask[:, -1]])
    assert (rim > 127).sum() > 30
    assert view.surrounded
    assert not view.things.any()
    np.testing.assert_array_equal(view.guide_vertices, bare.guide_vertices)
    pixels = view.camera.project(view.surface_points)
    outside = ((pixels < 0) | (pixels > 1024)).any(axis=1)
    assert outside.sum() > 50
    assert not view.surface_visible[outside].any()
    assert view.surface_visible[~outside].mean() > 0.3


def test_hands_hold_and_a_seed_repeats(
    folder: Path, data: Path, studio: Studio, tmp_path: Path
) -> None:
    settings = replace(studio.settings, things=1.0, furniture=0.3, cut=0.3, photographs=0.5)
    first, again = (Studio.open(folder, data, settings) for _ in range(2))
    scene = first.scene("training", 3)
    view = first.view("training", 3, scene)
    arrays, twice = view.to_arrays(), again.view("training", 3).to_arrays()
    assert all(np.array_equal(arrays[name], twice[name]) for name in arrays)
    assert scene.clutter.held is not None
    assert view.provenance["around"]["held"] == scene.clutter.held.kind
    assert view.things.any()
    assert not np.array_equal(
        scene.surface.vertices, studio.scene("training", 3).surface.vertices
    )  # arms and fingers hold
    view.save(tmp_path / "view.npz")
    loaded = View.load(tmp_path / "view.npz")
    np.testing.assert_array_equal(loaded.things, view.things)
    np.testing.assert_array_equal(loaded.hidden, view.hidden)


def test_a_photograph_behind_changes_nobody(
    folder: Path, data: Path, studio: Studio, bare: View
) -> None:
    before = Studio.open(folder, data, replace(studio.settings, photographs=1.0)).view(
        "training", NUMBER
    )
    np.testing.assert_array_equal(before.mask, bare.mask)
    np.testing.assert_array_equal(before.depth_back, bare.depth_back)
    assert not before.surrounded
    assert before.provenance["around"] == {"photograph": True}
    assert np.abs(before.image.astype(int) - bare.image)[bare.mask == 0].mean() > 10


def test_nothing_is_around_by_default(
    studio: Studio, view: View, data: Path, tmp_path: Path
) -> None:
    assert not studio.settings.surrounds
    assert "things" not in view.encoded
    assert "around" not in view.provenance
    with pytest.raises(InputError, match="furniture is 2"):
        StudioSettings(furniture=2.0)
    with pytest.raises(InputError, match="has no picture"):
        Studio(
            data / "avatars",
            studio.library,
            {},
            StudioSettings(photographs=0.5, backgrounds=str(tmp_path)),
        )
