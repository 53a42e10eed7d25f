"""A surface as evidence for a body: its samples, their matches on the body (Eq. 17), the joints
inside of it (Eq. 16)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.evidence import Evidence
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.neighbors import shares_around
from a2v.geometry.rays import ray_scene
from a2v.geometry.vectors import unit
from a2v.kinematics.names import BLAZEPOSE
from a2v.types import FloatArray, IntArray, PhotoCamera, Surface

if TYPE_CHECKING:
    import torch

# Landmarks inside of the flesh: their depth is the middle of the limb that the ray passes.
_INSIDE = tuple(
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)

_CELL = 0.05
"""Size of a cell of the grid of samples, meters: about 1,000 samples of a person."""
_VERTICES = 800
"""Number of the body's vertices that are matched to the surface."""


@dataclass(frozen=True, eq=False)
class SurfaceSamples:
    """Samples of a surface, one for each cell of a grid in space and octant of the normal.

    They follow from the surface's shape and hardly from its triangles: another triangulation of the
    same surface has nearly the same samples.

    Attributes
    ----------
    points, normals : (n, 3) float64
    areas : (n,) float64
        Share of the surface that each stands for; they sum to one.
    targets : (33, 3) float64, target_weights : (33,) float64
        Joints inverse-projected into the surface; weight 0 if unknown.
    """

    points: FloatArray
    normals: FloatArray
    areas: FloatArray
    targets: FloatArray
    target_weights: FloatArray

    @classmethod
    def build(
        cls,
        surface: Surface,
        camera: PhotoCamera,
        evidence: Evidence,
    ) -> SurfaceSamples:
        """Sample a surface (in the frame of `camera`) and put the keypoints inside of it."""
        corner = surface.vertices[surface.faces].astype(np.float64)
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2
        area, middle = np.linalg.norm(normal, axis=1), corner.mean(axis=1)
        cells = np.concatenate([np.floor(middle / _CELL), normal > 0], axis=1).astype(np.int64)
        _, cell = np.unique(cells, axis=0, return_inverse=True)
        areas = np.bincount(cell.ravel(), area)

        def summed(values: FloatArray) -> FloatArray:
            return np.stack([np.bincount(cell.ravel(), values[:, k]) for k in range(3)], axis=1)

        centers = summed(area[:, None] * middle) / np.maximum(areas[:, None], 1e-12)
        scene = ray_scene(surface.vertices, surface.faces)
        found = scene.compute_closest_points(centers.astype(np.float32), nthreads=1)
        targets, weights = _joints_inside(surface, camera, evidence)
        return cls(
            points=found["points"].numpy().astype(np.float64),
            normals=unit(summed(normal), least=1e-12),
            areas=areas / areas.sum(),
            targets=targets,
            target_weights=weights,
        )

    def mean_distance(self, vertices: FloatArray, faces: IntArray) -> float:
        """Mean distance in meters from the samples to the body's surface."""
        scene = ray_scene(vertices, faces)
        away = scene.compute_distance(self.points.astype(np.float32), nthreads=1).numpy()
        return float((self.areas * away).sum())


@dataclass(frozen=True, eq=False)
class SurfaceMatches:
    """Points of the body, and points of the surface that belong to them.

    Attributes
    ----------
    vertex_ids : (m,) int64
    chosen : (n, k) int64
        Entries of `vertex_ids` around each point of the body.
    shares : (n, k) float64
        Their shares of the point; each row sums to one.
    points, normals : (n, 3) float64
        Of the surface.
    weights : (n,) float64
        Trust in each match: a smooth function of the body, so that rounds of matching converge.
    """

    vertex_ids: torch.Tensor
    chosen: torch.Tensor
    shares: torch.Tensor
    points: torch.Tensor
    normals: torch.Tensor
    weights: torch.Tensor

    def matched(self, vertices: torch.Tensor) -> torch.Tensor:
        """Return the points (n, 3) of a body whose `vertex_ids` are at `vertices` (m, 3)."""
        return (self.shares[..., None] * vertices[self.chosen]).sum(-2)


def match_surface(
    samples: SurfaceSamples, vertices: FloatArray, faces: IntArray
) -> SurfaceMatches | None:
    """Return the nearest neighbors of a surface and a body (V, 3) in both directions, with agreeing
    normals.

    None if hardly any agree.
    """
    import torch
    from scipy.special import expit

    normals = vertex_normals(vertices, faces)
    outer = np.flatnonzero(np.linalg.norm(normals, axis=1) > 0)
    some = np.random.default_rng(0).choice(outer, size=min(len(outer), _VERTICES), replace=False)
    # Direction counts: the front of an arm must not match the chest behind it.
    reach = 0.05
    body = np.concatenate([vertices, reach * normals], axis=1)
    surface = np.concatenate([samples.points, reach * samples.normals], axis=1)
    nearest, shares = shares_around(body[outer], surface)
    back, parts = shares_around(surface, body[some])
    ids = np.concatenate([outer[nearest], np.repeat(some[:, None], nearest.shape[1], axis=1)])
    shares = np.concatenate([shares, np.full((len(some), nearest.shape[1]), 1 / nearest.shape[1])])
    points = np.concatenate([samples.points, (parts[..., None] * samples.points[back]).sum(1)])
    outward = np.concatenate(
        [samples.normals, unit((parts[..., None] * samples.normals[back]).sum(1))]
    )
    agree = ((shares[..., None] * normals[ids]).sum(axis=1) * outward).sum(axis=1)
    away = np.linalg.norm((shares[..., None] * vertices[ids]).sum(axis=1) - points, axis=1)
    weights = expit((agree - 0.2) / 0.05) * expit((0.25 - away) / 0.02)
    weights *= np.concatenate([samples.areas, np.full(len(some), 1 / len(some))])
    if weights.sum() < 0.02:
        return None
    used, chosen = np.unique(ids, return_inverse=True)
    return SurfaceMatches(
        vertex_ids=torch.from_numpy(used),
        chosen=torch.from_numpy(chosen.reshape(ids.shape)),
        shares=torch.from_numpy(shares),
        points=torch.from_numpy(points),
        normals=torch.from_numpy(outward),
        weights=torch.from_numpy(weights),
    )


def _joints_inside(
    surface: Surface, camera: PhotoCamera, evidence: Evidence
) -> tuple[FloatArray, FloatArray]:
    """Inverse projection of the 2D joints: the middle of the first stretch of flesh behind each
    keypoint."""
    flat = camera.flatten(surface.vertices)  # depths do not change
    scene = ray_scene(flat, surface.faces)
    far = float(flat[:, 2].max()) + 1.0
    origin = camera.flat.unproject(evidence.pixels, far)
    rays = np.concatenate([origin, np.broadcast_to([0.0, 0.0, -1.0], origin.shape)], axis=1).astype(
        np.float32
    )
    hits = scene.list_intersections(rays, nthreads=1)
    ray, reach = hits["ray_ids"].numpy(), hits["t_hit"].numpy()
    targets, weights = np.zeros((len(BLAZEPOSE), 3)), np.zeros(len(BLAZEPOSE))
    for index, name in enumerate(BLAZEPOSE):
        depths = np.sort(reach[ray == index])
        if name in _INSIDE and evidence.confidence[index] > 0.3 and len(depths) >= 2:
            targets[index] = origin[index] - [0.0, 0.0, (depths[0] + depths[1]) / 2]
            weights[index] = evidence.confidence[index]
    return targets, weights
