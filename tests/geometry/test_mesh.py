"""Values on meshes."""

from __future__ import annotations

import numpy as np
from scipy.sparse import identity

from a2v.geometry.mesh import (
    Cholesky,
    Rings,
    cotangent_weights,
    evened,
    factored,
    laplacian,
    uniform_weights,
    within,
)


def test_values_within_faces_are_to_the_bit_those_of_the_sum() -> None:
    generator = np.random.default_rng(0)
    values, corner = generator.random((50, 3)), generator.integers(0, 50, (200, 3))
    weight = generator.dirichlet(np.ones(3), 200)[..., None]
    assert np.array_equal(within(values, corner, weight), (values[corner] * weight).sum(axis=1))
    single = weight.astype(np.float32)
    assert np.array_equal(within(values, corner, single), (values[corner] * single).sum(axis=1))


def grid(size: int) -> np.ndarray:
    """Faces of a square grid with `size` vertices per side."""
    number = np.arange(size**2).reshape(size, size)
    low, right, up, across = (
        part.ravel()
        for part in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:])
    )
    return np.concatenate([np.stack([low, right, across], 1), np.stack([low, across, up], 1)])


def test_a_factored_matrix_gives_the_solutions_of_cholesky() -> None:
    faces, generator = grid(20), np.random.default_rng(0)
    points = np.column_stack([*np.divmod(np.arange(400), 20), generator.random(400)]).astype(float)
    system = laplacian(cotangent_weights(points, faces)) + 0.01 * identity(400)
    right = generator.random((400, 3))
    found = factored(system).solve(right)
    np.testing.assert_allclose(system @ found, right, atol=1e-10)
    np.testing.assert_allclose(found, Cholesky(system).solve(right), atol=1e-9)
    np.testing.assert_allclose(factored(system).solve(right[:, 0]), found[:, 0], atol=1e-10)


def test_rings_average_a_vertex_with_its_neighbors() -> None:
    faces, values = grid(3), np.arange(9.0)
    middle = [0, 1, 3, 4, 5, 7, 8]  # the middle vertex and its neighbors
    twice = Rings(faces, 9).evened(values, 2)
    counted = np.bincount(faces[(faces == 4).any(axis=1)].ravel(), minlength=9)
    weight = np.where(np.arange(9) == 4, 1, counted)[middle]
    once = Rings(faces, 9).evened(values)
    assert once[4] == np.average(values[middle], weights=weight)
    assert np.array_equal(twice, Rings(faces, 9).evened(once))
    assert np.array_equal(twice, evened(faces, values, 2))


def test_uniform_weights_count_the_faces_at_each_edge() -> None:
    weights = uniform_weights(np.array([[0, 1, 2], [1, 3, 2]]), 5).toarray()
    expected = np.zeros((5, 5))
    for one, two in ((0, 1), (0, 2), (1, 3), (2, 3)):
        expected[one, two] = expected[two, one] = 0.5
    expected[1, 2] = expected[2, 1] = 1.0
    np.testing.assert_array_equal(weights, expected)
