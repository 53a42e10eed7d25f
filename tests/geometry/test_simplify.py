"""A simplified mesh has original vertices, is closed and stays within the texture's charts."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from a2v.errors import InputError
from a2v.geometry.mesh import is_closed
from a2v.geometry.simplify import simplify


def ball() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces and texture coordinates of a sphere with two charts."""
    mesh = trimesh.creation.icosphere(4)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    front = vertices[faces].mean(axis=1)[:, 2] > 0
    return vertices, faces, chart(vertices[faces], front)


def chart(points: np.ndarray, front: np.ndarray) -> np.ndarray:
    """Return where places (F, 3, 3) of faces lie in the texture."""
    return (0.2 * points[..., :2] + np.where(front, 0.25, 0.75)[:, None, None]).astype(np.float32)


def test_what_is_left_is_a_closed_part_of_the_given_mesh() -> None:
    vertices, faces, uv = ball()
    result = simplify(vertices, faces, 800, uv=uv)
    assert 700 < len(result.faces) <= 800
    points = vertices[result.kept]
    assert is_closed(points, result.faces)
    small = trimesh.Trimesh(points, result.faces, process=False)
    assert small.volume > 0.97 * trimesh.Trimesh(vertices, faces, process=False).volume
    assert (
        np.einsum("fa,fa->f", small.face_normals, points[result.faces].mean(axis=1)) > 0
    ).all()  # nothing is turned over


def test_corners_stay_in_their_charts() -> None:
    """Each corner's texture coordinates are those of its own vertex, in one chart for all corners
    of a face."""
    vertices, faces, uv = ball()
    result = simplify(vertices, faces, 800, uv=uv)
    points, own = vertices[result.kept][result.faces], uv.reshape(-1, 2)[result.corners]
    front = own.mean(axis=(1, 2)) < 0.5
    np.testing.assert_allclose(own, chart(points, front), atol=1e-6)
    assert 0.4 < front.mean() < 0.6


def test_important_and_locked_vertices_stay() -> None:
    vertices, faces, _ = ball()
    upper = vertices[:, 1] > 0
    locked = vertices[:, 0] > 0.95
    result = simplify(vertices, faces, 1200, importance=np.where(upper, 50.0, 1.0), locked=locked)
    assert np.isin(np.flatnonzero(locked), result.kept).all()
    assert upper[result.kept].mean() > 0.7


def test_an_open_sheet_keeps_its_border() -> None:
    grid = np.stack(np.meshgrid(np.linspace(0, 1, 21), np.linspace(0, 1, 21)), axis=-1).reshape(
        -1, 2
    )
    vertices = np.column_stack([grid, np.zeros(len(grid))])
    cells = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
    faces = np.concatenate(
        [np.stack([cells, cells + 1, cells + 22], 1), np.stack([cells, cells + 22, cells + 21], 1)]
    )
    result = simplify(vertices, faces, 60)
    assert trimesh.Trimesh(
        vertices[result.kept], result.faces, process=False
    ).area == pytest.approx(1, abs=1e-6)
    with pytest.raises(InputError, match="3 triangles"):
        simplify(vertices, faces, 3)
