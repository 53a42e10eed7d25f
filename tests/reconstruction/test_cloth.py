"""Cloth from leg to leg: two rods as legs, and masks over them."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from a2v.body.parts import PARTS
from a2v.geometry.volume import Grid, signed_distance
from a2v.reconstruction import SurfaceSettings
from a2v.reconstruction.body_prior.cloth import LegColumns, span_legs
from a2v.reconstruction.body_prior.columns import columns_seen
from a2v.reconstruction.body_prior.volume import Skin, add_lobes
from a2v.types import BoolArray, FloatArray, IntArray

THICK, ASIDE = 0.06, 0.12
GRID = Grid(np.array([-0.3, -0.5, -0.35]), 0.006, (101, 167, 117))


def legs(apart: float = 0.0) -> tuple[FloatArray, IntArray, IntArray]:
    """Two upright rods as thighs, 12 cm thick and 12 cm from the middle.

    Their depths are `apart` meters apart.
    """
    rods = []
    for side in (1, -1):
        rod = trimesh.creation.cylinder(THICK, 0.8, sections=48).subdivide()
        rod.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
        rods.append(rod.apply_translation([side * ASIDE, 0, side * apart / 2]))
    parts = np.repeat(
        [PARTS.index("left_thigh"), PARTS.index("right_thigh")], [len(rod.vertices) for rod in rods]
    )
    both = trimesh.util.concatenate(rods)
    return np.asarray(both.vertices), np.asarray(both.faces), parts


def outline(hem: float, top: float = 0.4, wide: float = 0.2) -> FloatArray:
    """Distance to the contour of a cloth over both rods from `hem` to `top`, meters.

    The rods below the hem belong to the shape.
    """
    x, y = np.meshgrid(GRID.axis(0), GRID.axis(1), indexing="ij")
    cloth = np.maximum(np.abs(x) - wide, np.maximum(hem - y, y - top))
    rods = np.maximum(np.abs(np.abs(x) - ASIDE) - THICK, np.abs(y) - 0.4)
    return np.minimum(cloth, rods).astype(np.float32)


def hang(
    apart: float, hem: float, top: float = 0.4
) -> tuple[BoolArray, FloatArray, FloatArray, FloatArray]:
    """Gaps, and the cloth's share, front and back."""
    skin, faces, parts = legs(apart)
    distance = outline(hem, top)
    columns = LegColumns.of(skin, faces, parts, GRID)
    gaps = columns.gaps((distance < 0) & ~np.isfinite(columns_seen(skin, faces, GRID)[0]))
    return gaps, *span_legs(columns, gaps, distance)


def test_cloth_lies_on_both_legs() -> None:
    gaps, share, front, back = hang(apart=0.08, hem=-0.1)
    middle, row = 50, int(np.argmin(np.abs(GRID.axis(1) - 0.1)))
    assert gaps[middle, row]
    assert share[middle, row] == 1
    # half-way between rods whose crests are at .04 + .06 and -.04 + .06
    assert front[middle, row] == pytest.approx(THICK, abs=0.004)
    assert back[middle, row] == pytest.approx(-THICK, abs=0.004)
    assert not gaps[:, GRID.axis(1) < -0.11].any()  # nothing below the hem
    hem = int(np.argmin(np.abs(GRID.axis(1) + 0.097)))
    assert front[middle, hem] - back[middle, hem] < 0.8 * (
        front[middle, row] - back[middle, row]
    )  # rounded at the hem


def test_above_the_gap_cloth_comes_to_lie_on_the_body() -> None:
    skin, faces, parts = legs()
    trunk = trimesh.creation.box([0.36, 0.3, 0.08]).subdivide().subdivide()
    trunk.apply_translation([0, 0.25, 0])
    both = trimesh.util.concatenate(trimesh.Trimesh(skin, faces, process=False), trunk)
    parts = np.concatenate([parts, np.full(len(trunk.vertices), PARTS.index("torso"))])
    skin, faces = np.asarray(both.vertices), np.asarray(both.faces)
    distance = outline(-0.1)
    columns = LegColumns.of(skin, faces, parts, GRID)
    gaps = columns.gaps((distance < 0) & ~np.isfinite(columns_seen(skin, faces, GRID)[0]))
    share, front, _ = span_legs(columns, gaps, distance)
    middle = 50
    top = int(np.flatnonzero(gaps[middle]).max())
    along = share[middle, top : top + 34]
    assert along[0] == 1
    assert (np.diff(along) <= 0).all()
    assert along[-1] < 0.02
    assert front[middle, top + 2] == pytest.approx(
        THICK, abs=0.006
    )  # the thighs' crest, not the trunk's 4 cm
    assert front[middle, top + 32] == pytest.approx(0.04, abs=0.003)


@pytest.mark.parametrize(
    ("apart", "hem", "top"),
    [
        (0.2, -0.1, 0.4),  # legs one behind the other: trousers that meet in the picture
        (0.0, 0.06, 0.1),  # a fold, 4 cm high
    ],
)
def test_trousers_are_no_skirt(apart: float, hem: float, top: float) -> None:
    gaps, share, _, _ = hang(apart, hem, top)
    assert not gaps.any()
    assert not share.any()


def test_a_gap_beside_one_leg_alone_is_none() -> None:
    skin, faces, parts = legs()
    parts = np.full_like(parts, PARTS.index("left_thigh"))
    distance = outline(-0.1)
    columns = LegColumns.of(skin, faces, parts, GRID)
    assert not columns.gaps((distance < 0) & ~np.isfinite(columns_seen(skin, faces, GRID)[0])).any()


def test_the_skirt_is_one_solid_as_thick_as_the_legs() -> None:
    skin, faces, parts = legs(apart=0.06)
    field, share = add_lobes(
        signed_distance(skin, faces, GRID),
        Skin(skin, faces, parts),
        GRID,
        outline(-0.1),
        SurfaceSettings(),
    )
    solid = field < 0
    labels, _ = ndimage.label(solid)
    assert (np.bincount(labels.ravel())[1:] > 100).sum() == 1
    row = int(np.argmin(np.abs(GRID.axis(1) - 0.1)))
    thickness = solid[30:71, row].sum(axis=-1) * GRID.cell
    assert thickness.min() > 0.09
    assert (share[30:71, row] == 1).all()
