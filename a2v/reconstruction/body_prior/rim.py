"""Pull the rim of the body's skin to the contour of the mask by smooth deformations of the whole
skin."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.body.parts import PARTS, on_parts
from a2v.geometry.mesh import factored, vertex_normals
from a2v.geometry.volume import Grid
from a2v.reconstruction.body_prior.columns import binary_distance, front_seen, sample_columns
from a2v.reconstruction.body_prior.settings import SurfaceSettings
from a2v.types import FloatArray, IntArray

EVERYWHERE = 10.0
"""Length over which a field on the skin fades out that is known everywhere, meters."""


class SkinDeformer:
    """Smooth fields on the skin by screened diffusion with cotangent weights.

    The fields are harmonic rather than bi-Laplacian: a displacement never exceeds the constraints
    around it. So the face cannot overshoot if both ears are pulled to the hair's contour. A second,
    short diffusion removes kinks.
    """

    def __init__(self, vertices: FloatArray, faces: IntArray) -> None:
        import scipy.sparse as sp

        self.faces = faces
        count = len(vertices)
        corners = vertices[faces]
        rows, columns, values = [], [], []
        for corner in range(3):
            a, b = (
                corners[:, (corner + 1) % 3] - corners[:, corner],
                corners[:, (corner + 2) % 3] - corners[:, corner],
            )
            sine = np.maximum(np.linalg.norm(np.cross(a, b), axis=1), 1e-12)
            # negative cotangents (obtuse slivers) would break the maximum principle
            values.append(np.clip((a * b).sum(axis=1) / sine, 0.01, 20.0) / 2)
            rows.append(faces[:, (corner + 1) % 3])
            columns.append(faces[:, (corner + 2) % 3])
        row, column, value = np.concatenate(rows), np.concatenate(columns), np.concatenate(values)
        adjacency = sp.csr_matrix((value, (row, column)), (count, count))
        adjacency = adjacency + adjacency.T
        self._stiffness = (sp.diags(np.asarray(adjacency.sum(axis=1)).ravel()) - adjacency).tocsc()
        area = (
            np.linalg.norm(
                np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
            )
            / 6
        )
        self._mass = np.maximum(
            np.bincount(faces.ravel(), np.repeat(area, 3), minlength=count), 1e-9
        )
        self._diffusion: dict[float, Any] = {}
        self._everywhere: dict[float, Any] = {}

    def spread(
        self, weight: FloatArray, target: FloatArray, *, near: float, fade: FloatArray
    ) -> FloatArray:
        """Return a smooth field (V, k) near `target` (V, k), weighted by `weight` (V,) in [0, 1].

        It follows the constraints over lengths of `near` meters and fades out over `fade` (V,)
        meters.
        """
        import scipy.sparse as sp

        pull = weight * self._mass / near**2
        rough = factored(self._stiffness + sp.diags(pull + self._mass / fade**2)).solve(
            pull[:, None] * target
        )
        return self._diffused(rough, near)

    def smoothed(self, target: FloatArray, *, near: float) -> FloatArray:
        """Return `target` (V, k) smoothed over lengths of `near` meters: `spread` with weight 1 and
        a fade of `EVERYWHERE`, factored once for each `near`."""
        import scipy.sparse as sp

        pull = self._mass / near**2
        if near not in self._everywhere:
            self._everywhere[near] = factored(
                self._stiffness + sp.diags(pull + self._mass / EVERYWHERE**2)
            )
        return self._diffused(self._everywhere[near].solve(pull[:, None] * target), near)

    def _diffused(self, rough: FloatArray, near: float) -> FloatArray:
        """Diffuse a field (V, k) once more over `near` meters, which removes its kinks."""
        import scipy.sparse as sp

        if near not in self._diffusion:
            self._diffusion[near] = factored(sp.diags(self._mass) + near**2 * self._stiffness)
        return np.asarray(self._diffusion[near].solve(self._mass[:, None] * rough))


def pull_to_contour(
    skin: FloatArray,
    parts: IntArray,
    grid: Grid,
    mask_distance: FloatArray,
    deformer: SkinDeformer,
    settings: SurfaceSettings,
    turn: int,
) -> FloatArray:
    """Do one round: move vertices (V, 3) of the skin so that its rim comes nearer to the mask's
    contour.

    Loose cloth is also moved away from the body in depth. `parts` (V,) are `a2v.body.PARTS`,
    `mask_distance` (nx, ny) is of the grid's columns, `turn` counts the rounds from 0.
    """
    faces = deformer.faces
    own = binary_distance(np.isfinite(front_seen(skin, faces, grid)), grid.cell)
    slope_own = np.stack(np.gradient(own, grid.cell), axis=-1).astype(np.float32)
    slope_mask = np.stack(np.gradient(mask_distance, grid.cell), axis=-1).astype(np.float32)
    inset = sample_columns(own, skin, grid)
    at_rim = np.abs(inset) < 1.5 * grid.cell
    # a vertex slightly inside the rim keeps that distance; otherwise each round would flatten the
    # flanks
    gap = sample_columns(mask_distance, skin, grid) - inset
    to_mask = np.stack(
        [sample_columns(np.ascontiguousarray(slope_mask[..., i]), skin, grid) for i in (0, 1)],
        axis=1,
    )
    to_mask /= np.maximum(np.linalg.norm(to_mask, axis=1, keepdims=True), 1e-6)
    outward = np.stack(
        [sample_columns(np.ascontiguousarray(slope_own[..., i]), skin, grid) for i in (0, 1)],
        axis=1,
    )
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-6)
    agreement = (to_mask * outward).sum(axis=1)
    move = -gap[:, None] * to_mask
    part = np.array(PARTS, dtype=object)[parts]
    stiff = np.isin(part, ["left_hand", "right_hand", "left_foot", "right_foot"])
    reach = np.where(stiff, 0.5, np.where(part == "head", 0.4, 1.0)) * settings.reach
    good = at_rim & (agreement > 0.4) & (np.abs(gap) < reach)
    weight = np.where(good, agreement, 0.0) * np.where(stiff, 0.3, 1.0)
    normals = vertex_normals(skin, faces)
    head = part == "head"
    # the face keeps its shape: the contour around it is hair as often as skin
    fade = np.where(head & (normals[:, 2] > 0.35), 0.04, np.where(head, 0.2, 0.25))
    near = 0.02 if turn < settings.rounds // 2 else 0.01
    flat = deformer.spread(weight, move, near=near, fade=fade)
    # Loose cloth stands off all around the limb: the push along the rim's outward direction becomes
    # a push along the normals in depth.
    push = deformer.spread(
        weight, (move * outward).sum(axis=1)[:, None], near=0.03, fade=np.minimum(fade, 0.12)
    )[:, 0]
    share = (
        np.where(head, np.where(normals[:, 2] > 0, 0.0, 0.8), np.where(stiff, 0.3, 1.0))
        * settings.depth
    )
    share = deformer.smoothed(share[:, None], near=0.03)[:, 0]
    result = skin.copy()
    result[:, :2] += np.clip(flat, -settings.reach, settings.reach)
    result[:, 2] += np.clip(push, -0.02, 0.05) * share * normals[:, 2]
    return result


def drape(
    skin: FloatArray, faces: IntArray, parts: IntArray, deformer: SkinDeformer, bare: FloatArray
) -> FloatArray:
    """Smooth the forms of the body where cloth was pushed away from it: a loose jacket shows no
    navel."""
    covered = on_parts(
        parts, "torso", "left_thigh", "right_thigh", "left_upper_arm", "right_upper_arm"
    )
    normals = vertex_normals(bare, faces)
    stand_off = np.clip(((skin - bare) * normals).sum(axis=1), 0, None)
    every = np.full(len(skin), EVERYWHERE)
    # mean of the stand-off around the limb, not only of the rim
    loose: FloatArray = deformer.spread(
        np.where(covered, 1.0, 0.2), stand_off[:, None], near=0.06, fade=every
    )[:, 0]
    loose = np.where(covered, np.clip(loose / 0.012, 0, 1), 0.0)
    share = deformer.smoothed(loose[:, None], near=0.03)[:, 0]
    smooth = deformer.smoothed(skin - bare.mean(axis=0), near=0.035) + bare.mean(axis=0)
    # the rim stays at the photo's contour
    change = (smooth - skin) * share[:, None]
    change[:, :2] = 0.0
    return np.asarray(skin + change)
