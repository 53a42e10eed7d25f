"""Use the photo as a sample of its materials: their detail, and where it may be taken from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.rays import RayScene
from a2v.reconstruction.backs.panels import PANELS_APART, SHADE
from a2v.reconstruction.backs.seen import KINDS, LOWER, SKIN, UPPER
from a2v.reconstruction.palettes import palette_distance
from a2v.system import thread_count
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera

BROAD = 0.025
"""Largest size of detail on materials with a pattern, meters (sigma of a Gaussian)."""
FINE = 0.014
"""The same on plain materials, whose broader changes are shading and folds."""
SPACING = 0.004
"""Size of a pixel at which patterns are compared, meters."""
BARE = 0.006
"""The same for skin: broader changes are veins, knuckles and light."""
PATTERN = 0.044
"""A material has a broad pattern if a quarter of its detail between both sizes exceeds this value:
stripes of 8 cm do, folds, checks and camouflage do not."""
FAR = 0.05
"""Smallest distance across the limb at which a pattern repeats, meters."""


@dataclass(frozen=True, eq=False)
class Exemplar:
    """The photo on a grid of its own pixels.

    Attributes
    ----------
    camera : OrthographicCamera
        Of the grid.
    colors : (H, W, 3) float32
        sRGB in [0, 1].
    base : (H, W, 3) float32
        `colors` without detail, smoothed within each label alone.
    labels : (H, W) int
        Label of the surface at each pixel; 0 if it is unsure, unseen, or missing.
    sources : (H, W) bool
        Pixels from which detail may be taken: seen squarely, far from borders, face and prints.
    prints : (H, W) bool
        Pixels that do not repeat: prints, logos, zips, pockets.
    """

    camera: OrthographicCamera
    colors: FloatArray
    base: FloatArray
    labels: IntArray
    sources: BoolArray
    prints: BoolArray

    @property
    def detail(self) -> FloatArray:
        """The colors minus their base, (H, W, 3)."""
        return np.asarray(self.colors - self.base, np.float32)


def make_exemplar(
    clean: FloatArray,
    camera: OrthographicCamera,
    vertices: FloatArray,
    faces: IntArray,
    normals: FloatArray,
    labels: IntArray,
    apart: BoolArray,
) -> Exemplar:
    """Make the exemplar of the clean colors (H, W, 3) of a photo at `SPACING` meters per pixel, or
    at the resolution of the photo if that is coarser.

    `labels` (V,) are those of the surface; vertices that are `apart` (V,) give no detail.
    """
    import cv2

    zoom = min(1.0, 1.0 / (SPACING * camera.scale))
    height, width = (max(8, round(size * zoom)) for size in clean.shape[:2])
    small = cv2.resize(clean, (width, height), interpolation=cv2.INTER_AREA)
    grid = OrthographicCamera(
        scale=camera.scale * height / clean.shape[0],
        center_u=camera.center_u * width / clean.shape[1],
        center_v=camera.center_v * height / clean.shape[0],
    )
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    front = float(vertices[:, 2].max()) + 1.0
    origins = grid.unproject(np.stack([columns, rows], axis=-1).reshape(-1, 2), front)
    hits = RayScene(vertices, faces).cast(
        np.asarray(origins, np.float32), np.array([0, 0, -1], np.float32)
    )
    corner = np.concatenate(
        [1 - hits.barycentric.sum(axis=1, keepdims=True), hits.barycentric], axis=1
    ).argmax(axis=1)
    nearest = faces[np.where(hits.hit, hits.face, 0), corner]
    shown = hits.hit.reshape(height, width)
    label = np.where(shown, labels[nearest].reshape(height, width), 0)
    square = (
        shown
        & (normals[nearest, 2].reshape(height, width) > 0.45)
        & ~apart[nearest].reshape(height, width)
    )
    turned = normals[nearest, 2].reshape(height, width) < 0.75
    base, sources, prints = small.copy(), np.zeros_like(shown), np.zeros_like(shown)
    meter = grid.scale
    for kind in np.unique(label[label > 0]):
        own = label == kind
        base[own] = _base(small, own, own & square, meter, plain=BARE if kind == SKIN else FINE)[
            own
        ]
        alike = own & square
        if kind >= len(KINDS):  # a panel: what has another color in it does not continue
            alike &= _alike(small, alike)
        good = _inner(alike, 0.012 * meter)
        odd = (
            non_repeating(small, own & square, own & square & turned, meter) & own
            if kind in (UPPER, LOWER) or kind >= len(KINDS)
            else np.zeros_like(own)
        )
        prints |= odd
        sources |= good & ~odd
    return Exemplar(grid, small, base, label, sources, prints)


def _base(
    image: FloatArray, region: BoolArray, clear: BoolArray, meter: float, *, plain: float
) -> FloatArray:
    """A picture (H, W, 3) without the detail of a region (H, W); its pattern is judged by the
    `clear` (H, W) pixels."""
    broad, fine = _within(image, region, BROAD * meter), _within(image, region, plain * meter)
    if plain < FINE:
        return fine
    between = np.abs(fine - broad)[clear]  # not the mean: borders between two colors are no pattern
    return broad if len(between) and float(np.quantile(between, 0.75)) > PATTERN else fine


def _alike(image: FloatArray, region: BoolArray) -> BoolArray:
    """Return which pixels (H, W) have about the median color of a region (H, W)."""
    from skimage.color import rgb2lab

    if not region.any():
        return region
    lab = rgb2lab(np.clip(image, 0, 1))
    own = np.median(lab[region], axis=0, keepdims=True)
    return palette_distance(lab, own, SHADE) < PANELS_APART


def _within(image: FloatArray, region: BoolArray, sigma: float) -> FloatArray:
    """A picture (H, W, 3) smoothed within a region (H, W) (normalized convolution)."""
    import cv2

    weight = region.astype(np.float32)
    total = cv2.GaussianBlur(weight, (0, 0), sigma)
    smooth = cv2.GaussianBlur(image * weight[..., None], (0, 0), sigma)
    return np.asarray(smooth / np.maximum(total, 1e-6)[..., None], np.float32)


def _inner(region: BoolArray, margin: float) -> BoolArray:
    """A region (H, W) without its rim of `margin` pixels; less where it is thin."""
    import cv2

    depth = cv2.distanceTransform(region.astype(np.uint8), cv2.DIST_L2, 5)
    deepest = float(depth.max())
    return np.asarray(depth > min(margin, 0.45 * deepest))


def non_repeating(
    image: FloatArray, region: BoolArray, turned: BoolArray, meter: float
) -> BoolArray:
    """Return which pixels of a region (H, W) show a pattern that does not continue around the limb:
    a print, a logo, a tie, a zip, a shirt under a jacket.

    Patches of 3 cm are compared by color. A pattern that continues around the limb (stripes,
    checks, camouflage, folds) is also visible where the surface is `turned` (H, W) to the side, at
    a distance of `FAR` or more across, at any height. Patches without any similar patch there do
    not continue. If these are more than 45 % of a region, they are its texture. `meter` is in
    pixels.
    """
    import cv2
    from scipy.spatial import cKDTree
    from skimage.color import rgb2lab

    none = np.zeros_like(region)
    step = max(1, round(0.008 * meter))
    inside = cv2.erode(region.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    rows, columns = np.nonzero(inside)
    kept = (rows % step == 0) & (columns % step == 0)
    rows, columns = rows[kept], columns[kept]
    aside = np.flatnonzero(turned[rows, columns])
    if len(aside) < 40 or np.ptp(columns) < 3 * FAR * meter:
        return none
    lab = rgb2lab(np.clip(_within(image, region, 0.005 * meter), 0, 1)).astype(np.float32)
    # light falls off towards the sides: broad changes count by their hue
    lab = np.concatenate(
        [
            0.6 * (lab[..., :1] - _within(lab, region, 0.1 * meter)[..., :1]),
            0.15 * lab[..., :1],
            lab[..., 1:],
        ],
        axis=-1,
    )
    lab[~region] = 0
    reach = np.array([-0.013, 0.0, 0.013]) * meter
    around = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2).round().astype(int)
    padded = np.pad(lab, ((16, 16), (16, 16), (0, 0)))
    features = np.concatenate(
        [padded[rows + 16 + dy, columns + 16 + dx] for dx, dy in np.clip(around, -16, 16)], axis=1
    )
    away, other = cKDTree(features[aside]).query(
        features, k=min(24, len(aside)), workers=thread_count()
    )
    beside = np.abs(columns[aside][other] - columns[:, None]) > FAR * meter
    rare = np.where(beside.any(axis=1), np.where(beside, away, np.inf).min(axis=1), away[:, -1])
    odd = (rare > max(2.5 * float(np.median(rare)), 18.0)) & ~turned[rows, columns]
    if odd.mean() > 0.45:
        return none
    marks = none.astype(np.uint8)
    marks[rows[odd], columns[odd]] = 1
    size = max(3, 2 * round(0.015 * meter) + 1)
    closed = cv2.morphologyEx(marks, cv2.MORPH_CLOSE, np.ones((size, size), np.uint8))
    spread = cv2.dilate(marks, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
    return np.asarray((closed | spread) > 0)
