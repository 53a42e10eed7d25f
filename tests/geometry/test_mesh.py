"""Values on meshes."""

from __future__ import annotations

import numpy as np

from a2v.geometry.mesh import within


def test_values_within_faces_are_to_the_bit_those_of_the_sum() -> None:
    generator = np.random.default_rng(0)
    values, corner = generator.random((50, 3)), generator.integers(0, 50, (200, 3))
    weight = generator.dirichlet(np.ones(3), 200)[..., None]
    assert np.array_equal(within(values, corner, weight), (values[corner] * weight).sum(axis=1))
    single = weight.astype(np.float32)
    assert np.array_equal(within(values, corner, single), (values[corner] * single).sum(axis=1))
