"""The empty stage in closed form: the picture without the person and its shadow."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear, to_bytes
from a2v.rendering.camera import ViewCamera
from a2v.rendering.lights import DiskLight
from a2v.rendering.scene import LookSettings, ground_pattern
from a2v.types import BoolArray, FloatArray

_FAR = 100.0
"""Distance of the rim of the stage's ground from the origin, meters."""

_COARSE = 128
"""Approximate number of samples of the light on the ground along each axis; the light is smooth."""

_FINE = (2, 4)
"""Samples of the ground's lines in a pixel, across and down. A distant pixel is much deeper than
wide."""


@dataclass(frozen=True, kw_only=True)
class Empty:
    """A camera's view of the empty stage, linear float32.

    `color` and `albedo` are (H, W, 3), `light` (H, W, 3) is the ground's irradiance over pi.
    `place` (H, W, 2) is the ground point under each pixel's center, x and z in meters, and `ground`
    (H, W) is set where such a point exists.
    """

    color: FloatArray
    albedo: FloatArray
    light: FloatArray
    place: FloatArray
    ground: BoolArray


def empty_stage(look: LookSettings, camera: ViewCamera, size: int) -> Empty:
    """Render the empty stage into a picture of `size` x `size` pixels.

    The light of a pixel is the ground's irradiance there times the albedo averaged over the pixel
    (the lines are thin). The lamp's disk occludes sun and sky, as in the traced stage.
    """
    ray = rays(camera, size)
    rise = ray[..., 1]
    ground = rise < -1e-6 if camera.origin[1] > 0 else np.zeros(rise.shape, bool)
    color = np.array(
        look.sky(rise / np.linalg.norm(ray, axis=-1) if look.zenith is not None else rise),
        np.float32,
    )
    albedo = np.tile(np.float32(look.ground_albedo), (size, size, 1))
    light, place = np.zeros_like(color), np.zeros((size, size, 2), np.float32)
    if not ground.any():
        return Empty(color=color, albedo=albedo, light=light, place=place, ground=ground)
    top = int(np.flatnonzero(ground.any(axis=1))[0])  # no ground above the horizon
    below, here = ray[top:], ground[top:]
    reach = np.float32(-camera.origin[1]) / np.where(here, below[..., 1], np.float32(np.inf))
    for axis in (0, 1):
        np.add(
            reach * below[..., 2 * axis],
            np.float32(camera.origin[2 * axis]),
            out=place[top:, :, axis],
        )
    far = np.maximum(np.abs(place[top:, :, 0]), np.abs(place[top:, :, 1]))
    here &= far < _FAR
    printed = _printed(look, place[top:])
    near = (far < look.ground_radius)[..., None]
    albedo[top:] = (
        np.where(near, printed, albedo[top:])
        * np.where(here, _lines(look, camera, size, top), 1)[..., None]
    )
    foot = tuple(
        round(value - camera.target[axis], 9)
        for axis, value in ((0, camera.origin[0]), (2, camera.origin[2]))
    )
    # seen from the lamp, which follows the camera's target: equal in all frames of a following
    # camera
    relative = ViewCamera(
        origin=(foot[0], camera.origin[1], foot[1]),
        target=(0.0, camera.target[1], 0.0),
        up=camera.up,
        fov=camera.fov,
    )
    light[top:] = _light(look, relative, size)[top:]
    color[top:] = np.where(here[..., None], albedo[top:] * light[top:], color[top:])
    return Empty(color=color, albedo=albedo, light=light, place=place, ground=ground)


