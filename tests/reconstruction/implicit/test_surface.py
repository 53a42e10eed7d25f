from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.geometry.mesh import vertex_normals
from a2v.reconstruction.implicit.inputs import FRAME, Frame, GuideMesh
from a2v.reconstruction.implicit.surface import (
    ImplicitSettings,
    expected_normals,
    rim_levels,
    smooth_surface,
)
from tests.support.ellipsoid import AXES, CAMERA, ellipsoid

BOUNDS = np.stack([-AXES - 0.05, AXES + 0.05])


@pytest.fixture(scope="module")
def person() -> SimpleNamespace:
    """Networks that predict an ellipsoid, 6 mm too thin on its left half.

    Their maps hold the true normals.
    """
    mesh = ellipsoid()
    solid = GuideMesh(mesh.vertices, mesh.faces)
    maps = solid.maps(CAMERA, FRAME)
    mask = np.isfinite(solid.maps(CAMERA, FRAME, FRAME).depth_front).astype(np.float32)
    normals = np.concatenate([maps.normals_front, maps.normals_back], axis=-1).transpose(2, 0, 1)
    return SimpleNamespace(
        frame=Frame(np.zeros((FRAME, FRAME, 3), np.uint8), mask, CAMERA),
        distance=lambda points: solid.at(points)[0] + 0.006 * (points[:, 0] > 0),
        maps={
            "maps": np.concatenate([normals, np.zeros((2, *normals.shape[1:]))])[None].astype(
                np.float32
            )
        },
    )


def test_the_level_at_the_rim_is_what_is_missing_there(person: SimpleNamespace) -> None:
    levels = rim_levels(person, BOUNDS)
    middle = FRAME // 2
    reach = int(AXES[0] * CAMERA.scale) - 3
    assert levels[middle, middle + reach] == pytest.approx(0.006, abs=0.0015)
    assert levels[middle, middle - reach] == pytest.approx(0.0, abs=0.0015)
    assert 0 <= levels[middle, middle] <= 0.006


def test_maps_of_both_sides_tell_normals(person: SimpleNamespace) -> None:
    mesh = ellipsoid()
    own = vertex_normals(mesh.vertices, mesh.faces)
    bumpy = mesh.vertices + 0.0015 * np.sin(150 * mesh.vertices[:, [1]]) * own
    normals, trust = expected_normals(person, bumpy, mesh.faces, np.ones(len(bumpy)))
    assert (trust > 0.5).mean() > 0.7
    assert (normals * own).sum(axis=1)[trust > 0.5].mean() > 0.998
    assert {-1.0, 1.0} == set(np.sign(normals[trust > 0.5][:, 2]))
    assert expected_normals(person, bumpy, mesh.faces, np.zeros(len(bumpy)))[1].max() == 0


def test_smoothing_leaves_what_is_not_shared() -> None:
    mesh = ellipsoid()
    share = (mesh.vertices[:, 1] > 0).astype(float)
    bumpy = mesh.vertices * (1 + np.random.default_rng(0).normal(0, 0.005, (len(mesh.vertices), 1)))
    smooth = smooth_surface(bumpy, mesh.faces, share, 8)
    np.testing.assert_array_equal(smooth[share == 0], bumpy[share == 0])
    assert (
        np.linalg.norm(smooth - mesh.vertices, axis=1)[share == 1].mean()
        < 0.6 * np.linalg.norm(bumpy - mesh.vertices, axis=1)[share == 1].mean()
    )
    assert smooth_surface(bumpy, mesh.faces, share, 0) is bumpy


@pytest.mark.parametrize(
    "bad", [{"smoothing": -1}, {"smoothing": 99}, {"relief": -0.1}, {"resolution": 10}]
)
def test_bad_settings_are_refused(bad: dict) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError):
        ImplicitSettings(**bad)
