"""Silhouettes: the mask as a distance field and a contour, the body as a raster and a rim."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import ray_scene
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera

if TYPE_CHECKING:
    import torch


@dataclass(frozen=True, eq=False)
class MaskField:
    """A person's mask prepared for fitting, at a working resolution.

    Attributes
    ----------
    distance : (h, w) float32
        Signed distance to the silhouette in photo pixels, positive outside; sampled at the working
        pixels' centers.
    step : float
        Photo pixels per working pixel.
    contour : (n, 2) float32
        Points u, v of the silhouette in photo pixels, except where the photo's border cuts the
        person.
    normals : (n, 2) float32
        Outward unit normals of `contour`.
    known : tuple of 4 float
        Left, top, right, bottom of the part of the image that the photo covers, pixels.
    inside : (h, w) bool
        The mask at the working resolution.
    """

    distance: FloatArray
    step: float
    contour: FloatArray
    normals: FloatArray
    known: tuple[float, float, float, float]
    inside: BoolArray

    def sample(self, pixels: torch.Tensor) -> torch.Tensor:
        """Signed distance (...,) at pixels (..., 2), bilinear, differentiable; zero outside of the
        photo."""
        import torch

        field = torch.from_numpy(self.distance).to(pixels)
        height, width = field.shape
        position = pixels / self.step - 0.5
        limit = torch.tensor([width - 1.0, height - 1.0], dtype=pixels.dtype) - 1e-4
        clamped = torch.minimum(position.clamp(min=0.0), limit)
        corner = clamped.detach().floor().long()
        fraction = clamped - corner
        u, v = corner[..., 0], corner[..., 1]
        fu, fv = fraction[..., 0], fraction[..., 1]
        value = (field[v, u] * (1 - fu) + field[v, u + 1] * fu) * (1 - fv) + (
            field[v + 1, u] * (1 - fu) + field[v + 1, u + 1] * fu
        ) * fv
        # Beyond the working grid the distance continues to grow. Without `abs`: its second
        # derivative makes PyTorch import its compiler (2 s).
        beyond = torch.relu(-position) + torch.relu(position - limit)
        value = value + beyond.sum(dim=-1) * self.step
        left, top, right, bottom = self.known
        seen = (
            (pixels[..., 0] > left)
            & (pixels[..., 0] < right)
            & (pixels[..., 1] > top)
            & (pixels[..., 1] < bottom)
        )
        return torch.where(seen, value, torch.zeros_like(value))


def mask_field(
    mask: FloatArray, known: tuple[float, float, float, float], *, size: int = 256
) -> MaskField:
    """Compute distance field and contour of a mask (H, W) in [0, 1].

    Parameters
    ----------
    known : tuple of 4 float
        Part of the image that the photo covers (left, top, right, bottom, pixels).
    size : int
        Longer side of the working raster.
    """
    import cv2
    from scipy.ndimage import distance_transform_edt

    height, width = mask.shape
    step = max(height, width) / size
    small = cv2.resize(
        mask.astype(np.float32),
        (max(2, round(width / step)), max(2, round(height / step))),
        interpolation=cv2.INTER_AREA,
    )
    inside = small > 0.5
    count, labels, stats, _ = cv2.connectedComponentsWithStats(inside.astype(np.uint8))
    if count > 1:  # specks do not belong to a body
        large = [
            label
            for label in range(1, count)
            if stats[label, cv2.CC_STAT_AREA] > 0.03 * stats[1:, cv2.CC_STAT_AREA].max()
        ]
        inside = np.isin(labels, large)
    if inside.all() or not inside.any():
        distance = np.zeros(inside.shape, np.float32)
        empty = np.zeros((0, 2), np.float32)
        return MaskField(distance, step, empty, empty, known, inside)
    distance = (distance_transform_edt(~inside) - distance_transform_edt(inside)).astype(np.float32)
    distance = np.where(distance > 0, distance - 0.5, distance + 0.5) * step
    found, _ = cv2.findContours(inside.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    gradient = np.stack(np.gradient(cv2.GaussianBlur(distance, (0, 0), 1.5)), axis=-1)
    points, normals = [], []
    for line in found:
        pixel = line[:, 0]
        if len(pixel) < 12:
            continue
        slope = gradient[pixel[:, 1], pixel[:, 0]][:, ::-1]
        length = np.linalg.norm(slope, axis=1, keepdims=True)
        normal = slope / np.maximum(length, 1e-6)
        # Centers of the last inside pixels; the edge is half a pixel farther out.
        points.append((pixel + 0.5 + 0.5 * normal) * step)
        normals.append(normal)
    contour = np.concatenate(points).astype(np.float32) if points else np.zeros((0, 2), np.float32)
    outward = (
        np.concatenate(normals).astype(np.float32) if normals else np.zeros((0, 2), np.float32)
    )
    left, top, right, bottom = known
    margin = 1.5 * step
    keep = (
        (contour[:, 0] > left + margin)
        & (contour[:, 0] < right - margin)
        & (contour[:, 1] > top + margin)
        & (contour[:, 1] < bottom - margin)
    )
    return MaskField(distance.astype(np.float32), step, contour[keep], outward[keep], known, inside)


def rasterize(
    vertices: FloatArray,
    faces: IntArray,
    camera: OrthographicCamera,
    shape: tuple[int, ...],
    *,
    step: float = 1.0,
) -> dict[str, Any]:
    """Cast one ray through every working pixel of an orthographic view (Embree by open3d).

    Parameters
    ----------
    vertices : (V, 3) float, meters
    faces : (F, 3) int
    camera : OrthographicCamera, in photo pixels
    shape : height and width of the raster
    step : float
        Photo pixels per pixel of the raster.

    Returns
    -------
    dict with `mask` (h, w) bool, `depth` (h, w) float32 z in meters (-inf outside), `face` (h, w)
    int64 (-1 outside), `barycentric` (h, w, 2) float32 open3d's u, v.
    """
    scene = ray_scene(vertices, faces)
    height, width = shape
    u, v = np.meshgrid((np.arange(width) + 0.5) * step, (np.arange(height) + 0.5) * step)
    far = float(vertices[:, 2].max()) + 1.0
    origin = camera.unproject(np.stack([u, v], axis=-1), far)
    rays = np.concatenate(
        [origin, np.broadcast_to([0.0, 0.0, -1.0], origin.shape)], axis=-1
    ).astype(np.float32)
    hits = scene.cast_rays(rays, nthreads=1)
    reach = hits["t_hit"].numpy()
    mask = np.isfinite(reach)
    return {
        "mask": mask,
        "depth": np.where(mask, far - reach, -np.inf).astype(np.float32),
        "face": np.where(mask, hits["primitive_ids"].numpy().astype(np.int64), -1),
        "barycentric": hits["primitive_uvs"].numpy(),
    }


_RIM_TURN = 0.3
"""Sine of the angle out of the image plane at which a vertex's normal counts for 1 / e as a normal
of the outline."""
_RIM_DEPTH = 2.5
"""Distance from the rendered mask's edge at which a vertex counts for one half as a part of the
outline, pixels of the raster."""
_NEIGHBORS = 12
"""Number of vertices of the rim that share a point of the contour."""
_SPREAD = 0.006
"""Standard deviation of this share, as a fraction of the person's height."""


