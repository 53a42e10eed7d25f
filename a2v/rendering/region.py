"""The part of a picture that a person and its shadows touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.empty import Empty
from a2v.rendering.scene import LookSettings
from a2v.types import BoolArray, FloatArray, IntArray

TILE = 8
"""Side of the squares for which tracing of the ground's light is switched on or off, pixels."""
_FINE = 4
"""Side of the squares for which tracing of the person is switched on or off, pixels."""

_STEP = 4
"""The distance from the person is computed at every n-th pixel."""

_LOW = 0.15
"""Below this height, shadows have edges so sharp that they are traced per pixel, meters."""

_NEAR = 1.4
"""Ground within this many body heights of the person is traced. Measured: farther away, the
person's effect on sky light and reflected light changes the ground by less than 0.4 of 255
levels."""

_RAMP = 3
"""Number of tiles over which the traced ground is blended into the empty stage's."""


@dataclass(frozen=True, kw_only=True)
class Region:
    """Pixels that a person touches.

    `person` (H, W) are the pixels that may show the person. `weight` (H, W) in [0, 1] is the weight
    of the traced light on the ground against the empty stage's. `contact` (H, W) in [0, 1] is the
    weight of the light traced per pixel, near contacts with the ground.
    """

    person: BoolArray
    weight: FloatArray
    contact: FloatArray

    def within(self, window: tuple[slice, slice]) -> Region:
        """Crop the region to a window of the picture (rows, columns)."""
        shown = np.zeros(self.person.shape, bool)
        shown[window] = True
        return (
            self
            if shown.all()
            else Region(
                person=self.person & shown, weight=self.weight * shown, contact=self.contact * shown
            )
        )


