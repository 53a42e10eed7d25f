"""A coarse mesh with its normal map shows the normals of the fine mesh."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.geometry.mesh import vertex_normals
from a2v.geometry.normal_map import bake_normal_map, corner_tangents

SIZE = 128


def sheet(cells: int, mirrored: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices, faces and texture coordinates of a wavy sheet, `cells` wide."""
    ticks = np.linspace(0, 1, cells + 1)
    grid = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    vertices = np.column_stack([grid, 0.02 * np.sin(9 * grid[:, 0]) * np.cos(7 * grid[:, 1])])
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    above = first + cells + 1
    faces = np.concatenate(
        [np.stack([first, first + 1, above + 1], 1), np.stack([first, above + 1, above], 1)]
    )
    flat = np.column_stack([1 - grid[:, 0], grid[:, 1]]) if mirrored else grid
    return vertices, faces, (0.02 + 0.96 * flat[faces]).astype(np.float32)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_coarse_sheet_with_the_map_has_the_fine_ones_normals(mirrored: bool) -> None:
    fine, coarse = sheet(64, mirrored), sheet(4, mirrored)
    local = bake_normal_map(fine, coarse, size=SIZE) / 127.5 - 1
    vertices, faces, uv = coarse
    normals, tangents = vertex_normals(vertices, faces), corner_tangents(vertices, faces, uv)
    np.testing.assert_allclose(np.linalg.norm(tangents[..., :3], axis=-1), 1, atol=1e-6)
    assert (tangents[..., 3] == (-1 if mirrored else 1)).all()
    generator, cosines = np.random.default_rng(0), []
    for face, weights in zip(
        generator.integers(len(faces), size=200), generator.dirichlet([2, 2, 2], 200), strict=True
    ):
        place = weights @ uv[face]
        normal, tangent = weights @ normals[faces[face]], weights @ tangents[face, :, :3]
        normal /= np.linalg.norm(normal)
        tangent -= (tangent @ normal) * normal
        tangent /= np.linalg.norm(tangent)
        seen = local[int((1 - place[1]) * SIZE), int(place[0] * SIZE)]
        shown = seen @ np.stack([tangent, np.cross(normal, tangent) * tangents[face, 0, 3], normal])
        x, y = (weights @ vertices[faces[face]])[:2]
        true = np.array(
            [-0.18 * np.cos(9 * x) * np.cos(7 * y), 0.14 * np.sin(9 * x) * np.sin(7 * y), 1]
        )
        cosines.append(shown @ true / np.linalg.norm(true) / np.linalg.norm(shown))
    assert np.degrees(np.arccos(np.clip(np.mean(cosines), -1, 1))) < 2
    plain = np.degrees(
        np.arccos(np.clip(np.mean([1 / np.linalg.norm([0.18 * 0.5, 0.14 * 0.5, 1])]), -1, 1))
    )
    assert plain > 4  # without it, flat


def test_a_mesh_needs_no_map_of_itself() -> None:
    same = sheet(8, False)
    baked = bake_normal_map(same, same, size=SIZE).astype(int)
    assert np.abs(baked - [128, 128, 255]).max() <= 2
