"""Continue each material of the photo over the unseen side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.geometry.images import sample_image
from a2v.reconstruction.backs.exemplar import BROAD, Exemplar, make_exemplar
from a2v.reconstruction.backs.frames import unrolling
from a2v.reconstruction.backs.matching import Unrolled, match_surface
from a2v.reconstruction.backs.pieces import neighbor_mean
from a2v.reconstruction.backs.seen import (
    HAIR,
    HANDS,
    HEAD_PARTS,
    KINDS,
    LOWER,
    SHOES,
    SKIN,
    UPPER,
    BackEvidence,
    Materials,
)
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera

TRUST = np.array([1.0, 0.1, 0.05, 0.5, 0.5, 1.0])
"""Weight of an expected color of each label, if the photo shows the same material nearby."""

TINTED = 0.04
"""Distance from a border up to which expected colors are tinted by the other side, meters."""

OTHER_HUE = 15.0
"""Distance in CIELAB's a and b from which on two colors are of different materials."""

PATTERNED = 0.2
"""Contrast of the detail of hair above which it is a hat with a pattern, sRGB."""

_PALETTE_SIZE = 8
"""Number of colors in the palette of a garment."""
_PALETTE_LEAST = {UPPER: 200, LOWER: 200, SHOES: 60}
"""Smallest number of visible vertices of a garment by its label; with fewer, expected colors
stay."""
_PALETTE_NEAR = 4.0
"""Distance from the palette up to which hidden cloth keeps its color, CIELAB units."""
_PALETTE_PULL = np.array([0.3, 0.8, 0.8])
"""Share of the remaining distance, in lightness, a and b, by which it moves to the palette."""


@dataclass(frozen=True, eq=False)
class Continuation:
    """Labels of a surface, and the detail for its unseen side.

    Attributes
    ----------
    labels : (V,) int
        Index into `KINDS`.
    materials : (V,) int
        `labels`, with larger numbers for the panels of garments.
    expected : (V, 3)
        Expected colors of the unseen side without detail, smooth within each label.
    doubtful : (V,) bool
        Unseen vertices whose expected color is wrong, for instance behind a print.
    neighbors : (V, N) int
        Neighbors of the same material; the vertex itself in place of others.
    continues : (V,) bool
        Vertices that continue a place of the photo.
    contrast : float
        Three quarters of the visible detail of hair lie below this lightness, sRGB; 0 without hair.
    """

    labels: IntArray
    materials: IntArray
    expected: FloatArray
    doubtful: BoolArray
    neighbors: IntArray
    continues: BoolArray
    contrast: float
    _place: FloatArray
    _maps: FloatArray
    _vertices: FloatArray
    _detail: FloatArray
    _scale: float

    def on_vertices(self) -> FloatArray:
        """Detail (V, 3) of each vertex, averaged over its patch; 0 for vertices that continue
        nothing."""
        import cv2

        found = np.zeros((len(self.labels), 3))
        spacing = max(0.5, 0.4 * 0.007 * self._scale)
        found[self.continues] = sample_image(
            cv2.GaussianBlur(self._detail, (0, 0), spacing), self._place[self.continues]
        )
        return found

    def at(self, points: FloatArray, corners: IntArray, weights: FloatArray) -> FloatArray:
        """Detail (n, 3) at points (n, 3) of faces with `corners` (n, 3), at barycentric `weights`
        (n, 3)."""
        share = weights**3 * self.continues[corners]
        share = share / np.maximum((weights**3).sum(axis=1, keepdims=True), 1e-9)
        total = np.zeros((len(points), 3))
        for corner in range(3):
            own = np.flatnonzero(share[:, corner] > 1e-3)
            vertex = corners[own, corner]
            way = (
                np.einsum("nij,nj->ni", self._maps[vertex], points[own] - self._vertices[vertex])
                * self._scale
            )
            total[own] += share[own, corner, None] * sample_image(
                self._detail, self._place[vertex] + way * [1, -1]
            )
        return total

    def report(self) -> Mapping[str, float]:
        """Shares of vertices by label, and of those that continue a place of the photo."""
        shares = {KINDS[kind]: float((self.labels == kind).mean()) for kind in range(len(KINDS))}
        return shares | {"continues": float(self.continues.mean())}


