"""Corrections of the signed distance grid beyond the body: closed mouths and shoes, gaps under the
arms, hair, skirts and bags."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS, on_parts
from a2v.geometry.images import nearest_known
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.volume import Grid
from a2v.reconstruction.body_prior.cloth import LegColumns, span_legs
from a2v.reconstruction.body_prior.columns import columns_seen
from a2v.reconstruction.body_prior.settings import SurfaceSettings
from a2v.system import thread_count
from a2v.types import BoolArray, FloatArray, IntArray

_STEP = 0.02
"""Limbs side by side are one piece if their middles differ in depth by less than about twice this,
meters."""


def close_head(field: FloatArray, skin: FloatArray, parts: IntArray, grid: Grid) -> FloatArray:
    """Fill the cavity of the mouth: the space that closed lips would enclose, at least two cells
    below the skin.

    Creases of the skin remain.
    """
    from scipy.ndimage import binary_dilation, binary_erosion, binary_fill_holes

    head = skin[parts == 0]
    if len(head) == 0:
        return field
    low = np.clip(((head.min(axis=0) - grid.origin) / grid.cell).astype(int) - 6, 0, None)
    high = ((head.max(axis=0) - grid.origin) / grid.cell).astype(int) + 7
    box = tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
    solid = field[box] < 0
    cavity = (
        binary_erosion(binary_fill_holes(binary_dilation(solid)), iterations=3, border_value=1)
        & ~solid
    )
    field[box] = np.where(cavity, np.float32(-grid.cell), field[box])
    return field


def close_toes(field: FloatArray, skin: FloatArray, parts: IntArray, grid: Grid) -> FloatArray:
    """Fill the gaps between the toes by a morphological closing of two cells: most people are
    photographed in shoes."""
    from scipy.ndimage import binary_closing

    ball = np.linalg.norm(np.indices((5, 5, 5)) - 2.0, axis=0) < 2.5
    for name in ("left_foot", "right_foot"):
        foot = skin[parts == PARTS.index(name)]
        if len(foot) == 0:
            continue
        ahead = foot[:, 2] > foot[:, 2].min() + 0.5 * np.ptp(foot[:, 2])
        low = np.clip(
            ((foot[ahead].min(axis=0) - grid.origin) / grid.cell).astype(int) - 4, 0, None
        )
        high = ((foot[ahead].max(axis=0) - grid.origin) / grid.cell).astype(int) + 5
        box = tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
        solid = field[box] < 0
        gaps = binary_closing(np.pad(solid, 3), ball)[3:-3, 3:-3, 3:-3] & ~solid
        field[box] = np.where(gaps, np.float32(-0.5 * grid.cell), field[box])
    return field


def part_arms(
    field: FloatArray, bare: FloatArray, faces: IntArray, parts: IntArray, grid: Grid
) -> FloatArray:
    """Carve a gap of two cells where a sleeve has fused with the trunk, or a raised arm would span
    a web of cloth.

    The gap runs half-way between the bare arm and the bare trunk, outside of both. Near the armhole
    it is carved only where the two face each other.
    """
    from scipy.spatial import cKDTree

    normals = vertex_normals(bare, faces)
    trunk = np.nonzero(on_parts(parts, "torso", "left_thigh", "right_thigh"))[0]
    if len(trunk) == 0:
        return field
    torso = parts == PARTS.index("torso")
    tree = cKDTree(bare[trunk])
    field = field.copy()
    for side in ("left", "right"):
        upper = parts == PARTS.index(f"{side}_upper_arm")
        arm = np.nonzero(upper | on_parts(parts, f"{side}_lower_arm", f"{side}_hand"))[0]
        hole = faces[upper[faces].any(axis=1) & torso[faces].any(axis=1)]
        if len(arm) == 0 or len(hole) == 0:
            continue
        low = np.maximum(
            ((bare[arm].min(axis=0) - grid.origin) / grid.cell).astype(np.int64) - 12, 0
        )
        high = ((bare[arm].max(axis=0) - grid.origin) / grid.cell).astype(np.int64) + 13
        cells = (
            np.argwhere(
                field[tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))]
                < 1.5 * grid.cell
            )
            + low
        )
        points = grid.origin + cells * grid.cell
        far, nearest = (np.asarray(found) for found in tree.query(points, workers=thread_count()))
        near, index = (
            np.asarray(found) for found in cKDTree(bare[arm]).query(points, workers=thread_count())
        )
        kept = (near < 0.12) & (far < 0.12) & (np.abs(near - far) < 6 * grid.cell)
        cells, points, body, limb = (
            cells[kept],
            points[kept],
            trunk[nearest[kept]],
            arm[index[kept]],
        )
        gap = 1.1 * grid.cell - 0.5 * np.abs(near - far)[kept]  # distance to the half-way surface
        outside = ((points - bare[body]) * normals[body]).sum(axis=1) > -0.004
        outside &= ((points - bare[limb]) * normals[limb]).sum(axis=1) > -0.004
        facing = (normals[body] * normals[limb]).sum(axis=1) < 0
        beyond = np.linalg.norm(bare[limb] - bare[hole].mean(axis=(0, 1)), axis=1) > 0.13
        carved = outside & (facing | beyond)
        i, j, k = cells[carved].T
        field[i, j, k] = np.maximum(field[i, j, k], gap[carved])
    return field


@dataclass(frozen=True, eq=False)
class Skin:
    """The body's outer skin: vertices (S, 3), meters, faces (G, 3), and parts (S,); see
    `a2v.body.skin.outer_skin`."""

    vertices: FloatArray
    faces: IntArray
    parts: IntArray


def add_lobes(
    field: FloatArray,
    skin: Skin,
    grid: Grid,
    mask_distance: FloatArray,
    settings: SurfaceSettings,
    *,
    band: int = 3,
) -> tuple[FloatArray, FloatArray]:
    """Fuse volumes to the field, cut off at `band` cells, in parts of the mask that the body does
    not reach.

    They are cloth from leg to leg, and inflated lobes. The second result (nx, ny) is the weight of
    such cloth in a column's depth.
    """
    import cv2

    front, back = columns_seen(skin.vertices, skin.faces, grid)
    legs = LegColumns.of(skin.vertices, skin.faces, skin.parts, grid)
    share, before, behind = span_legs(
        legs, legs.gaps((mask_distance < 0) & ~np.isfinite(front)), mask_distance
    )
    cloth = share > 0
    if cloth.any():
        field = _fill_columns(field, cloth, before, behind, grid, band)
        front, back = np.where(cloth, before, front), np.where(cloth, behind, back)
    covered = np.isfinite(front)
    wanted = mask_distance < 0
    # slivers along the rim (under 1.5 cm) are not hair or a skirt
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    missing = (
        cv2.dilate(
            cv2.morphologyEx((wanted & ~covered).astype(np.uint8), cv2.MORPH_OPEN, disk), disk
        ).astype(bool)
        & wanted
        & ~covered
    )
    if not missing.any():
        return field, share
    middle, half = _round_profile(front, back, covered, mask_distance, grid, settings.lobe)
    # fade out into the body over a few centimeters
    into = cv2.distanceTransform((~missing).astype(np.uint8), cv2.DIST_L2, 5) * grid.cell
    fade = np.clip(1.0 - into / 0.015, 0, 1)
    z = grid.axis(2).astype(np.float32)
    active = (into < 0.015) & wanted
    i, j = np.nonzero(active)
    lobe = (np.abs(z[None] - middle[i, j, None]) - (half * fade)[i, j, None]) * 0.8 + (
        1 - fade[i, j, None]
    ) * 2 * grid.cell
    limit = band * grid.cell
    field[i, j] = _smooth_min(
        field[i, j], np.clip(lobe, -limit, limit).astype(np.float32), 1.5 * grid.cell
    )
    return field, share


def _round_profile(
    front: FloatArray,
    back: FloatArray,
    covered: BoolArray,
    mask_distance: FloatArray,
    grid: Grid,
    lobe: float,
) -> tuple[FloatArray, FloatArray]:
    """Return middle and half thickness (nx, ny) of a lobe at every column, at most `lobe` meters.

    They continue those of the nearest covered columns.
    """
    import cv2

    # thickness from the medial width of the mask's protruding region: a round profile from the
    # contour to the middle
    inner = np.maximum(-mask_distance, 0).astype(np.float32)
    span = max(3, int(2 * lobe / grid.cell)) | 1
    radius = np.clip(
        cv2.dilate(inner, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (span, span))),
        2 * grid.cell,
        lobe,
    )
    radius = cv2.GaussianBlur(radius.astype(np.float32), (0, 0), span / 4)
    depth = np.minimum(inner, radius)
    half = np.sqrt(np.maximum(depth * (2 * radius - depth), 0))
    # continue the body's middle and thickness into the lobe
    nearest = nearest_known(covered)
    middle = np.where(covered, (np.where(covered, front, 0) + np.where(covered, back, 0)) / 2, 0)[
        nearest
    ]
    even = cv2.GaussianBlur(middle.astype(np.float32), (0, 0), 3.0)
    # each piece lies around its own limb: nothing is spanned between two limbs that are apart in
    # depth
    middle = np.where(np.abs(even - middle) < _STEP, even, middle).astype(np.float32)
    thick = np.where(covered, np.where(covered, front, 0) - np.where(covered, back, 0), 0)
    near_thick = cv2.GaussianBlur(
        cv2.dilate(thick.astype(np.float32), np.ones((13, 13), np.uint8))[nearest].astype(
            np.float32
        ),
        (0, 0),
        3.0,
    )
    half = np.minimum(half, np.maximum(0.5 * near_thick, 0.015))
    half = np.maximum(half, 0.8 * grid.cell)
    return middle, half


def _fill_columns(
    field: FloatArray, chosen: BoolArray, front: FloatArray, back: FloatArray, grid: Grid, band: int
) -> FloatArray:
    """Return the field with the space between `front` and `back` (nx, ny) filled in the chosen
    columns."""
    field, limit = field.copy(), band * grid.cell
    i, j = np.nonzero(chosen)
    z = grid.axis(2)
    solid = np.clip(
        np.maximum(z[None] - front[i, j, None], back[i, j, None] - z[None]), -limit, limit
    )
    field[i, j] = np.minimum(field[i, j], solid.astype(np.float32))
    return field


def _smooth_min(a: FloatArray, b: FloatArray, width: float) -> FloatArray:
    """Return a polynomial smooth union of two distance fields."""
    mix = np.clip(width - np.abs(a - b), 0, None)
    return np.asarray(np.minimum(a, b) - mix * mix / (4 * width))