def rim_vertices(
    vertices: FloatArray,
    faces: IntArray,
    camera: OrthographicCamera,
    raster: BoolArray,
    step: float,
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """Find the vertices on the outline of the body in the camera's view.

    A vertex belongs to the rim as far as its normal lies in the image and the edge of the rendered
    mask is near, so that rims in front of the body itself do not count. Both fade, so that a body
    that moves a little has nearly the same rim.

    Returns
    -------
    ids : (n,) int
    pixels : (n, 2) float
    normals : (n, 2) float
        Outward, in the image.
    weights : (n,) float
        From 0.05 to 1.
    """
    from scipy.ndimage import distance_transform_edt, map_coordinates

    normal = vertex_normals(vertices, faces)
    turned = np.exp(-((normal[:, 2] / _RIM_TURN) ** 2))
    near = np.flatnonzero(turned > 0.05)
    pixels = camera.project(vertices[near])
    # No rim where the frame cuts the body.
    padded = np.pad(raster, 1)
    inside = distance_transform_edt(padded) - distance_transform_edt(~padded)
    place = (pixels / step + 0.5)[:, ::-1].T
    depth = map_coordinates(inside, place, order=1, mode="constant", cval=1e3)
    weights = turned[near] / (1 + (depth / _RIM_DEPTH) ** 4)
    height, width = raster.shape
    in_frame = (pixels >= 0).all(axis=1) & (pixels < np.array([width, height]) * step).all(axis=1)
    kept = in_frame & (weights > 0.05)
    flat = normal[near[kept], :2] * [1.0, -1.0]
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    return near[kept], pixels[kept], flat, weights[kept]


@dataclass(frozen=True, eq=False)
class RimMatches:
    """Points of a mask's contour, each matched to a weighted mean of vertices of the body's rim.

    Attributes
    ----------
    vertex_ids : (m,) int64
    chosen : (n, k) int64
        Entries of `vertex_ids` that belong to each point.
    shares : (n, k) float64
        Their shares; each row sums to one.
    weights : (n,) float64
        Trust in each match.
    pixels, normals : (n, 2) float64
        Points of the contour, and its outward normals in the image.
    """

    vertex_ids: torch.Tensor
    chosen: torch.Tensor
    shares: torch.Tensor
    weights: torch.Tensor
    pixels: torch.Tensor
    normals: torch.Tensor

    def matched(self, pixels: torch.Tensor) -> torch.Tensor:
        """Return the matched points (n, 2) for the rim's vertices at `pixels` (m, 2)."""
        return (self.shares[..., None] * pixels[self.chosen]).sum(-2)


def match_rim(
    mask: MaskField,
    vertices: FloatArray,
    faces: IntArray,
    camera: OrthographicCamera,
    *,
    height: float,
) -> RimMatches | None:
    """Match points of the mask's contour to the rim of a body (V, 3); None for fewer than ten
    matches.

    `height` is the person's, in pixels: matches are nearer than about 12 % of it (chosen by hand).
    Shares and weights are smooth functions of the body, so that rounds of matching converge.
    """
    import torch
    from scipy.spatial import cKDTree
    from scipy.special import expit

    raster = rasterize(vertices, faces, camera, mask.inside.shape, step=mask.step)["mask"]
    ids, pixels, normals, rim = rim_vertices(vertices, faces, camera, raster, mask.step)
    if len(ids) < max(10, _NEIGHBORS):
        return None
    every = max(1, len(mask.contour) // 350)
    contour, outward = mask.contour[::every], mask.normals[::every]
    # Direction counts as much as position: a contour that faces left belongs to a left rim.
    reach = 0.06 * height
    tree = cKDTree(np.concatenate([pixels, reach * normals], axis=1))
    gaps, chosen = tree.query(np.concatenate([contour, reach * outward], axis=1), k=_NEIGHBORS)
    nearer = gaps**2 - gaps[:, :1] ** 2
    shares = rim[chosen] * np.exp(-nearer / (2 * (_SPREAD * height) ** 2))
    shares /= shares.sum(axis=1, keepdims=True)
    along = ((shares[..., None] * normals[chosen]).sum(axis=1) * outward).sum(axis=1)
    away = np.linalg.norm((shares[..., None] * pixels[chosen]).sum(axis=1) - contour, axis=1)
    weights = expit((along - 0.3) / 0.05) * expit((0.12 - away / height) / 0.01)
    if weights.sum() < 10:
        return None
    return RimMatches(
        vertex_ids=torch.from_numpy(ids),
        chosen=torch.from_numpy(chosen),
        shares=torch.from_numpy(shares),
        weights=torch.from_numpy(weights),
        pixels=torch.from_numpy(contour.astype(np.float64)),
        normals=torch.from_numpy(outward.astype(np.float64)),
    )
