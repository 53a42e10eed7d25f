"""Surface extraction on fields whose surface is known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from a2v.errors import InputError
from a2v.geometry.mesh import is_closed, keep_pieces
from a2v.geometry.volume import Grid
from a2v.reconstruction.extraction import (
    ExtractionSettings,
    extract_surface,
    mesh_grid,
    sample_field,
)
from a2v.reconstruction.remeshing import even_out, self_intersections

BOX = np.array([[-0.32, -0.5, -0.2], [0.32, 0.5, 0.2]])
TALL = np.array([[-0.3, -0.9, -0.2], [0.3, 0.9, 0.2]])
QUICK = ExtractionSettings(resolution=200, vertices=25_000)


def sphere(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points, axis=1) - 0.18


def torus(points: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.22, points[:, 2]) - 0.08


def two_blobs(points: np.ndarray) -> np.ndarray:
    apart = np.array([0.15, 0, 0])
    return (
        np.minimum(np.linalg.norm(points - apart, axis=1), np.linalg.norm(points + apart, axis=1))
        - 0.1505
    )


def finger(points: np.ndarray, radius: float = 0.010) -> np.ndarray:
    """A capsule as thick as a finger and as long as a person."""
    along = np.clip(points[:, 1], -0.85, 0.85)
    return np.sqrt(points[:, 0] ** 2 + (points[:, 1] - along) ** 2 + points[:, 2] ** 2) - radius


VOLUMES = {
    sphere: (BOX, 4 / 3 * np.pi * 0.18**3),
    torus: (BOX, 2 * np.pi**2 * 0.22 * 0.08**2),
    # two balls less the two caps that overlap
    two_blobs: (BOX, 2 * (4 / 3 * np.pi * 0.1505**3 - np.pi * 0.0005**2 * (0.1505 - 0.0005 / 3))),
    finger: (TALL, np.pi * 0.01**2 * 1.7 + 4 / 3 * np.pi * 0.01**3),
}


def evenness(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """4 sqrt(3) area / sum of squared edges: 1 for an equilateral triangle."""
    corners = vertices[faces]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return 4 * np.sqrt(3) * area / ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=(1, 2))


@pytest.mark.parametrize("field", VOLUMES, ids=lambda field: field.__name__)
def test_closed_true_and_even(field) -> None:
    bounds, volume = VOLUMES[field]
    vertices, faces = extract_surface(field, bounds, settings=QUICK)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(volume, rel=0.01)  # positive: the faces look outwards
    assert mesh.euler_number == (0 if field is torus else 2)
    assert 25_000 <= len(vertices) < 27_000
    assert np.abs(field(vertices)).mean() < 5e-5
    assert not self_intersections(vertices, faces).any()
    assert np.percentile(evenness(vertices, faces), 1) > 0.6


@pytest.mark.parametrize("field", VOLUMES, ids=lambda field: field.__name__)
@pytest.mark.parametrize("cut", [np.inf, 0.05])
def test_as_dense_with_few_evaluations(field, cut: float) -> None:
    bounds, _ = VOLUMES[field]
    asked = []

    def counted(points: np.ndarray) -> np.ndarray:
        asked.append(len(points))
        return np.clip(field(points), -cut, cut)

    sampled = sample_field(counted, bounds)
    assert sampled.evaluations == sum(asked)
    assert sampled.evaluations <= 0.15 * sampled.values.size
    nodes = (
        np.indices(sampled.values.shape).reshape(3, -1).T * sampled.grid.cell + sampled.grid.origin
    )
    dense = field(nodes.astype(np.float32)).reshape(sampled.values.shape)
    assert ((sampled.values < 0) == (dense < 0)).all()
    inside = dense < 0
    crossed = np.zeros_like(inside)
    for axis in range(3):
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        differs = inside[tuple(low)] != inside[tuple(high)]
        crossed[tuple(low)] |= differs
        crossed[tuple(high)] |= differs
    assert crossed.any()
    np.testing.assert_allclose(
        sampled.values[crossed], np.clip(dense[crossed], -cut, cut), atol=1e-6
    )  # so marching cubes gives the same mesh
    assert sampled.grid.cell == pytest.approx(np.ptp(bounds, axis=0).max() / 256)


def test_follows_what_is_no_distance() -> None:
    # overstated sixfold: most cells that the surface crosses look far from it
    sampled = sample_field(lambda points: 6 * torus(points), BOX)
    nodes = (
        np.indices(sampled.values.shape).reshape(3, -1).T * sampled.grid.cell + sampled.grid.origin
    )
    assert ((sampled.values < 0).ravel() == (torus(nodes.astype(np.float32)) < 0)).all()


def test_closes_what_leaves_the_bounds() -> None:
    vertices, faces = extract_surface(
        sphere, np.array([[-0.3, 0.0, -0.2], [0.3, 0.5, 0.2]]), settings=QUICK
    )
    assert is_closed(vertices, faces)
    assert trimesh.Trimesh(vertices, faces, process=False).body_count == 1


def test_dust_and_bubbles_go() -> None:
    def field(points: np.ndarray) -> np.ndarray:
        bubble = 0.1 - np.linalg.norm(points, axis=1)
        dust = np.linalg.norm(points - [0.2, 0.42, 0.1], axis=1) - 0.05
        return np.minimum(np.maximum(sphere(points), bubble), dust)

    mesh = trimesh.Trimesh(*extract_surface(field, BOX, settings=QUICK), process=False)
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(VOLUMES[sphere][1], rel=0.01)
    both = ExtractionSettings(resolution=200, vertices=25_000, pieces=0.001)
    assert (
        trimesh.Trimesh(*extract_surface(field, BOX, settings=both), process=False).body_count == 2
    )


def test_noise_still_gives_a_closed_mesh() -> None:
    for seed in range(2):
        values = np.random.default_rng(seed).standard_normal((9, 9, 9)).astype(np.float32)
        for axis in range(3):
            np.moveaxis(values, axis, 0)[[0, -1]] = 1
        vertices, faces = mesh_grid(values, Grid(np.zeros(3), 0.05, values.shape), 25_000)
        assert is_closed(vertices, faces)
        assert trimesh.Trimesh(vertices, faces, process=False).is_watertight


def test_self_intersections_are_cut() -> None:
    # a ball whose pole is pushed through the opposite side
    ball = trimesh.creation.icosphere(5, 0.3)
    pushed = ball.vertices.copy()
    pole = pushed[:, 1] > 0.285
    pushed[pole, 1] -= 0.9
    assert self_intersections(pushed, np.asarray(ball.faces)).any()
    vertices, faces = even_out(pushed, np.asarray(ball.faces, np.int64), 25_000)
    assert is_closed(vertices, faces)
    assert trimesh.Trimesh(vertices, faces, process=False).body_count == 1
    assert not self_intersections(vertices, faces).any()


def test_the_least_target_allows_for_what_is_cut() -> None:
    ball = trimesh.creation.icosphere(5, 0.3)
    pushed = ball.vertices.copy()
    pushed[pushed[:, 1] > 0.299, 1] -= 0.9  # 19 vertices: as few as on a person
    vertices, _ = even_out(pushed, np.asarray(ball.faces, np.int64), 25_000)
    assert 25_000 <= len(vertices) < 27_000


def test_is_closed_tells() -> None:
    cube = trimesh.creation.box()
    vertices, faces = np.asarray(cube.vertices), np.asarray(cube.faces, np.int64)
    assert is_closed(vertices, faces)
    assert not is_closed(vertices, faces[1:])  # a hole
    assert not is_closed(vertices, faces[:, ::-1])  # inside out
    assert not is_closed(
        vertices, np.concatenate([faces[:1, ::-1], faces[1:]])
    )  # one face against the others
    assert not is_closed(np.concatenate([vertices, vertices[:1]]), faces)  # a vertex too many
    two = np.concatenate([faces, faces + 8])
    kept = keep_pieces(np.concatenate([vertices, 0.5 * vertices + 3]), two)
    assert len(kept[0]) == 8
    assert len(keep_pieces(np.concatenate([vertices, 0.5 * vertices + 3]), two, 0.1)[0]) == 16


def test_bad_input() -> None:
    with pytest.raises(InputError, match="no surface"):
        extract_surface(lambda points: np.ones(len(points)), BOX, settings=QUICK)
    with pytest.raises(InputError, match="NaN"):
        extract_surface(lambda points: np.full(len(points), np.nan), BOX, settings=QUICK)
    with pytest.raises(InputError, match="shape"):
        extract_surface(lambda points: points, BOX, settings=QUICK)
    with pytest.raises(InputError, match="bounds"):
        extract_surface(sphere, BOX[::-1], settings=QUICK)
    for wrong in (
        {"resolution": 100},
        {"vertices": 10},
        {"slack": 0.0},
        {"pieces": 0.0},
        {"smoothing": -1},
    ):
        with pytest.raises(InputError, match=next(iter(wrong))):
            ExtractionSettings(**wrong)


def test_progress_ends() -> None:
    calls = []
    extract_surface(
        finger, TALL, settings=QUICK, progress=lambda done, total: calls.append((done, total))
    )
    assert calls[-1][0] == calls[-1][1]
    assert calls == sorted(calls)
