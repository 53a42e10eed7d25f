"""What is computed once for several uses is what each use would compute."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from a2v.reconstruction.body_prior.rim import EVERYWHERE, SkinDeformer
from a2v.reconstruction.coloring.atlas import Atlas, PaddedAtlas
from a2v.reconstruction.reading.held import _COMMON, _ROUNDED, _STRANGE, _common


def test_a_field_known_everywhere_is_smoothed_as_it_would_be_spread() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    points, faces = np.asarray(ball.vertices), np.asarray(ball.faces)
    deformer, generator = SkinDeformer(points, faces), np.random.default_rng(0)
    ones, far = np.ones(len(points)), np.full(len(points), EVERYWHERE)
    for near in (0.3, 0.6, 0.3):
        field = generator.normal(size=(len(points), 2))
        found = deformer.smoothed(field, near=near)
        np.testing.assert_allclose(
            found, deformer.spread(ones, field, near=near, fade=far), atol=1e-12
        )
        assert found.std() < 0.5 * field.std()


def test_every_sliver_has_a_texel_and_every_texel_the_nearest_color() -> None:
    face = np.full((8, 8), -1, np.int32)
    face[1:4, 1:4] = 0  # face 1 has no texel; it lies at row 6, column 5
    uv = np.zeros((2, 3, 2), np.float32)
    uv[0], uv[1] = [[0.1, 0.5], [0.5, 0.5], [0.1, 0.9]], [[5.2 / 8, 1.4 / 8]] * 3
    padded = PaddedAtlas.of(Atlas(uv, 8, face, np.zeros((8, 8, 3), np.float32), 1.0))
    assert padded.slivers.tolist() == [1]
    assert [int(index[0]) for index in padded.spots] == [6, 5]
    filled = np.argwhere(
        (face >= 0) | (np.indices((8, 8)) == np.array([6, 5])[:, None, None]).all(0)
    )
    rows, columns = padded.nearest
    asked = np.argwhere(np.ones((8, 8), bool))
    away = np.linalg.norm(asked - np.stack([rows.ravel(), columns.ravel()], 1), axis=1)
    np.testing.assert_allclose(away, cKDTree(filled).query(asked)[0])


def test_common_colors_are_those_near_many_samples() -> None:
    generator = np.random.default_rng(0)
    own = generator.normal([50, 0, 0], [20, 10, 10], (500, 3))
    colors = np.concatenate([own, generator.uniform(-120, 120, (500, 3))])
    rounded = np.rint(colors / _ROUNDED) * _ROUNDED
    near = (np.linalg.norm(rounded[:, None] - own, axis=2) <= _STRANGE).sum(axis=1)
    wanted = near >= _COMMON * len(own)
    assert 0.1 < wanted.mean() < 0.9
    assert np.array_equal(_common(colors, own), wanted)
    assert _common(colors[:0], own).shape == (0,)
