"""A surface as evidence for a body: its samples, their matches on the body (Eq. 17), the joints
inside of it (Eq. 16)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.evidence import Evidence
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import ray_scene
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


@dataclass(frozen=True, eq=False)
class SurfaceSamples:
    """Samples of a surface.

    Attributes
    ----------
    points, normals : (n, 3) float64
        Evenly spread over the surface.
    targets : (33, 3) float64, target_weights : (33,) float64
        Joints inverse-projected into the surface; weight 0 if unknown.
    """

    points: FloatArray
    normals: FloatArray
    targets: FloatArray
    target_weights: FloatArray

    @classmethod
    def build(
        cls,
        surface: Surface,
        camera: PhotoCamera,
        evidence: Evidence,
        *,
        seed: int = 0,
        count: int = 1500,
    ) -> SurfaceSamples:
        """Sample a surface (in the frame of `camera`) and put the keypoints inside of it."""
        corner = surface.vertices[surface.faces].astype(np.float64)
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        length = np.linalg.norm(normal, axis=1)
        rng = np.random.default_rng(seed)
        face = rng.choice(len(corner), size=count, p=length / length.sum())
        bary = rng.dirichlet(np.ones(3), size=count)
        targets, weights = _joints_inside(surface, camera, evidence)
        return cls(
            points=(bary[:, :, None] * corner[face]).sum(axis=1),
            normals=normal[face] / np.maximum(length[face, None], 1e-12),
            targets=targets,
            target_weights=weights,
        )

    def mean_distance(self, vertices: FloatArray, faces: IntArray) -> float:
        """Mean distance in meters from the samples to the body's surface."""
        scene = ray_scene(vertices, faces)
        return float(
            scene.compute_distance(self.points.astype(np.float32), nthreads=1).numpy().mean()
        )


@dataclass(frozen=True, eq=False)
class SurfaceMatches:
    """Vertices of the body and the samples of the surface that belong to them.

    Attributes
    ----------
    vertex_ids : (n,) int64
    points, normals : (n, 3) float64
        Of the surface.
    weights : (n,) float64
        Trust in each match: a smooth function of the body, so that rounds of matching converge.
    """

    vertex_ids: torch.Tensor
    points: torch.Tensor
    normals: torch.Tensor
    weights: torch.Tensor


def match_surface(
    samples: SurfaceSamples, vertices: FloatArray, faces: IntArray
) -> SurfaceMatches | None:
    """Return the nearest neighbors of a surface and a body (V, 3) in both directions, with agreeing
    normals.

    None if hardly any agree.
    """
    import torch
    from scipy.spatial import cKDTree
    from scipy.special import expit

    normals = vertex_normals(vertices, faces)
    rng = np.random.default_rng(0)
    outer = np.flatnonzero(np.linalg.norm(normals, axis=1) > 0)
    # Direction counts: the front of an arm must not match the chest behind it.
    reach = 0.05
    body = cKDTree(np.concatenate([vertices[outer], reach * normals[outer]], axis=1))
    _, nearest = body.query(np.concatenate([samples.points, reach * samples.normals], axis=1))
    to_body = outer[nearest]
    some = rng.choice(outer, size=min(len(outer), len(samples.points)), replace=False)
    tree = cKDTree(np.concatenate([samples.points, reach * samples.normals], axis=1))
    _, back = tree.query(np.concatenate([vertices[some], reach * normals[some]], axis=1))
    ids = np.concatenate([to_body, some])
    points = np.concatenate([samples.points, samples.points[back]])
    outward = np.concatenate([samples.normals, samples.normals[back]])
    agree = expit(((normals[ids] * outward).sum(axis=1) - 0.2) / 0.05)
    weights = agree * expit((0.25 - np.linalg.norm(vertices[ids] - points, axis=1)) / 0.02)
    if weights.sum() <= 20:
        return None
    return SurfaceMatches(
        torch.from_numpy(ids),
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