def continue_photo(
    seen: BackEvidence,
    stuff: Materials,
    faces: IntArray,
    normals: FloatArray,
    clean: FloatArray,
    camera: OrthographicCamera,
    *,
    seed: int = 0,
) -> Continuation:
    """Continue the clean colors (H, W, 3) of a photo over the surface; `camera` is that of the
    photo."""
    import cv2

    labels, strange, materials = stuff.labels, stuff.strange, stuff.numbers
    vertices = np.asarray(seen.vertices, np.float64)
    twins = (seen.twin >= 0) & (materials[seen.twin] == materials)
    shown = np.where(
        twins, seen.twin, np.arange(len(labels))
    )  # the pixel of each vertex: that of its twin, else the one in front of it
    exemplar = make_exemplar(
        clean, camera, vertices, faces, normals, materials, seen.face | strange | seen.on(*HANDS)
    )
    maps = unrolling(vertices, normals, seen.parts, seen.neighbors)
    own = np.where(
        materials[seen.neighbors] == materials[:, None],
        seen.neighbors,
        np.arange(len(labels))[:, None],
    )
    place, continues = match_surface(
        exemplar,
        Unrolled(vertices, maps, seen.neighbors),
        np.where(_is_even(seen, labels), 0, materials),
        home=exemplar.camera.project(vertices[shown]),
        known=seen.known,
        seed=seed,
    )
    height, width = clean.shape[:2]
    base = cv2.resize(exemplar.base, (width, height), interpolation=cv2.INTER_LINEAR)
    nearest = _nearest_shown(exemplar, vertices[shown])
    # another limb, or another material, in front tints the expected color
    other_before = (nearest > 0) & (nearest != materials) & np.isin(labels, [UPPER, LOWER])
    doubtful = (
        _behind_print(exemplar, vertices[shown])
        | other_before
        | strange
        | strange[np.where(twins, seen.twin, seen.front)]
    ) & ~seen.known
    # networks expect skin below short hair, and hair if they have seen no face
    hairy = seen.scalp if seen.strands is None else seen.scalp | seen.strands
    unlike = ((hairy & (labels == HAIR)) | (seen.bare & (labels == SKIN))) & ~seen.known & ~twins
    return Continuation(
        labels=labels,
        materials=materials,
        expected=_smooth(seen, labels, own, stuff.colors, twins=twins, doubtful=doubtful | unlike),
        doubtful=doubtful | unlike,
        neighbors=own,
        continues=continues,
        contrast=_contrast(exemplar, HAIR),
        _place=place * (height / exemplar.colors.shape[0]),
        _maps=maps,
        _vertices=vertices,
        _detail=np.asarray(clean - base, np.float32),
        _scale=camera.scale,
    )


def _is_even(seen: BackEvidence, labels: IntArray) -> BoolArray:
    """Return which vertices (V,) have no detail that continues.

    The heel of a shoe does not look like its laces. Skin is even, and details of visible skin are
    features, or shadows of hair and fingers. The details of strands run along them.
    """
    even = (labels == SHOES) | seen.on(*HANDS) | ((labels == SKIN) & seen.on(*HEAD_PARTS))
    return np.asarray(even if seen.strands is None else even | seen.strands)


def _contrast(exemplar: Exemplar, kind: int) -> float:
    """Upper quartile of the size of the detail of a label, in lightness; 0 if it is not visible."""
    own = exemplar.sources & (exemplar.labels == kind)
    if not own.any():
        return 0.0
    return float(np.quantile(np.abs(exemplar.detail[own].mean(axis=1)), 0.75))


def _behind_print(exemplar: Exemplar, vertices: FloatArray) -> BoolArray:
    """Return whether a print lies right in front of each vertex (V,)."""
    pixels = np.floor(exemplar.camera.project(vertices)).astype(int)
    height, width = exemplar.prints.shape
    return np.asarray(
        exemplar.prints[np.clip(pixels[:, 1], 0, height - 1), np.clip(pixels[:, 0], 0, width - 1)]
    )


def _nearest_shown(exemplar: Exemplar, vertices: FloatArray) -> IntArray:
    """The label (V,) in the photo at the pixel of each vertex."""
    pixels = np.floor(exemplar.camera.project(vertices)).astype(int)
    height, width = exemplar.labels.shape
    return np.asarray(
        exemplar.labels[np.clip(pixels[:, 1], 0, height - 1), np.clip(pixels[:, 0], 0, width - 1)]
    )


