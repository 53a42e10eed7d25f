"""Make the texture atlas of a person: flat charts along the six axes, packed on shelves.

Charts are orthographic views of the surface, so the front chart is the photo itself, undistorted.
Surface that is occluded along its axis (a chest behind an arm) gets separate charts. (xatlas, the
general tool, takes half a minute on such meshes.)
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from a2v.geometry.images import nearest_known
from a2v.geometry.rays import ray_scene, texels
from a2v.types import FloatArray, IntArray

_AXES = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], np.float64)
_RIGHT = np.array([[1, 0, 0], [-1, 0, 0], [0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0]], np.float64)
_DENSITY = np.array([1.0, 0.7, 0.7, 0.7, 0.7, 0.6])  # the front has the resolution of the photo


@dataclass(frozen=True, eq=False)
class Atlas:
    """The position of each triangle in the texture.

    Attributes
    ----------
    uv : (F, 3, 2) float32
        Corners, origin at the lower left.
    size : int
        Width and height of the texture, texels.
    face : (size, size) int32
        Face under the center of each texel, -1 for none; row 0 is the top.
    barycentric : (size, size, 3) float32
    density : float
        Texels per meter on the front.
    """

    uv: FloatArray
    size: int
    face: IntArray
    barycentric: FloatArray
    density: float


@dataclass(frozen=True, eq=False)
class PaddedAtlas:
    """A layout whose charts are extended beyond their borders, so that filtering and mipmaps show
    no gaps.

    Attributes
    ----------
    atlas : Atlas
    slivers : (n,) int
        Faces between texel centers. A sliver would show the color of any chart nearby, so each gets
        a colored texel of its own in the padding.
    spots : two arrays (n,) int
        Rows and columns of these texels.
    nearest : two arrays (size, size) int
        Row and column of the nearest texel with a color.
    """

    atlas: Atlas
    slivers: IntArray
    spots: tuple[IntArray, IntArray]
    nearest: tuple[IntArray, IntArray]

    @classmethod
    def of(cls, atlas: Atlas) -> PaddedAtlas:
        """Pad the layout of a mesh."""
        filled = np.asarray(atlas.face >= 0)
        missed = np.setdiff1d(np.arange(len(atlas.uv)), atlas.face[filled])
        middle = atlas.uv[missed].mean(axis=1) * atlas.size
        row = np.clip((atlas.size - middle[:, 1]).astype(np.int64), 0, atlas.size - 1)
        column = np.clip(middle[:, 0].astype(np.int64), 0, atlas.size - 1)
        lone = ~filled[row, column]
        spots = row[lone], column[lone]
        filled[spots] = True
        return cls(atlas, missed[lone], spots, nearest_known(filled))


@functools.lru_cache(maxsize=1)
def padded_layout(atlas: Atlas) -> PaddedAtlas:
    """Pad a layout that many people share (`PaddedAtlas.of`), once for all of them."""
    return PaddedAtlas.of(atlas)


def make_atlas(
    vertices: FloatArray, faces: IntArray, *, size: int, density: float, padding: int = 4
) -> Atlas:
    """Lay out `faces` in a square texture of `size` texels, at most `density` texels per meter on
    the front."""
    vertices = np.asarray(vertices, np.float64)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    neighbors = face_neighbors(faces)
    direction = _directions(normals, neighbors)
    chart, chart_direction = _charts(vertices, faces, corners, normals, neighbors, direction)

    up = np.cross(_AXES, _RIGHT)
    axis = chart_direction[chart]
    flat = np.stack(
        [
            np.einsum("fcx,fx->fc", corners, _RIGHT[axis]),
            np.einsum("fcx,fx->fc", corners, up[axis]),
        ],
        axis=-1,
    )
    flat *= _DENSITY[axis][:, None, None]
    count = len(chart_direction)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    for corner in range(3):
        np.minimum.at(low, chart, flat[:, corner])
        np.maximum.at(high, chart, flat[:, corner])
    extent = high - low

    best, (least, most) = None, (0.0, density)
    for attempt in range(14):  # the largest scale that fits
        scale = density if attempt == 0 else (least + most) / 2
        places = _shelves(np.ceil(extent * scale) + 2 * padding, size)
        if places is None:
            most = scale
        else:
            best, least = (scale, places), scale
            if attempt == 0:
                break
    if best is None:
        raise ValueError(f"{count} charts do not fit a texture of {size} texels")
    scale, places = best
    texel = (flat - low[chart][:, None]) * scale + padding + places[chart][:, None]
    face, barycentric = texels(texel, size)
    return Atlas((texel / size).astype(np.float32), size, face, barycentric, scale)


def face_neighbors(faces: IntArray) -> IntArray:
    """The face across each edge (F, 3); the face itself for open edges."""
    edges = np.sort(
        np.stack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]], axis=1)
        .reshape(-1, 2)
        .astype(np.int64),
        axis=1,
    )
    key = edges[:, 0] * (faces.max() + 1) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    same = key[order][1:] == key[order][:-1]
    across = np.arange(len(key)) // 3
    first, second = order[:-1][same], order[1:][same]
    result = across.copy()
    result[first], result[second] = across[second], across[first]
    return result.reshape(-1, 3)


def _directions(normals: FloatArray, neighbors: IntArray) -> IntArray:
    """The axis along which each face is projected: the steepest one with a bonus for the front;
    single faces follow their neighbors."""
    score = normals @ _AXES.T
    score[:, 0] += np.where(score[:, 0] > 0.2, 0.35, 0.0)
    score[:, 1] += 0.15
    score[:, 4:] -= 0.25  # few charts from above and below
    own = np.where(normals @ _AXES.T > 0.1, score, -1.0)
    label = own.argmax(axis=1)
    for _ in range(8):
        votes = own + sum(
            0.35 * (label[neighbors[:, side], None] == np.arange(6)) for side in range(3)
        )
        label = np.where(own > -1, votes, -np.inf).argmax(axis=1)
    return np.asarray(label)


def _charts(
    vertices: FloatArray,
    faces: IntArray,
    corners: FloatArray,
    normals: FloatArray,
    neighbors: IntArray,
    direction: IntArray,
) -> tuple[IntArray, IntArray]:
    """Assign each face to a chart: connected, along one axis, without two faces on top of each
    other."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    layer = np.zeros(len(faces), np.int64)
    middle = corners.mean(axis=1)
    for axis in range(6):
        left = np.nonzero(direction == axis)[0]
        for depth in range(6):
            if not len(left):
                break
            scene = ray_scene(vertices, faces[left], threads=0)
            origin = middle[left] + 0.0
            start = float((vertices @ _AXES[axis]).max()) + 1.0
            lift = start - origin @ _AXES[axis]
            rays = np.concatenate(
                [origin + lift[:, None] * _AXES[axis], np.broadcast_to(-_AXES[axis], origin.shape)],
                axis=1,
            )
            hit = scene.cast_rays(rays.astype(np.float32))["t_hit"].numpy()
            first = (hit >= lift - 0.004) | (depth == 5)
            layer[left[first]] = depth
            left = left[~first]
    label = direction * 6 + layer
    pairs = np.stack([np.repeat(np.arange(len(faces)), 3), neighbors.ravel()], axis=1)
    pairs = pairs[label[pairs[:, 0]] == label[pairs[:, 1]]]
    graph = sp.csr_matrix((np.ones(len(pairs)), tuple(pairs.T)), (len(faces), len(faces)))
    count, chart = connected_components(graph, directed=False)
    chart_direction = np.zeros(count, np.int64)
    chart_direction[chart] = direction
    return chart, chart_direction


def _shelves(boxes: FloatArray, size: int) -> FloatArray | None:
    """Pack `boxes` (N, 2) on shelves, tallest first, and return their lower left corners (N, 2);
    None if they do not fit."""
    if (boxes > size).any():
        return None
    places = np.zeros_like(boxes)
    shelves: list[list[float]] = []  # each: x reached, y, height
    top = 0.0
    for index in np.lexsort((-boxes[:, 0], -boxes[:, 1])):
        width, height = boxes[index]
        shelf = next((s for s in shelves if s[0] + width <= size and height <= s[2]), None)
        if shelf is None:
            if top + height > size:
                return None
            shelf = [0.0, top, float(height)]
            shelves.append(shelf)
            top += height
        places[index] = shelf[0], shelf[1]
        shelf[0] += width
    return places
