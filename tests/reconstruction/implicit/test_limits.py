"""The shell around a dressed body cuts webs, completes unseen limbs, and keeps details."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from a2v.errors import InputError
from a2v.geometry.volume import Grid, signed_distance
from a2v.reconstruction.body_prior.surface import DressedBody
from a2v.reconstruction.implicit.inputs import FRAME, Frame
from a2v.reconstruction.implicit.limits import BAND, CLOTH, GAP, THICKER, THINNER, ShellLimits, room
from a2v.types import OrthographicCamera

CAMERA = OrthographicCamera(scale=500.0, center_u=FRAME / 2, center_v=FRAME / 2)
RADIUS, APART = 0.07, 0.25


def rod(x: float, z: float) -> trimesh.Trimesh:
    upright = trimesh.creation.capsule(1.0, RADIUS, count=[48, 48])
    upright.apply_translation(-upright.centroid)
    upright.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    return upright.subdivide_to_size(0.05).apply_translation([x, 0, z])


@pytest.fixture(scope="module")
def limits() -> ShellLimits:
    """Two legs, one in front of the other and 12 cm aside, in the middle of a wide mask."""
    both = trimesh.util.concatenate([rod(0.06, APART / 2), rod(-0.06, -APART / 2)])
    grid = Grid(np.array([-0.25, -0.7, -0.35]), 0.01, (51, 141, 71))
    field = signed_distance(np.asarray(both.vertices), np.asarray(both.faces), grid, band=4)
    mask = np.zeros((FRAME, FRAME), np.float32)
    mask[100:900, 262:762] = 1  # half a meter to each side
    frame = Frame(np.zeros((FRAME, FRAME, 3), np.uint8), mask, CAMERA)
    bare = np.zeros(grid.shape[:2], np.float32)
    dressed = DressedBody(
        field,
        grid,
        bare,
        np.asarray(both.vertices),
        np.asarray(both.faces),
        np.zeros(len(both.vertices), np.int8),
    )
    return ShellLimits.of(SimpleNamespace(frame=frame), dressed)  # type: ignore[arg-type]


def held(points: np.ndarray) -> np.ndarray:
    """The true distance to the legs."""
    ends = np.clip(points[:, 1], -0.5, 0.5)
    ways = [
        np.linalg.norm(
            points - np.stack([np.full(len(ends), x), ends, np.full(len(ends), z)], axis=1), axis=1
        )
        for x, z in ((0.06, APART / 2), (-0.06, -APART / 2))
    ]
    return np.minimum(*ways) - RADIUS


def test_nothing_is_spun_between_legs_and_no_leg_is_lost(limits: ShellLimits) -> None:
    points = np.array(
        [
            [0.06, 0, APART / 2],
            [-0.06, 0.2, -APART / 2],
            [0.0, 0, 0.0],
            [0.02, 0.2, 0.02],
            [0.06, 0, 0.3],
        ]
    )
    slab, empty = (limits.keep(points, np.full(5, value, np.float32)) for value in (-0.1, 0.1))
    assert (slab[:2] < 0).all()
    assert (slab[2:] > 0.01).all()  # between them, and before the first
    assert (empty[:2] < 0).all()  # although the networks see nothing
    assert (empty[2:] > 0.09).all()  # what is far away stays far away


def test_details_within_the_shell_stay(limits: ShellLimits) -> None:
    # on lines out of the front of the first leg; the legs are as thick as 14 cm
    out = np.linspace(-0.03, 0.03, 121)
    points = np.stack(
        [np.full(len(out), 0.06), np.zeros(len(out)), APART / 2 + RADIUS + out], axis=1
    )
    for shift, expected in (
        (0.003, 0.003),
        (-0.005, -0.005),
        (0.05, THICKER * 2 * RADIUS),
        (-0.05, -min(THINNER * 2 * RADIUS, BAND)),
    ):
        kept = limits.keep(points, (held(points) - shift).astype(np.float32))
        assert out[np.flatnonzero(kept < 0).max()] == pytest.approx(expected, abs=0.002)


def test_the_mask_and_the_other_leg_narrow_the_shell(limits: ShellLimits) -> None:
    near, far = (
        np.array([[0.06 + RADIUS + 0.004, 0, APART / 2]]),
        np.array([[0.06, 0, APART / 2 + RADIUS + 0.004]]),
    )
    narrow = ShellLimits(
        limits.dressed,
        limits.places,
        limits.outwards,
        limits.inwards,
        np.full((FRAME, FRAME), 0.01, np.float32),
        CAMERA,
    )
    inside = np.full(1, -0.1, np.float32)
    assert limits.keep(near, inside)[0] < 0
    assert limits.keep(far, inside)[0] < 0
    assert narrow.keep(near, inside)[0] > 0
    vertices = np.concatenate([rod(0, 0).vertices, rod(0, 2 * RADIUS + 0.01).vertices])
    faces = np.concatenate([rod(0, 0).faces, rod(0, 0).faces + len(rod(0, 0).vertices)])
    thickness, gap = room(np.asarray(vertices, float), faces)
    middle = np.abs(vertices[:, 1]) < 0.3
    facing = middle & (np.abs(vertices[:, 0]) < 0.005) & (np.abs(vertices[:, 2] - RADIUS) < 0.002)
    assert facing.any()
    assert thickness[middle] == pytest.approx(2 * RADIUS, abs=0.003)
    assert gap[facing] == pytest.approx(0.01, abs=0.002)
    assert GAP * gap[facing].max() < 0.5 * 0.012  # both sides moved, they do not meet
    assert np.isinf(gap[middle & (vertices[:, 2] < -RADIUS + 0.002)]).all()


def test_networks_do_not_tear_cloth_between_the_legs(limits: ShellLimits) -> None:
    cloth = dataclasses.replace(limits.dressed, cloth=np.ones_like(limits.dressed.cloth))
    frame = Frame(
        np.zeros((FRAME, FRAME, 3), np.uint8), np.ones((FRAME, FRAME), np.float32), CAMERA
    )
    held_fast = ShellLimits.of(SimpleNamespace(frame=frame), cloth)  # type: ignore[arg-type]
    within = np.array([[0.06, 0, APART / 2 + RADIUS - 0.01]])
    nothing = np.full(1, 0.1, np.float32)
    assert limits.keep(within, nothing)[0] > 0
    assert held_fast.keep(within, nothing)[0] < 0
    np.testing.assert_allclose(held_fast.inwards, CLOTH * limits.inwards, rtol=1e-5)


def test_a_body_beside_the_mask_is_refused(limits: ShellLimits) -> None:
    gone = dataclasses.replace(limits.dressed, field=np.full_like(limits.dressed.field, BAND))
    frame = Frame(np.zeros((8, 8, 3), np.uint8), np.ones((8, 8), np.float32), CAMERA)
    with pytest.raises(InputError, match="within the mask"):
        ShellLimits.of(SimpleNamespace(frame=frame), gone)  # type: ignore[arg-type]
