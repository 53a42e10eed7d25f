"""Rigid alignment, so that a shape counts that is only turned or moved."""

from __future__ import annotations

import numpy as np

from a2v.geometry.rays import RayScene
from a2v.types import FloatArray, IntArray


def rigid(source: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation (3, 3) and shift (3,) that bring points (N, 3) nearest to others in the sense of least squares (Kabsch 1976)."""
    middle, aim = source.mean(axis=0), target.mean(axis=0)
    left, _, right = np.linalg.svd((source - middle).T @ (target - aim))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation: FloatArray = (left @ flip @ right).T
    return rotation, aim - rotation @ middle


def aligned_distances(
    vertices: FloatArray,
    faces: IntArray,
    points: FloatArray,
    truth: RayScene,
    true_triangles: FloatArray,
    true_points: FloatArray,
    *,
    rounds: int = 20,
    count: int = 3000,
) -> tuple[float, float]:
    """Chamfer distance and point to surface, metres, after the rigid motion that brings a surface nearest to the truth (ICP, both ways).

    Parameters
    ----------
    vertices, faces
        The surface, (V, 3) metres and (F, 3), near the truth.
    points : (N, 3)
        Uniform on it.
    truth : RayScene
        Of the true faces, whose corners are `true_triangles` (G, 3, 3).
    true_points : (M, 3)
        Uniform on them.
    rounds, count : int
        Of the ICP, and points a side in each.
    """
    own = RayScene(vertices, faces)
    triangles = np.asarray(vertices, np.float64)[faces]
    mine = np.asarray(points[:: max(1, len(points) // count)], np.float64)
    theirs = np.asarray(true_points[:: max(1, len(true_points) // count)], np.float64)
    rotation, shift = np.eye(3), np.zeros(3)
    for _ in range(rounds):
        moved = mine @ rotation.T + shift
        there = _closest(truth, true_triangles, moved)
        here = _closest(own, triangles, (theirs - shift) @ rotation)  # in the surface's own frame
        rotation, shift = rigid(np.concatenate([mine, here]), np.concatenate([there, theirs]))
    forth = truth.closest(np.asarray(points @ rotation.T + shift, np.float32)).distance.mean()
    back = own.closest(np.asarray((true_points - shift) @ rotation, np.float32)).distance.mean()
    return float(forth + back) / 2, float(forth)


def _closest(scene: RayScene, triangles: FloatArray, points: FloatArray) -> FloatArray:
    """Closest points (N, 3) of a mesh whose faces have the corners `triangles` (F, 3, 3)."""
    found = scene.closest(points)
    u, v = found.barycentric[:, :1], found.barycentric[:, 1:]
    corner = triangles[found.face]
    closest: FloatArray = (1 - u - v) * corner[:, 0] + u * corner[:, 1] + v * corner[:, 2]
    return closest
