"""Find slabs: pixels at which a surface is thicker than a person can be.

A silhouette shows the width of a limb or a piece of cloth, and its depth is about the same.
`local_radius` is the width; `slab_share` counts the pixels at which a surface is deeper than that
*and* than the fitted body.
"""

from __future__ import annotations

import numpy as np

from a2v.body.skin import outer_skin
from a2v.errors import InputError
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import face_normals
from a2v.geometry.rays import RayScene, pixel_rays
from a2v.types import Body, BoolArray, FloatArray, IntArray, OrthographicCamera, Surface

THICK = 1.6
"""Factor of the plausible thickness above which a surface is a slab."""
THIN = 0.04
"""Smallest plausible thickness, meters: every rim is thin."""
STEPS = 24
"""Number of radii tested by `local_radius`."""


def local_radius(mask: BoolArray) -> FloatArray:
    """Radius (H, W) float32, pixels, of the largest disc within a mask (H, W) that contains each
    pixel (Hildebrand and Rüegsegger 1997); 0 outside."""
    return np.where(mask, spread(_depth_within(mask)), 0).astype(np.float32)


def spread(radius: FloatArray) -> FloatArray:
    """Return for each pixel the largest of the radii (H, W) float32, pixels, of discs that contain
    the pixel."""
    result = np.array(radius, np.float32)
    for wide in np.geomspace(1, max(float(result.max(initial=0)), 1), STEPS):
        middles = radius >= wide
        if middles.any():
            result[(_distance_to(middles) < wide) & (result < wide)] = wide
    return result


def _depth_within(mask: BoolArray) -> FloatArray:
    """Distance (H, W), pixels, of the pixels of a mask from its outside, which includes everything
    beyond the picture."""
    return _distance_to(~np.pad(mask, 1))[1:-1, 1:-1]


def _distance_to(known: BoolArray) -> FloatArray:
    """Distance (H, W), pixels, to the nearest pixel of `known`."""
    import cv2

    return np.asarray(
        cv2.distanceTransform((~known).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE),
        np.float32,
    )


def longest_ways(
    vertices: FloatArray, faces: IntArray, camera: OrthographicCamera, pixels: FloatArray
) -> FloatArray:
    """Return the longest path (n,), meters, inside a closed mesh, vertices (V, 3) and faces (F, 3),
    along -z at pixels (n, 2) of `camera`; 0 for none."""
    far = float(vertices[:, 2].max()) + 1
    ray, way, entering = RayScene(vertices, faces).passages(
        pixel_rays(camera, pixels, far),
        np.array([0, 0, -1], np.float32),
        face_normals(vertices, faces),
    )
    count = len(pixels)
    longest = np.zeros(count, np.float32)
    order = np.lexsort((way, ray))
    ray, way, step = ray[order], way[order], np.where(entering[order], 1, -1)
    # rays that graze an edge enter without leaving: they are dropped
    start = np.flatnonzero(np.r_[True, ray[1:] != ray[:-1]]) if len(ray) else ray
    within = np.cumsum(step)
    within = within - np.repeat(within[start] - step[start], np.diff(np.r_[start, len(ray)]))
    lowest = np.zeros(count, int)
    np.minimum.at(lowest, ray, within)
    whole = (np.bincount(ray, step, count) == 0) & (lowest == 0)
    ray, way, step, within = (values[whole[ray]] for values in (ray, way, step, within))
    into, out = (
        np.flatnonzero((within == 1) & (step == 1)),
        np.flatnonzero((within == 0) & (step == -1)),
    )
    np.maximum.at(longest, ray[into], way[out] - way[into])
    return longest


def slab_share(
    surface: Surface, body: Body, camera: OrthographicCamera, mask: FloatArray, size: int = 256
) -> float:
    """Share of the pixels of the silhouette at which a surface is thicker than plausible.

    The longest way through the solid along -z is compared with the width of the silhouette there
    (`local_radius`) and with the longest way through the fitted body (limbs may point at the
    camera); see `THICK` and `THIN`.

    Parameters
    ----------
    surface : Surface
        Closed, in the frame of `camera`.
    body : Body
        The fitted one.
    camera : OrthographicCamera
        Of the pixels of `mask`.
    mask : (H, W)
        Opacity of the person.
    size : int
        Rays along the longer side of the mask's box.
    """
    rows, columns = np.nonzero(mask > 0.5)
    if not len(rows):
        raise InputError("the mask is empty; expected the person in it")
    low, high = np.array([columns.min(), rows.min()]), np.array([columns.max(), rows.max()]) + 1
    step = max(1.0, float((high - low).max()) / size)
    u, v = (np.arange(low[axis] + 0.5 * step, high[axis], step) for axis in (0, 1))
    pixels = np.stack(np.meshgrid(u, v), axis=-1)
    inside = sample_image(mask, pixels.reshape(-1, 2), linear=True).reshape(pixels.shape[:2]) > 0.5
    asked = pixels[inside] + 0.0137 * step  # not along an edge of a regular grid
    skin, skin_faces, _ = outer_skin(body)
    own = longest_ways(surface.vertices.astype(np.float64), surface.faces, camera, asked)
    held = longest_ways(skin, skin_faces, camera, asked)
    width = 2 * local_radius(inside)[inside] * step / camera.scale
    return float((own > THICK * np.maximum(np.maximum(width, held), THIN)).mean())
