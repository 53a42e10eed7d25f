from __future__ import annotations

import numpy as np
import pytest
import trimesh

from a2v.geometry.mesh import vertex_normals
from a2v.reconstruction.relief import follow_normals

SPHERE = trimesh.creation.icosphere(subdivisions=4, radius=0.2)


def dented(sphere: np.ndarray) -> np.ndarray:
    """The sphere with dents of 3 mm and waves of some centimeters, as a field's cells leave."""
    return sphere * (1 + 0.015 * np.sin(80 * sphere[:, :1]) * np.sin(80 * sphere[:, 1:2]))


def test_true_normals_take_the_waves_away() -> None:
    true = np.asarray(SPHERE.vertices)
    outward = true / np.linalg.norm(true, axis=1, keepdims=True)
    start = dented(true)
    placed = follow_normals(start, SPHERE.faces, outward, np.ones(len(true)), stiffness=0.1)

    def wrong(vertices: np.ndarray) -> tuple[float, float]:
        cosine = (vertex_normals(vertices, SPHERE.faces) * outward).sum(axis=1)
        return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean()), float(
            np.linalg.norm(vertices - true, axis=1).mean()
        )

    before, after = wrong(start), wrong(placed)
    assert after[0] < 0.25 * before[0]
    assert after[1] < 0.4 * before[1]


def test_what_is_not_trusted_stays() -> None:
    true = np.asarray(SPHERE.vertices)
    start = dented(true)
    trust = (true[:, 1] > 0).astype(float)
    placed = follow_normals(start, SPHERE.faces, true / 0.2, trust)
    moved = np.linalg.norm(placed - start, axis=1)
    assert moved[true[:, 1] < -0.02].max() < 1e-4
    assert moved[true[:, 1] > 0.05].mean() > 1e-3


def test_no_vertex_moves_too_far() -> None:
    true = np.asarray(SPHERE.vertices)
    tilted = true / 0.2 + [0.8, 0, 0]
    placed = follow_normals(
        true,
        SPHERE.faces,
        tilted / np.linalg.norm(tilted, axis=1, keepdims=True),
        np.ones(len(true)),
        stiffness=1e-3,
        largest=0.004,
    )
    assert np.linalg.norm(placed - true, axis=1).max() == pytest.approx(0.004, abs=1e-6)
