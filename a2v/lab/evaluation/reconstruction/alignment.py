"""Align shapes rigidly, so that a rotation or a shift of the whole shape is not an error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.rays import RayScene, at_barycentric
from a2v.types import FloatArray, IntArray


def similar(source: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return rotation (3, 3), shift (3,) and scale factor that align `source` with `target` (N, 3).

    The aligned points are ``factor * source @ rotation.T + shift`` (Umeyama 1991).
    """
    rotation, _ = rigid(source, target)
    middle, aim = source.mean(axis=0), target.mean(axis=0)
    turned = (source - middle) @ rotation.T
    factor = float((turned * (target - aim)).sum() / (turned**2).sum())
    return rotation, aim - factor * rotation @ middle, factor


def rigid(source: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rotation (3, 3) and shift (3,) that align `source` with `target` (N, 3) by least
    squares (Kabsch 1976)."""
    middle, aim = source.mean(axis=0), target.mean(axis=0)
    left, _, right = np.linalg.svd((source - middle).T @ (target - aim))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation: FloatArray = (left @ flip @ right).T
    return rotation, aim - rotation @ middle


@dataclass(frozen=True, eq=False)
class Scan:
    """A surface and points on it.

    Attributes
    ----------
    rays : RayScene
    triangles : (F, 3, 3)
        Corners of its faces, meters.
    points : (N, 3)
        Uniform on it.
    """

    rays: RayScene
    triangles: FloatArray
    points: FloatArray

    @classmethod
    def of(cls, vertices: FloatArray, faces: IntArray, points: FloatArray) -> Scan:
        """The scan of a mesh, (V, 3) meters and (F, 3)."""
        return cls(RayScene(vertices, faces), np.asarray(vertices, np.float64)[faces], points)


def aligned_distances(
    own: Scan, truth: Scan, *, rounds: int = 20, count: int = 3000, sized: bool = False
) -> tuple[float, float]:
    """Chamfer distance and point to surface, meters, after the rigid motion that brings a surface
    nearest to the truth (ICP, both ways).

    Parameters
    ----------
    own, truth : Scan
        Near each other.
    rounds : int
        Rounds of the ICP.
    count : int
        Points per side in each round.
    sized : bool
        Scale the surface to the size of the truth, too. Then the ICP starts twice: at the
        surface's own place, and at the truth's centroid and spread. The nearer result counts.
    """
    rotation, shift, size = align(own, truth, rounds=rounds, count=count, sized=sized)
    forth = truth.rays.closest(
        np.asarray(size * own.points @ rotation.T + shift, np.float32)
    ).distance.mean()
    back = (
        size
        * own.rays.closest(
            np.asarray((truth.points - shift) @ rotation / size, np.float32)
        ).distance.mean()
    )
    return float(forth + back) / 2, float(forth)


def align(
    own: Scan, truth: Scan, *, rounds: int = 20, count: int = 3000, sized: bool = False
) -> tuple[FloatArray, FloatArray, float]:
    """The rotation (3, 3), the shift (3,) and the factor (1, if not `sized`) of
    `aligned_distances`."""
    mine = np.asarray(own.points[:: max(1, len(own.points) // count)], np.float64)
    theirs = np.asarray(truth.points[:: max(1, len(truth.points) // count)], np.float64)
    starts: list[tuple[FloatArray, FloatArray, float]] = [(np.eye(3), np.zeros(3), 1.0)]
    if sized:
        # ICP alone shrinks or grows a surface too slowly to reach the size of the truth
        middle, aim = own.points.mean(axis=0), truth.points.mean(axis=0)
        size = float(np.std(truth.points - aim) / np.std(own.points - middle))
        starts.append((np.eye(3), aim - size * middle, size))
    ends: list[tuple[FloatArray, FloatArray, float]] = []
    for rotation, shift, size in starts:
        for _ in range(rounds):
            pairs = _pairs(own, truth, mine, theirs, (rotation, shift, size))
            rotation, shift, size = similar(*pairs) if sized else (*rigid(*pairs), 1.0)
        ends.append((rotation, shift, size))
    if len(ends) == 1:
        return ends[0]
    return min(ends, key=lambda end: _residual(*_pairs(own, truth, mine, theirs, end), end))


def _pairs(
    own: Scan,
    truth: Scan,
    mine: FloatArray,
    theirs: FloatArray,
    placed: tuple[FloatArray, FloatArray, float],
) -> tuple[FloatArray, FloatArray]:
    """Return points of the surface in its own frame, and their closest partners of the truth, both
    ways, at the place `placed` (rotation, shift, size)."""
    rotation, shift, size = placed
    there = _closest(truth, size * mine @ rotation.T + shift)
    here = _closest(own, (theirs - shift) @ rotation / size)
    return np.concatenate([mine, here]), np.concatenate([there, theirs])


def _residual(
    source: FloatArray, target: FloatArray, placed: tuple[FloatArray, FloatArray, float]
) -> float:
    """Return the mean distance of pairs (N, 3) after the surface is placed, meters."""
    rotation, shift, size = placed
    return float(np.linalg.norm(size * source @ rotation.T + shift - target, axis=1).mean())


def _closest(scan: Scan, points: FloatArray) -> FloatArray:
    """Closest points (N, 3) of a scan's surface."""
    found = scan.rays.closest(points)
    return at_barycentric(scan.triangles[found.face], found.barycentric)