def region(
    vertices: FloatArray, faces: IntArray, camera: ViewCamera, look: LookSettings, empty: Empty
) -> Region:
    """Find the region of a person (`vertices` (V, 3), `faces` (F, 3)).

    It is conservative: it holds whole triangles and whole penumbras.
    """
    size = len(empty.ground)
    corners = np.ascontiguousarray(faces.T)
    person = _tiles(_projected(camera, vertices, size), None, corners, size, _FINE)
    shade = np.zeros((-(-size // TILE), -(-size // TILE)), bool)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    contact = shade.copy()
    standing = corners[:, (vertices[corners[0], 1] < _LOW) | (vertices[corners[1], 1] < _LOW)]
    for point, spread in _shadows(vertices, camera, look):
        pixels = _projected(camera, point, size)
        away = np.maximum(
            np.linalg.norm(point - np.array(camera.origin, np.float32), axis=-1), np.float32(0.1)
        )
        border = spread / away * np.float32(size / 2 / np.tan(np.radians(camera.fov) / 2))
        flat = np.minimum(
            1, 1.5 * abs(camera.origin[1]) / away
        )  # the camera sees a circle on the ground at an angle
        borders = border, border * flat
        shade |= _tiles(pixels, borders, corners, size, TILE)
        if standing.shape[1]:
            contact |= _tiles(pixels, borders, standing, size, TILE)
    place = empty.place[::_STEP, ::_STEP]
    off = [
        np.maximum(np.maximum(low[axis] - place[..., i], place[..., i] - high[axis]), 0)
        for i, axis in ((0, 0), (1, 2))
    ]
    near = empty.ground[::_STEP, ::_STEP] & (
        off[0] ** 2 + off[1] ** 2 < (_NEAR * max(high[1] - low[1], 0.5)) ** 2
    )
    shade = _grown(_grown(shade, 1) | _any(near, len(shade), TILE // _STEP), _RAMP)
    return Region(
        person=_pixels(person, size, _FINE),
        weight=_ramp(shade, size, _RAMP) * empty.ground,
        contact=_ramp(_grown(contact, 1), size, 1) * empty.ground,
    )


def _projected(camera: ViewCamera, points: FloatArray, size: int) -> FloatArray:
    """`ViewCamera.project` as (2, V) float32."""
    local = (
        np.asarray(points, np.float32) - np.array(camera.origin, np.float32)
    ) @ camera.axes.T.astype(np.float32)
    depth = np.where(local[:, 2] < 0, -local[:, 2], np.float32(np.nan))
    reach = np.float32(size / 2 / np.tan(np.radians(camera.fov) / 2)) / depth
    return np.stack([size / 2 + reach * local[:, 0], size / 2 - reach * local[:, 1]])


def _ramp(tiles: BoolArray, size: int, steps: int) -> FloatArray:
    """Return weights (size, size) float32: 1 inside of marked tiles, falling to 0 over `steps`
    tiles toward their border."""
    import cv2

    inside = np.pad(
        tiles.astype(np.uint8), 1, mode="edge"
    )  # the border of the picture is not a border of the region
    away = cv2.distanceTransform(inside, cv2.DIST_L2, 5)[1:-1, 1:-1]
    weight = np.clip((away - 1) / steps, 0, 1).astype(np.float32)
    shape = (tiles.shape[1] * TILE, tiles.shape[0] * TILE)
    whole = cv2.resize(weight, shape, interpolation=cv2.INTER_LINEAR)[:size, :size]
    return np.asarray(np.where(_pixels(tiles, size, TILE), whole, np.float32(0)))


def _pixels(tiles: BoolArray, size: int, tile: int) -> BoolArray:
    return np.repeat(np.repeat(tiles, tile, axis=0), tile, axis=1)[:size, :size]


def _shadows(
    vertices: FloatArray, camera: ViewCamera, look: LookSettings
) -> list[tuple[FloatArray, FloatArray]]:
    """Return, for sun and lamp, the center of each vertex's shadow on the ground (V, 3) and its
    radius (V,), meters."""
    above = np.maximum(
        np.asarray(vertices, np.float32), np.array((-np.inf, 0, -np.inf), np.float32)
    )
    sun = (np.array(look.sun_direction) / np.linalg.norm(look.sun_direction)).astype(np.float32)
    way = above[:, 1:2] / sun[1] * sun
    spread = np.linalg.norm(way, axis=1) * np.float32(np.tan(np.radians(look.sun_angle)) / sun[1])
    found = [(above - way, spread)] if max(look.sun) > 0 else []
    lamp = look.spot_light(camera.target).center.astype(np.float32)
    if max(look.spot) > 0 and above[:, 1].max() < 0.95 * (lamp[1] - look.spot_radius):
        part = above[:, 1:2] / (lamp[1] - above[:, 1:2])
        # from a point below the lamp, its rim may hang lower than its center
        lower = above[:, 1] / (lamp[1] - np.float32(look.spot_radius) - above[:, 1])
        reach = np.linalg.norm((above - lamp)[:, [0, 2]], axis=1)
        found.append(
            (
                above + part * (above - lamp),
                (lower - part[:, 0]) * reach
                + (1 + lower) * np.float32(look.spot_radius) * part[:, 0],
            )
        )
    return found


def _tiles(
    pixels: FloatArray,
    borders: tuple[FloatArray, FloatArray] | None,
    corners: IntArray,
    size: int,
    tile: int,
) -> BoolArray:
    """Return the squares of `tile` pixels that the bounding boxes of triangles touch.

    All squares are returned if a triangle is partly behind the camera. `pixels` (2, V) are the
    vertices' pixels; `borders` (V,), across and down, extend them to each side; `corners` (3, F)
    are the triangles.
    """
    count = -(-size // tile)
    marked = np.zeros((count + 1) ** 2, np.int64)
    edges = []
    for axis in (0, 1):
        border = np.float32(1) if borders is None else 1 + borders[axis]
        first, last = (pixels[axis] - border)[corners], (pixels[axis] + border)[corners]
        low = np.minimum(np.minimum(first[0], first[1]), first[2])
        high = np.maximum(np.maximum(last[0], last[1]), last[2])
        edges.append((low, high))
    seen = np.isfinite(edges[0][0])
    if not seen.all():
        if (np.isfinite(pixels[0][corners]).any(axis=0) != seen).any():
            return np.ones((count, count), bool)
        edges = [(low[seen], high[seen]) for low, high in edges]
    (x0, x1), (y0, y1) = (
        (
            np.clip(low / tile, 0, count).astype(np.int64),
            np.clip(high / tile + 1, 0, count).astype(np.int64),
        )
        for low, high in edges
    )
    for ys, xs, sign in ((y0, x0, 1), (y0, x1, -1), (y1, x0, -1), (y1, x1, 1)):
        marked += sign * np.bincount(ys * (count + 1) + xs, minlength=marked.size)
    covered: BoolArray = (
        marked.reshape(count + 1, count + 1).cumsum(axis=0).cumsum(axis=1)[:count, :count] > 0
    )
    return covered


def _grown(tiles: BoolArray, by: int) -> BoolArray:
    import cv2

    return np.asarray(
        cv2.dilate(tiles.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1), np.uint8)), bool
    )


def _any(marks: BoolArray, count: int, each: int) -> BoolArray:
    padded = np.zeros((count * each, count * each), bool)
    padded[: marks.shape[0], : marks.shape[1]] = marks
    tiles: BoolArray = padded.reshape(count, each, count, each).any(axis=(1, 3))
    return tiles
