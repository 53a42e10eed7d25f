"""Objects of the photo's place that occlude a person or are occluded by one."""

from __future__ import annotations

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.room import ground_under
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

_FOOT = 2
"""Height in pixels of the strip between the floor and the lowest row of an object: shadow and blur
at its foot."""
_LEAST = 3
"""Smallest number of columns in which the foot of an object has to be visible."""
FARTHEST = 1e4
"""Distance that means "occludes nobody", meters."""
CLEARANCE = 0.1
"""An object occludes a person who stands at least this far behind its foot, meters."""


def find_things(floor: BoolArray, regions: IntArray, camera: ViewCamera) -> FloatArray:
    """Find the distance of the object at each pixel.

    A region that is not floor stands where its foot meets the floor. A region without a visible
    foot belongs to the region below it; for example the top of a box belongs to its front.

    Parameters
    ----------
    floor : (h, h) bool
        See `a2v.rendering.room.find_floor`.
    regions : (h, h) int
        Regions of uniform color of the same picture, from 0.
    camera : ViewCamera

    Returns
    -------
    (h, h) float32
        Distance from the camera along the ground, meters; `FARTHEST` on the floor and where no foot
        is visible.
    """
    side = len(floor)
    ground, seen = ground_under(camera, side)
    away = np.linalg.norm(ground - np.array([camera.origin[0], camera.origin[2]]), axis=-1)
    names = np.where(floor, -1, regions)
    count = int(regions.max()) + 1
    rows, columns = np.nonzero(floor[1:] & ~floor[:-1] & seen[1:])
    above = np.maximum(rows - _FOOT, 0)
    standing = names[above, columns]
    distance = np.full(count, np.inf)
    for name in np.unique(standing[standing >= 0]):
        own = standing == name
        if own.sum() >= _LEAST:
            distance[name] = np.median(away[rows[own] + 1, columns[own]])
    for _ in range(count):
        upper, lower = names[:-1], names[1:]
        open_ones = (upper >= 0) & (lower >= 0) & (upper != lower) & np.isinf(distance[upper])
        open_ones &= np.isfinite(distance[lower])
        if not open_ones.any():
            break
        pairs, counts = np.unique(
            np.stack([upper[open_ones], lower[open_ones]], axis=1), axis=0, return_counts=True
        )
        for name in np.unique(pairs[:, 0]):
            own = np.flatnonzero(pairs[:, 0] == name)
            distance[name] = distance[pairs[own[np.argmax(counts[own])], 1]]
    found = np.where(names >= 0, distance[np.maximum(names, 0)], FARTHEST)
    return np.minimum(found, FARTHEST).astype(np.float32)


def behind_things(
    picture: ByteArray, place: ByteArray, things: FloatArray, distance: float
) -> ByteArray:
    """Composite the objects in front of a person over a picture of the person in a place.

    Parameters
    ----------
    picture : (S, S, 3) uint8
        The person in the place.
    place : (P, P, 3) uint8
        The place without the person.
    things : (h, h) float
        See `find_things`.
    distance : float
        Of the person from the camera along the ground, meters.
    """
    import cv2

    near = (things < distance - CLEARANCE).astype(np.float32)
    if not near.any():
        return picture
    size = picture.shape[1], picture.shape[0]
    share = np.clip(2 * cv2.resize(near, size, interpolation=cv2.INTER_LINEAR) - 0.5, 0, 1)
    empty = cv2.resize(place, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    mixed = picture + share[..., None] * (empty - picture)
    return np.asarray(np.rint(mixed), np.uint8)