def rays(camera: ViewCamera, size: int, step: int = 1) -> FloatArray:
    """Return directions (H, W, 3) float32 through the pixel centers of a picture, not of unit
    length.

    With `step` above 1 they go through the centers of squares of `step` pixels that cover the
    picture.
    """
    right, up, backward = camera.axes.astype(np.float32)
    count = -(-size // step)
    at = (
        ((np.arange(count) + 0.5) * step - size / 2)
        * np.tan(np.radians(camera.fov) / 2)
        / (size / 2)
    ).astype(np.float32)
    direction: FloatArray = at[None, :, None] * right - (at[:, None] * up + backward)[:, None]
    return direction


def _lines(look: LookSettings, camera: ViewCamera, size: int, top: int) -> FloatArray:
    """Return the factor of the lines on the ground's albedo, averaged over each pixel, for the rows
    from `top` on: (H - top, W)."""
    import cv2

    if not look.is_patterned:
        return np.ones((size - top, size), np.float32)
    factor = _factor(look)
    pixels, (across, down) = len(factor), _FINE
    right, up, backward = camera.axes
    unit = np.tan(np.radians(camera.fov) / 2) / (size / 2)
    # The ray of a sample (i, j) is linear in i and j, and so is its ground point in homogeneous
    # coordinates.
    ray = np.stack(
        [
            right * unit / across,
            -up * unit / down,
            right * unit * (0.5 / across - size / 2)
            - up * unit * (top + 0.5 / down - size / 2)
            - backward,
        ],
        axis=1,
    )
    origin, scale = np.array(camera.origin), pixels / (2 * look.ground_radius)
    to_ground = np.stack(
        [origin[0] * ray[1] - origin[1] * ray[0], origin[2] * ray[1] - origin[1] * ray[2], ray[1]]
    )
    to_texture = (
        np.array([[scale, 0, pixels / 2 - 0.5], [0, scale, pixels / 2 - 0.5], [0, 0, 1]])
        @ to_ground
    )
    shape = (size * across, (size - top) * down)
    fine = cv2.warpPerspective(
        factor,
        to_texture,
        shape,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=1.0,
    )
    return np.asarray(
        cv2.resize(fine, (size, size - top), interpolation=cv2.INTER_AREA), np.float32
    )


def _printed(look: LookSettings, place: FloatArray) -> FloatArray:
    """Return the ground's albedo without its lines, (3,) or (H, W, 3), quantized like its 8-bit
    texture."""
    if look.ground is not None:
        return look.ground_at(place)  # quantized, it would show steps
    return (
        look.ground_albedo
        if look.plain_ground
        else srgb_to_linear(to_bytes(linear_to_srgb(look.ground_albedo)) / 255)
    )


@functools.lru_cache(maxsize=2)
def _factor(look: LookSettings) -> FloatArray:
    return ground_pattern(look).astype(np.float32)


@functools.lru_cache(maxsize=16)
def _light(look: LookSettings, camera: ViewCamera, size: int) -> FloatArray:
    """Return the ground's irradiance over pi (H, W, 3) with the lamp over the origin.

    The result is cached: it does not change while a camera follows.
    """
    import cv2

    step = max(1, size // _COARSE)
    ray = rays(camera, size, step)
    reach = -camera.origin[1] / np.minimum(ray[..., 1], -1e-3)
    place = np.array(camera.origin)[[0, 2]] + reach[..., None] * ray[..., [0, 2]]
    inside = np.asarray(place.clip(-_FAR, _FAR).reshape(-1, 2), np.float64)
    coarse = ground_light(look, inside).reshape(*place.shape[:2], 3).astype(np.float32)
    whole = cv2.resize(
        coarse, (coarse.shape[1] * step, coarse.shape[0] * step), interpolation=cv2.INTER_LINEAR
    )
    return np.asarray(whole[:size, :size], np.float32)


def ground_light(look: LookSettings, place: FloatArray) -> FloatArray:
    """Return the irradiance over pi (N, 3) on empty ground at `place` (N, 2), x and z in meters.

    The lamp hangs over the origin.
    """
    point = np.stack([place[:, 0], np.zeros(len(place)), place[:, 1]], axis=-1)
    lamp, sun = look.spot_light(), look.sun_light
    disk, area = lamp.matrix[:3, :2], np.pi * lamp.radius**2
    facing, hidden = np.zeros(len(point)), np.zeros(len(point))
    for q in _disk(12) if max(look.spot) > 0 else ():
        way = disk @ q + lamp.center - point
        square = (way**2).sum(axis=-1)
        factor = way[:, 1] * -(way @ lamp.normal) / square**2 * (area / np.pi / 12)
        facing += np.maximum(factor, 0)
        hidden += np.abs(factor)
    free = _sun_seen(look, point, sun, lamp)
    way = (
        sun.center - point
    )  # the stage's sun is near enough that its light fades a little over the ground
    square = (way**2).sum(axis=-1)
    free *= sun.reach**2 * way[:, 1] * (way @ -sun.normal) / square**2
    return np.asarray(
        free[:, None] * sun.irradiance
        + facing[:, None] * lamp.radiance
        + (1 - hidden)[:, None] * look.sky_on_ground
    )


def _sun_seen(
    look: LookSettings, point: FloatArray, light: DiskLight, lamp: DiskLight
) -> FloatArray:
    """Return the fraction (N,) of the sun's disk that the lamp's disk does not occlude from points
    (N, 3)."""
    sun = -light.normal
    across = np.cross(sun, (0.0, 1.0, 0.0) if abs(sun[1]) < 0.9 else (1.0, 0.0, 0.0))
    across /= np.linalg.norm(across)
    axes = np.stack([across, np.cross(sun, across)]) * np.tan(np.radians(look.sun_angle))
    hidden, points = np.zeros(len(point)), _disk(64)
    for q in points if max(look.spot) > 0 else ():
        way = sun + q @ axes
        along = ((lamp.center - point) @ lamp.normal) / (way @ lamp.normal)
        off = point + along[:, None] * way - lamp.center
        hidden += ((off**2).sum(axis=-1) < lamp.radius**2) & (along > 0)
    return 1 - hidden / len(points)


def _disk(count: int) -> FloatArray:
    """Return points (N, 2) spread evenly over the unit disk (sunflower pattern)."""
    at = np.arange(count) + 0.5
    radius, angle = np.sqrt(at / count), at * np.pi * (3 - np.sqrt(5))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