def _from_border(vertices: FloatArray, labels: IntArray, neighbors: IntArray) -> FloatArray:
    """Weight (V,) from nearly 0 at a border between labels, where expected colors are a mixture, to
    1 at the distance `TINTED`."""
    from scipy.spatial import cKDTree

    border = (neighbors == np.arange(len(labels))[:, None]).any(axis=1)
    if not border.any():
        return np.ones(len(labels))
    reach = cKDTree(vertices[border]).query(vertices, workers=1, distance_upper_bound=TINTED)[0]
    return np.asarray(np.clip(reach / TINTED, 0.03, 1) ** 2)


def _hue_share(colors: FloatArray, others: FloatArray) -> FloatArray:
    """Weight (V, 1) of `others` (V, 3): 1 for another hue; differences in light and gloss do not
    count."""
    from skimage.color import rgb2lab

    away = (rgb2lab(np.clip(others, 0, 1)) - rgb2lab(np.clip(colors, 0, 1)))[:, 1:]
    return np.asarray(np.clip(np.linalg.norm(away, axis=1, keepdims=True) / OTHER_HUE, 0, 1))


def _smooth(
    seen: BackEvidence,
    labels: IntArray,
    neighbors: IntArray,
    panel_colors: FloatArray,
    *,
    twins: BoolArray,
    doubtful: BoolArray,
) -> FloatArray:
    """Smooth the expected colors (V, 3) within each label. Vertices with `twins` (V,) take the
    colors of the other side; `doubtful` (V,) ones have no weight. Hidden vertices of panels have
    the `panel_colors` (V, 3), NaN elsewhere."""
    from scipy.spatial import cKDTree

    spacing = float(
        np.median(np.linalg.norm(seen.vertices[seen.neighbors] - seen.vertices[:, None], axis=2))
    )
    rounds = int(np.clip(round(2 * (BROAD / max(spacing, 1e-4)) ** 2 / 2), 1, 40))
    mixing: Any = neighbor_mean(neighbors)
    weight = (
        np.where(
            seen.known | twins, 1.0, TRUST[labels] * _from_border(seen.vertices, labels, neighbors)
        )
        * ~doubtful
    )[:, None]
    told = np.isfinite(panel_colors[:, 0]) & ~seen.known
    own = np.where(told[:, None], panel_colors, seen.colors)
    colors = own + np.where(
        twins[:, None],
        _hue_share(own, seen.colors[seen.twin]) * (seen.colors[seen.twin] - own),
        0.0,
    )
    value = weight * np.nan_to_num(colors)
    for _ in range(rounds):
        value, weight = mixing @ value, mixing @ weight
    smooth = value / np.maximum(weight, 1e-300)
    lost = weight[:, 0] < 1e-6  # far from all vertices with weight
    for kind in np.unique(labels[lost]):
        own, good = (
            np.flatnonzero(lost & (labels == kind)),
            np.flatnonzero(~lost & (labels == kind)),
        )
        smooth[own] = (
            smooth[good[cKDTree(seen.vertices[good]).query(seen.vertices[own], workers=1)[1]]]
            if len(good)
            else colors[own]
        )
    return np.asarray(smooth)


def in_palette(expected: FloatArray, labels: IntArray, known: BoolArray) -> FloatArray:
    """Move the smooth expected colors (V, 3) of hidden cloth to colors that the photo shows of the
    same garment; `known` (V,) vertices keep theirs.

    Networks predict the mean of all possible backs: the back of a colored shirt is too pale.
    """
    from scipy.cluster.vq import kmeans2
    from scipy.spatial import cKDTree
    from skimage.color import lab2rgb, rgb2lab

    result = expected.copy()
    for kind, least in _PALETTE_LEAST.items():
        shown, hidden = (labels == kind) & known, (labels == kind) & ~known
        if shown.sum() < least or not hidden.any():
            continue
        lab = rgb2lab(np.clip(expected[shown], 0, 1))
        centers, member = kmeans2(lab, _PALETTE_SIZE, minit="++", seed=0)
        palette = centers[np.bincount(member, minlength=_PALETTE_SIZE) > 0]
        own = rgb2lab(np.clip(expected[hidden], 0, 1))
        away, nearest = cKDTree(palette).query(own)
        share = np.clip(1 - _PALETTE_NEAR / np.maximum(away, 1e-9), 0, 1)[:, None]
        result[hidden] = lab2rgb(own + share * _PALETTE_PULL * (palette[nearest] - own))
    return result
