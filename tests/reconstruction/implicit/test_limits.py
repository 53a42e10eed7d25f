"""Limits around a guide: what is spun between limbs is cut, what the maps move is not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from a2v.reconstruction.implicit.inputs import FRAME, Frame, GuideMesh
from a2v.reconstruction.implicit.limits import GuideLimits, spread_over_mesh
from a2v.types import OrthographicCamera

CAMERA = OrthographicCamera(scale=500.0, center_u=FRAME / 2, center_v=FRAME / 2)


def legs(moved: float = 0.0, apart: float = 0.5) -> SimpleNamespace:
    """A person of two legs, one half a metre before the other, 6 cm aside; the maps have the first one `moved` metres to the front."""
    rod = trimesh.creation.capsule(1.2, 0.07, count=[24, 24])
    rod.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0], [0, 0, 0]))
    rod.apply_translation(-rod.centroid)
    rod = rod.subdivide_to_size(0.04)
    front, back = rod.copy().apply_translation([0.06, 0, apart / 2]), rod.copy().apply_translation([-0.06, 0, -apart / 2])
    both = trimesh.util.concatenate([front, back])
    guide = GuideMesh(np.asarray(both.vertices), np.asarray(both.faces))
    seen = guide.maps(CAMERA, FRAME)
    mask = np.isfinite(guide.maps(CAMERA, FRAME, FRAME).depth_front).astype(np.float32)
    depths = np.stack([seen.depth_front, seen.depth_back])
    depths[0] += np.where(seen.depth_front > 0, moved, 0)
    depths[1] += np.where(seen.depth_back > 0, moved, 0)
    maps = np.concatenate([np.zeros((6, *depths.shape[1:])), np.nan_to_num(depths)])[None].astype(np.float32)
    return SimpleNamespace(frame=Frame(np.zeros((FRAME, FRAME, 3), np.uint8), mask, CAMERA), guide=guide, middle=1.0, maps={"maps": maps})


def test_nothing_is_spun_between_legs() -> None:
    limits = GuideLimits.of(legs())  # type: ignore[arg-type]
    points = np.array([[0.06, 0, 1.25], [-0.06, 0, 0.75], [0.0, 0, 1.0], [0.02, 0.2, 1.05], [0.06, 0, 1.35]])
    beyond = limits.beyond(points)
    assert (beyond[:2] < -0.05).all()  # in the middle of either
    assert (beyond[2:4] > 0.05).all()  # between them
    assert beyond[4] < 0  # 3 cm before the first one's skin: its cloth


def test_the_maps_move_the_guide() -> None:
    asked = np.array([[0.06, 0, 1.42]])  # 10 cm before the skin of the first leg
    assert GuideLimits.of(legs()).beyond(asked)[0] > 0.02  # type: ignore[arg-type]
    assert GuideLimits.of(legs(moved=0.08)).beyond(asked)[0] < 0  # type: ignore[arg-type]


def test_values_spread_over_the_mesh_and_not_through_the_air() -> None:
    one, two = trimesh.creation.icosphere(3, 0.1), trimesh.creation.icosphere(3, 0.1)
    two.apply_translation([0.21, 0, 0])
    both = trimesh.util.concatenate([one, two])
    count = len(both.vertices)
    trust = np.zeros((2, count))
    trust[0, :20] = 1
    spread = spread_over_mesh(np.full((2, count), 0.1), trust, np.asarray(both.faces))
    assert spread[: len(one.vertices)].mean() == pytest.approx(0.1, abs=0.02)
    assert np.abs(spread[len(one.vertices) :]).max() < 1e-6
