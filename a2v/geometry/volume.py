"""A signed distance grid of a posed body, robust to self-intersections from posing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.rays import ray_scene
from a2v.types import BoolArray, FloatArray, IntArray

EXACT = 3
"""Signed distances are exact within this number of cells from the surface."""


@dataclass(frozen=True)
class Grid:
    """A regular grid: node (i, j, k) lies at ``origin + cell * (i, j, k)``, axes x, y, z,
    meters."""

    origin: FloatArray
    cell: float
    shape: tuple[int, int, int]

    def axis(self, axis: int) -> FloatArray:
        """Coordinates of the nodes along one axis, meters."""
        return np.asarray(self.origin[axis] + self.cell * np.arange(self.shape[axis]))


def winding_inside(vertices: FloatArray, faces: IntArray, grid: Grid) -> BoolArray:
    """Return whether each node lies inside the closed mesh: its winding number is not zero.

    The winding number is counted from signed crossings along z. Parity would make the overlap of
    two limbs outside; the winding number is 2 there. Enclosed hollows are filled.
    """
    from scipy.ndimage import binary_fill_holes

    nx, ny, nz = grid.shape
    # a ray exactly through an edge counts both triangles, so rays are moved off the lattice
    jitter = np.array([1.7e-5, 2.3e-5])
    x, y = np.meshgrid(grid.axis(0) + jitter[0], grid.axis(1) + jitter[1], indexing="ij")
    rays = np.zeros((nx, ny, 6), np.float32)
    rays[..., 0], rays[..., 1] = x, y
    bottom = float(grid.origin[2]) - 1.0
    rays[..., 2], rays[..., 5] = bottom, 1.0
    hits = ray_scene(vertices, faces, threads=0).list_intersections(rays.reshape(-1, 6))
    ray = hits["ray_ids"].numpy().astype(np.int64)
    z = hits["t_hit"].numpy() + bottom
    face = hits["primitive_ids"].numpy().astype(np.int64)
    corners = vertices[faces[face]].astype(np.float64)
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    # Embree may report one crossing twice where two triangles meet
    step = np.where(up < 0, 1, -1)  # upward through a face that looks down: the ray enters
    node = np.clip(np.ceil((z - grid.origin[2]) / grid.cell), 0, nz).astype(np.int64)
    crossings = (
        np.bincount(ray * (nz + 1) + node, weights=step, minlength=nx * ny * (nz + 1))
        .astype(np.int8)
        .reshape(nx, ny, nz + 1)
    )
    winding = np.cumsum(crossings, axis=2, dtype=np.int8)
    broken = winding[..., -1] != 0  # a ray along a crack: use its neighbors
    inside = winding[..., :nz] > 0
    if broken.any():
        for i, j in np.argwhere(broken):
            near = inside[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2][
                ~broken[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2]
            ]
            inside[i, j] = near.mean(axis=0) > 0.5 if len(near) else False
    return np.asarray(binary_fill_holes(inside))


def signed_distance(
    vertices: FloatArray, faces: IntArray, grid: Grid, *, band: int = 3
) -> FloatArray:
    """Return the signed distance (nx, ny, nz) float32, meters, negative inside; constant beyond
    `band` cells from the surface.

    Within `EXACT` cells it is exact; farther away it is interpolated from every second node.
    """
    inside = winding_inside(vertices, faces, grid)
    limit = np.float32(band * grid.cell)
    far = _from_coarser(vertices, faces, grid, band) if band > EXACT else limit
    field = np.where(inside, -far, far).astype(np.float32)
    reach = min(band, EXACT)
    near = _spread(inside, reach) & _spread(~inside, reach, border=True)
    nodes = np.argwhere(near)
    points = (grid.origin + grid.cell * nodes).astype(np.float32)
    distance = ray_scene(vertices, faces, threads=0).compute_distance(points).numpy()
    distance = np.minimum(distance, limit)
    where = tuple(nodes.T)
    field[where] = np.where(inside[where], -distance, distance)
    return field


def _spread(chosen: BoolArray, reach: int, *, border: bool = False) -> BoolArray:
    """Return which nodes (nx, ny, nz) have a `chosen` one within `reach` nodes along each axis.

    `border` says whether nodes outside of the grid are chosen.
    """
    for axis in range(3):
        before = np.moveaxis(chosen, axis, 0)
        chosen = chosen.copy()
        after = np.moveaxis(chosen, axis, 0)
        for step in range(1, reach + 1):
            after[step:] |= before[:-step]
            after[:-step] |= before[step:]
        if border:
            after[:reach] = after[-reach:] = True
    return chosen


def _from_coarser(vertices: FloatArray, faces: IntArray, grid: Grid, band: int) -> FloatArray:
    """Return the distance (nx, ny, nz), meters, at nodes between `EXACT` and `band` cells from the
    surface, interpolated from a grid of cells twice as large."""
    shape = (grid.shape[0] // 2 + 2, grid.shape[1] // 2 + 2, grid.shape[2] // 2 + 2)
    fine = np.abs(
        signed_distance(
            vertices, faces, Grid(grid.origin, 2 * grid.cell, shape), band=(band + 1) // 2
        )
    )
    for axis in range(3):
        fine = np.moveaxis(fine, axis, 0)
        between = (fine[1:] + fine[:-1]) / 2
        fine = np.stack([fine[:-1], between], axis=1).reshape(-1, *fine.shape[1:])[
            : grid.shape[axis]
        ]
        fine = np.moveaxis(fine, 0, axis)
    return np.clip(fine, np.float32(EXACT * grid.cell), np.float32(band * grid.cell))
