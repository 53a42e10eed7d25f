from __future__ import annotations

import numpy as np
import pytest
import trimesh

from a2v.geometry.mesh import vertex_normals
from a2v.geometry.visibility import depth_map, silhouette_iou, visible_vertices
from a2v.geometry.volume import EXACT, Grid, signed_distance, winding_inside
from a2v.reconstruction.coloring.atlas import face_neighbors, make_atlas
from a2v.types import OrthographicCamera

CAMERA = OrthographicCamera(scale=100.0, center_u=60.0, center_v=90.0)


def cube(center=(0.0, 0.0, 0.0), side: float = 0.4, cuts: int = 3) -> trimesh.Trimesh:
    mesh = trimesh.creation.box((side, side, side))
    for _ in range(cuts):
        mesh = mesh.subdivide()
    mesh.apply_translation(center)
    return mesh


def test_visibility_on_a_cube() -> None:
    mesh = cube()
    seen = visible_vertices(mesh.vertices, mesh.faces)
    on_front = np.isclose(mesh.vertices[:, 2], 0.2)
    inner = np.abs(mesh.vertices[:, :2]).max(axis=1) < 0.19
    assert seen[on_front & inner].all()
    assert not seen[mesh.vertices[:, 2] < 0.15].any()


def test_what_lies_behind_is_hidden() -> None:
    near, far = cube((0.0, 0, 0.6), 0.2), cube((0.05, 0, 0.0))
    both = trimesh.util.concatenate([near, far])
    seen = visible_vertices(both.vertices, both.faces)[len(near.vertices) :]
    front = np.isclose(far.vertices[:, 2], 0.2)
    covered = np.abs(far.vertices[:, :2]).max(axis=1) < 0.09
    assert covered.any()
    assert not seen[front & covered].any()
    assert seen[
        front
        & (far.vertices[:, 0] > 0.12)
        & (far.vertices[:, 0] < 0.24)
        & (np.abs(far.vertices[:, 1]) < 0.19)
    ].all()


def test_projection_conventions() -> None:
    """A point of the surface lands on its pixel: up is a smaller row, the person's left (+x) a
    larger column."""
    mesh = cube((0.3, 0.5, 0.0), 0.2)
    depth = depth_map(mesh.vertices, mesh.faces, CAMERA, (140, 120))
    rows, columns = np.nonzero(np.isfinite(depth))
    assert (columns.min(), columns.max()) == (80, 99)  # u = 60 + 100 * (0.2 .. 0.4)
    assert (rows.min(), rows.max()) == (30, 49)  # v = 90 - 100 * (0.6 .. 0.4)
    assert depth[40, 90] == pytest.approx(0.1, abs=1e-5)
    mask = np.zeros((120, 140), np.float32)
    mask[30:50, 80:100] = 1
    assert silhouette_iou(mesh.vertices, mesh.faces, CAMERA, mask) == 1.0
    assert silhouette_iou(
        mesh.vertices, mesh.faces, CAMERA, np.roll(mask, 10, axis=1)
    ) == pytest.approx(1 / 3)


def test_normals_point_outwards() -> None:
    ball = trimesh.creation.icosphere(3)
    assert ((vertex_normals(ball.vertices, ball.faces) * ball.vertices).sum(axis=1) > 0.99).all()


def test_far_from_the_surface_distances_are_interpolated() -> None:
    ball = trimesh.creation.icosphere(4, 0.3)
    grid = Grid(np.full(3, -0.52), 0.013, (81, 80, 82))
    field = signed_distance(np.asarray(ball.vertices), np.asarray(ball.faces), grid, band=9)
    x, y, z = np.meshgrid(*(grid.axis(axis) for axis in range(3)), indexing="ij")
    true = np.sqrt(x**2 + y**2 + z**2) - 0.3
    near, far = np.abs(true) < EXACT * grid.cell, np.abs(true) > 9.1 * grid.cell
    assert np.abs(field - true)[near].max() < 0.05 * grid.cell
    assert np.abs(field - true)[~near & ~far].max() < 0.35 * grid.cell
    np.testing.assert_allclose(np.abs(field[far]), 9 * grid.cell, atol=0.2 * grid.cell)
    assert ((field < 0) == (true < 0))[np.abs(true) > 1e-3].all()


def test_signed_distance_of_overlapping_balls() -> None:
    """Parity would make the overlap outside; and the distances are a ball's."""
    a, b = trimesh.creation.icosphere(4, radius=0.3), trimesh.creation.icosphere(4, radius=0.3)
    b.apply_translation((0.25, 0, 0))
    both = trimesh.util.concatenate([a, b])
    grid = Grid(np.array([-0.4, -0.4, -0.4]), 0.02, (55, 41, 41))
    inside = winding_inside(both.vertices, both.faces, grid)
    points = np.stack(np.meshgrid(*(grid.axis(i) for i in range(3)), indexing="ij"), axis=-1)
    truth = (
        np.minimum(np.linalg.norm(points, axis=-1), np.linalg.norm(points - (0.25, 0, 0), axis=-1))
        - 0.3
    )
    sure = np.abs(truth) > 0.004
    assert np.array_equal(inside[sure], (truth < 0)[sure])
    one = signed_distance(a.vertices, a.faces, grid)
    exact = np.linalg.norm(points, axis=-1) - 0.3
    near = np.abs(exact) < 0.04
    assert np.abs(one - exact)[near].max() < 0.003


def test_atlas_is_one_to_one() -> None:
    """Each texel belongs to the face that it claims, charts do not overlap, and nearly every face
    has texels."""
    rng = np.random.default_rng(0)
    mesh = trimesh.util.concatenate(
        [
            cube((0, 0, 0)),
            trimesh.creation.icosphere(3, radius=0.2).apply_translation((0.1, 0.1, 0.5)),
        ]
    )
    atlas = make_atlas(mesh.vertices, mesh.faces.astype(np.int64), size=512, density=1000.0)
    assert atlas.uv.min() >= 0
    assert atlas.uv.max() <= 1
    rows, columns = np.nonzero(atlas.face >= 0)
    pick = rng.choice(len(rows), 2000)
    rows, columns = rows[pick], columns[pick]
    face = atlas.face[rows, columns]
    uv = (atlas.uv[face] * atlas.barycentric[rows, columns][..., None]).sum(axis=1)
    assert np.abs(uv[:, 0] * 512 - (columns + 0.5)).max() < 0.02
    assert np.abs((1 - uv[:, 1]) * 512 - (rows + 0.5)).max() < 0.02
    corners = atlas.uv.astype(np.float64) * 512
    sides = corners[:, 1:] - corners[:, :1]
    area = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]) / 2
    covered = (atlas.face >= 0).sum()
    assert covered == pytest.approx(
        area.sum(), rel=0.05
    )  # overlapping charts would cover less than their areas' sum


def test_face_neighbors_of_a_closed_mesh() -> None:
    ball = trimesh.creation.icosphere(2)
    neighbors = face_neighbors(ball.faces.astype(np.int64))
    assert (neighbors != np.arange(len(neighbors))[:, None]).all()
    for face in range(0, len(neighbors), 17):
        for other in neighbors[face]:
            assert len(set(ball.faces[face]) & set(ball.faces[other])) == 2
