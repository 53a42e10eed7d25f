"""Rays and closest points are the same for any number of threads."""

import subprocess

import numpy as np
import pytest

from a2v.geometry.rays import RayScene, signed_distance_and_normals, texels
from a2v.processes import python_command


def _ball(count=40):
    """A closed sphere of radius 1: vertices, faces."""
    import trimesh

    ball = trimesh.creation.uv_sphere(count=(count, count))
    return np.asarray(ball.vertices), np.asarray(ball.faces)


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(-1.5, 1.5, (5000, 3)).astype(np.float32)


def test_threads_change_no_answer(monkeypatch, points):
    vertices, faces = _ball()
    found = []
    for threads in ("1", "2"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        scene = RayScene(vertices, faces)
        hits = scene.cast(points, -points)
        found.append(
            [
                *signed_distance_and_normals(vertices, faces, vertices, scene, points),
                hits.hit,
                hits.face,
                hits.barycentric,
            ]
        )
    for one, two in zip(*found, strict=True):
        np.testing.assert_array_equal(one, two)
    assert (found[0][0] < 0).any()
    assert (found[0][0] > 0).any()


def test_open3d_comes_without_dash():
    code = (
        "import sys\n"
        "from a2v.geometry.rays import load_open3d\n"
        "load_open3d().t.geometry.RaycastingScene()\n"
        "print(sorted({'dash', 'plotly', 'flask'} & set(sys.modules)))"
    )
    told = subprocess.run(python_command(code), capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"


def test_texels_lie_where_their_barycentric_coordinates_say():
    size = 300  # more than one block of rows
    corners = np.array(
        [[[10, 20], [250, 40], [90, 280]], [[255, 50], [290, 290], [120, 285]]], float
    )
    face, weight = texels(corners, size)
    assert set(np.unique(face)) == {-1, 0, 1}
    assert face.dtype == np.int32
    rows, columns = np.nonzero(face >= 0)
    at = (weight[rows, columns, :, None] * corners[face[rows, columns]]).sum(axis=1)
    np.testing.assert_allclose(at, np.stack([columns + 0.5, size - rows - 0.5], 1), atol=1e-2)
    area = 0.5 * np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    np.testing.assert_allclose(np.bincount(face[face >= 0]), area, rtol=5e-3)
    assert (weight[face < 0] == 0).all()
