"""Which part of a picture a person and its shadows touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.empty import Empty
from a2v.rendering.scene import SceneSettings, spot_matrix
from a2v.types import BoolArray, FloatArray, IntArray

TILE = 8
"""Pixels a side of the squares that are traced or not."""

_NEAR = 1.6
"""Up to this many heights of the person away, ground is traced. Measured: beyond, what a person takes from the sky's light and
what it reflects changes the ground by less than 0.4 levels of 255."""

_RAMP = 3
"""Tiles over which the traced ground goes over into the empty stage's."""

_GRAIN, _CONTEXT = 16, 24
"""Boxes to denoise begin at multiples of `_GRAIN` pixels (the denoiser's own raster, or a moving box would flicker), and reach
`_CONTEXT` pixels further than what is shown of them, over which neighbours are blended."""


@dataclass(frozen=True, kw_only=True)
class Region:
    """`person` and `ground` (H, W) are the pixels that may show the person, and ground near enough to it; `weight` (H, W) in [0, 1]
    is how much of a traced pixel of ground counts beside the empty stage's."""

    person: BoolArray
    ground: BoolArray
    weight: FloatArray


def region(vertices: FloatArray, faces: IntArray, camera: ViewCamera, scene: SceneSettings, empty: Empty) -> Region:
    """The region of a person (`vertices` (V, 3), `faces` (F, 3)); never too small: whole triangles, whole penumbras."""
    size = len(empty.ground)
    count = -(-size // TILE)
    person = _tiles(camera.project(vertices, size)[faces], count, np.zeros(len(faces)), np.zeros(len(faces)))
    shade = np.zeros_like(person)
    for point, spread in _shadows(vertices, camera, scene):
        pixels = camera.project(point, size)[faces]
        depth = np.linalg.norm(point - np.array(camera.origin), axis=-1)
        border = spread / np.maximum(depth, 0.1) * size / 2 / np.tan(np.radians(camera.fov) / 2)
        spreads = np.maximum(np.maximum(border[faces[:, 0]], border[faces[:, 1]]), border[faces[:, 2]])
        flat = np.minimum(1, 1.5 * abs(camera.origin[1]) / np.maximum(depth, 0.1))  # a circle on the ground is seen from the side
        shade |= _tiles(pixels, count, spreads, spreads * flat[faces[:, 0]])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    off = np.maximum(np.maximum(low[[0, 2]] - empty.place, empty.place - high[[0, 2]]), 0)
    near = empty.ground & (np.hypot(off[..., 0], off[..., 1]) < _NEAR * max(high[1] - low[1], 0.5))
    return _region(person, _grown(shade, _RAMP + 1) | _any(near, count), size, empty.ground)


def _region(person: BoolArray, shade: BoolArray, size: int, ground: BoolArray) -> Region:
    import cv2

    inside = np.pad(shade.astype(np.uint8), 1, mode="edge")  # the picture's border is no border of the region
    steps = cv2.distanceTransform(inside, cv2.DIST_L2, 5)[1:-1, 1:-1]
    weight = np.clip((steps - 1) / _RAMP, 0, 1).astype(np.float32)
    shape = (shade.shape[1] * TILE, shade.shape[0] * TILE)
    whole = cv2.resize(weight, shape, interpolation=cv2.INTER_LINEAR)[:size, :size]
    pixels = [np.repeat(np.repeat(tiles, TILE, axis=0), TILE, axis=1)[:size, :size] for tiles in (person, shade)]
    return Region(person=pixels[0], ground=pixels[1] & ground & ~pixels[0], weight=np.where(pixels[1] & ground, whole, 0))


def _shadows(vertices: FloatArray, camera: ViewCamera, scene: SceneSettings) -> list[tuple[FloatArray, FloatArray]]:
    """For sun and lamp: where the middle of each vertex's shadow falls on the ground (V, 3), and how far it spreads (V,), metres."""
    above = np.maximum(np.asarray(vertices, np.float64), (-np.inf, 0, -np.inf))
    sun = np.array(scene.sun_direction) / np.linalg.norm(scene.sun_direction)
    way = above[:, 1:2] / sun[1] * sun
    spread = np.linalg.norm(way, axis=1) * np.tan(np.radians(scene.sun_angle)) / sun[1]
    found = [(above - way, spread)] if max(scene.sun) > 0 else []
    lamp = spot_matrix(camera.target, scene)[:3, 3]
    if max(scene.spot) > 0 and above[:, 1].max() < 0.95 * (lamp[1] - scene.spot_radius):
        part = above[:, 1:2] / (lamp[1] - above[:, 1:2])
        # seen from a point below the lamp its rim may hang lower than its middle
        lower = above[:, 1] / (lamp[1] - scene.spot_radius - above[:, 1])
        reach = np.linalg.norm((above - lamp)[:, [0, 2]], axis=1)
        found.append((above + part * (above - lamp), (lower - part[:, 0]) * reach + (1 + lower) * scene.spot_radius * part[:, 0]))
    return found


def _tiles(corners: FloatArray, count: int, across: FloatArray, down: FloatArray) -> BoolArray:
    """The tiles (count, count) that the bounding boxes of triangles (F, 3, 2), in pixels, touch with borders (F,) to each side; all where one is partly behind the camera."""
    marked = np.zeros((count + 1, count + 1), np.int32)
    seen = np.isfinite(corners).all(axis=2)
    if (seen.any(axis=1) != seen.all(axis=1)).any():
        return np.ones((count, count), bool)
    corners, border = corners[seen[:, 0]], np.stack([across, down], axis=1)[seen[:, 0]]
    one, two, three = corners[:, 0], corners[:, 1], corners[:, 2]  # several times faster than min and max over an axis of three
    first = np.floor((np.minimum(np.minimum(one, two), three) - 1 - border) / TILE)
    last = np.floor((np.maximum(np.maximum(one, two), three) + 1 + border) / TILE) + 1
    x0, y0 = np.clip(first, 0, count).astype(np.int64).T
    x1, y1 = np.clip(last, 0, count).astype(np.int64).T
    for ys, xs, sign in ((y0, x0, 1), (y0, x1, -1), (y1, x0, -1), (y1, x1, 1)):
        marked += sign * np.bincount(ys * (count + 1) + xs, minlength=marked.size).reshape(marked.shape).astype(np.int32)
    covered: BoolArray = marked.cumsum(axis=0).cumsum(axis=1)[:count, :count] > 0
    return covered


def _grown(tiles: BoolArray, by: int) -> BoolArray:
    import cv2

    return np.asarray(cv2.dilate(tiles.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1), np.uint8)), bool)


def _any(pixels: BoolArray, count: int) -> BoolArray:
    padded = np.zeros((count * TILE, count * TILE), bool)
    padded[: pixels.shape[0], : pixels.shape[1]] = pixels
    tiles: BoolArray = padded.reshape(count, TILE, count, TILE).any(axis=(1, 3))
    return tiles


@dataclass(frozen=True, kw_only=True)
class Box:
    """Rows `top` to `bottom` and columns `left` to `right` (exclusive) of a picture."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def window(self) -> tuple[slice, slice]:
        """Of an array (H, W, ...)."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    @property
    def area(self) -> int:
        """Pixels."""
        return (self.bottom - self.top) * (self.right - self.left)

    def weight(self, size: int) -> FloatArray:
        """How much its pixels count where boxes lap over each other (H, W): less towards borders that are not the picture's."""
        sides = []
        for low, high in ((self.top, self.bottom), (self.left, self.right)):
            at = np.arange(low, high) + 0.5
            rise = np.where(low > 0, at - low, _CONTEXT)
            fall = np.where(high < size, high - at, _CONTEXT)
            sides.append(np.clip(np.minimum(rise, fall) / _CONTEXT, 1e-3, 1))
        return np.asarray(np.minimum(sides[0][:, None], sides[1][None, :]) ** 2, np.float32)


def boxes(found: Region) -> list[Box]:
    """One box around the ground and one around what is left of the person, or one around both where that is less."""
    size = len(found.person)
    ground = found.ground & (found.weight > 0)
    around = _box(ground | found.person, size)
    if not ground.any():
        return [] if around is None else [around]
    below = _box(ground, size)
    if below is None or around is None:  # neither can be: there is ground
        return []
    left = found.person.copy()
    left[below.top + _CONTEXT if below.top else 0 : below.bottom, below.left : below.right] = False
    above = _box(left, size)
    if above is None:
        return [below]
    return [below, above] if below.area + above.area < around.area else [around]


def _box(pixels: BoolArray, size: int) -> Box | None:
    if not pixels.any():
        return None
    edges = []
    for axis in (1, 0):
        at = np.flatnonzero(pixels.any(axis=axis))
        edges += [max(0, (at[0] - _CONTEXT) // _GRAIN * _GRAIN), min(size, -(-(at[-1] + 1 + _CONTEXT) // _GRAIN) * _GRAIN)]
    top, bottom, left, right = (int(value) for value in edges)
    return Box(top=top, bottom=bottom, left=left, right=right)
