"""The fast photograph: a scene lit, shaded by ray casting and developed, some per second on one
core.

`a2v.lab.studio.portrait` has the slow, path traced one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.rays import Hits, RayScene, SideView, facing, pixel_rays, scattered
from a2v.lab.studio.lighting import (
    Light,
    Shadows,
    background,
    cast_shadows,
    develop,
    highlights,
    irradiance,
)
from a2v.lab.studio.stand import Sitting
from a2v.lab.studio.texture import sample_bilinear, texture_at
from a2v.lab.studio.view import MAP_SIZE, PHOTO_SIZE
from a2v.types import ByteArray, FloatArray


@dataclass(frozen=True, kw_only=True)
class Film:
    """Resolution and sampling of a photograph.

    Attributes
    ----------
    size : int
        Side of the photo, pixels; the scene's camera is in these pixels.
    shadows : int
        Side of the map of shadows, pixels; `size` is a multiple of it.
    rays, lamp_rays : int
        Number of rays at each pixel of that map to the environment, and to each lamp.
    blur, lamp_blur : float
        Standard deviations of the smoothing that removes their noise, pixels of that map.
    """

    size: int = PHOTO_SIZE
    shadows: int = MAP_SIZE
    rays: int = 6
    lamp_rays: int = 3
    blur: float = 2.2
    lamp_blur: float = 1.4


FILM = Film()
"""The film of the reconstruction's views."""


@dataclass(frozen=True, eq=False)
class Lit:
    """The light of a scene.

    Attributes
    ----------
    light : Light
    shadows : (S, S, 1 + lamps) float32
        Fractions of the environment's and of each lamp's light at each pixel of the film's map of
        shadows, smoothed.
    gain : (3,) float
        Linear RGB: the mean irradiance over pi on the person and objects, after exposure and white
        balance.
    """

    light: Light
    shadows: FloatArray
    gain: FloatArray


@dataclass(frozen=True, eq=False)
class Photograph:
    """A photo.

    Attributes
    ----------
    image : (H, H, 3) uint8
        sRGB.
    mask : (H, H) uint8
        Pixels that show the person: 255 inside and soft at the rim.
    quality : int
        Quality of its JPEG, per cent.
    things : (H, H) uint8
        Pixels that show an object (neither background nor person), as in `mask`.
    gain : (3,) float
        Linear RGB: the mean irradiance over pi on the visible part of the person, in the photo's
        numbers.
    """

    image: ByteArray
    mask: ByteArray
    quality: int
    things: ByteArray
    gain: FloatArray


def light_scene(
    rays: RayScene,
    scene: Sitting,
    fore: SideView,
    generator: np.random.Generator,
    film: Film = FILM,
) -> Lit:
    """Draw a light, and set the exposure for it.

    Parameters
    ----------
    rays : RayScene
        Of the scene.
    scene : Sitting
    fore : SideView
        The scene from the front, ``film.shadows`` pixels a side.
    generator : numpy Generator
    film : Film
    """
    import cv2

    light = Light.draw(generator)
    hit, side = fore.hits.hit, film.shadows
    grid = (np.arange(side) + 0.5) * film.size / side
    pixels = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)[hit]
    points = np.asarray(scene.camera.unproject(pixels, fore.depth.ravel()[hit]), np.float32)
    normals = fore.normals.reshape(-1, 3)[hit]
    found = cast_shadows(
        rays, points, normals, light, generator, rays=film.rays, lamp_rays=film.lamp_rays
    )
    shares = np.zeros((side * side, 1 + len(light.lamps)), np.float32)
    shares[hit, 0] = found.ambient
    shares[hit, 1:] = found.lamps.T
    weight = hit.astype(np.float32).reshape(side, side)
    smooth = np.empty((side, side, shares.shape[1]), np.float32)
    for channel in range(shares.shape[1]):
        sigma = film.blur if channel == 0 else film.lamp_blur
        layer = cv2.GaussianBlur(shares[:, channel].reshape(weight.shape), (0, 0), sigma)
        smooth[..., channel] = layer / np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma), 1e-4)
    seen = smooth.reshape(-1, smooth.shape[2])[hit]
    mean = irradiance(light, normals, Shadows(seen[:, 0], seen[:, 1:].T)).mean(axis=0)
    exposure = float(np.clip(np.exp(generator.normal(-0.12, 0.25)), 0.45, 1.5)) / float(mean.mean())
    balance = np.exp(generator.normal(0, 0.05) * np.array([1.0, 0.0, -1.0]))
    # a camera removes most of the light's color cast
    cast = (mean / mean.mean()) ** -generator.uniform(0.3, 1.0)
    gain: FloatArray = mean * exposure * balance * cast
    return Lit(light, smooth, gain)


@dataclass(frozen=True, eq=False)
class Around:
    """The background and foreground of a scene in a photo.

    Attributes
    ----------
    behind : (H, H, 3) or None
        The background, linear light; one is drawn if it is None.
    before : (H, H, 4) or None
        The foreground: linear light and its alpha.
    """

    behind: FloatArray | None = None
    before: FloatArray | None = None


def photograph_scene(
    rays: RayScene,
    scene: Sitting,
    fore: SideView,
    lit: Lit,
    generator: np.random.Generator,
    film: Film = FILM,
    *,
    around: Around = Around(),
) -> Photograph:
    """Photograph a scene; `lit` is the result of `light_scene` for the other arguments.

    `around` has the background and the foreground.
    """
    behind, before = around.behind, around.before
    layer, size = _see(rays, scene, fore, lit, film), film.size
    picture = background(size, layer.feet, generator) if behind is None else behind
    picture = picture * (lit.gain / lit.gain.mean())
    window = picture[layer.rows, layer.columns]
    alpha = layer.coverage[..., None]
    window[:] = alpha * layer.color + (1 - alpha) * window
    whole, own = np.zeros((size, size), np.float32), np.zeros((size, size), np.float32)
    whole[layer.rows, layer.columns], own[layer.rows, layer.columns] = layer.coverage, layer.own
    if before is not None:
        cover = before[..., 3]
        picture = picture + cover[..., None] * (
            before[..., :3] * (lit.gain / lit.gain.mean()) - picture
        )
        whole, own = np.maximum(whole, cover), own * (1 - cover)
    image, quality = develop(picture, generator)
    mask, things = (
        np.rint(255 * share).astype(np.uint8) for share in (own, np.maximum(whole - own, 0))
    )
    return Photograph(image, mask, quality, things, layer.gain)


@dataclass(frozen=True, eq=False)
class _Layer:
    """The camera's view of a scene in a window of the photo.

    `rows` and `columns` are the window's. `color` (h, w, 3) is linear light. `coverage` and `own`
    (h, w) are the fractions of a pixel that the scene and the person cover. `feet` is the row of
    the person's lowest point, pixels. `gain` (3,) is `Photograph.gain`.
    """

    rows: slice
    columns: slice
    color: FloatArray
    coverage: FloatArray
    own: FloatArray
    feet: float
    gain: FloatArray


def _see(rays: RayScene, scene: Sitting, fore: SideView, lit: Lit, film: Film) -> _Layer:
    """Shade the camera's view of a scene."""
    import cv2

    surface, camera, size = scene.surface, scene.camera, film.size
    far = float(surface.vertices[:, 2].max()) + 1
    corner = camera.project(surface.vertices)
    low, high = (
        np.floor(corner.min(axis=0)).astype(int) - 2,
        np.ceil(corner.max(axis=0)).astype(int) + 2,
    )
    low, high = np.clip(low, 0, size), np.clip(high, 0, size)
    columns, rows = np.arange(low[0], high[0]), np.arange(low[1], high[1])
    pixels = np.stack(np.meshgrid(columns + 0.5, rows + 0.5), axis=-1).reshape(-1, 2)
    down = np.array([0, 0, -1], np.float32)
    shape = (len(rows), len(columns))
    # rays are needed only close to the pixels that the maps cover
    step = size // film.shadows
    near = (
        cv2.dilate(
            fore.hits.hit.reshape(film.shadows, film.shadows).astype(np.uint8),
            np.ones((5, 5), np.uint8),
        )
        > 0
    )
    index = np.flatnonzero(near[rows[:, None] // step, columns[None] // step].ravel())
    first = scattered(rays.cast(pixel_rays(camera, pixels[index], far), down), index, len(pixels))
    # the factor from irradiance over pi to the photo's numbers, with which the mean over the person
    # is `gain`
    seen = _shade(scene, lit, first, pixels, film)
    factor = lit.gain / np.maximum(seen.irradiance.mean(axis=0), 1e-9)
    person = scene.is_person(first.face[first.hit])
    gain = (
        factor * seen.irradiance[person].mean(axis=0)
        if person.any() and not person.all()
        else lit.gain
    )
    color = np.zeros((len(pixels), 3), np.float32)
    color[first.hit] = seen.color * factor
    coverage = first.hit.astype(np.float32)
    own = (first.hit & scene.is_person(first.face)).astype(np.float32)
    # pixels at the silhouette and at depth jumps are averages of four rays
    depth = np.where(first.hit, first.distance, far + 9).reshape(shape).astype(np.float32)
    jump = cv2.dilate(depth, np.ones((3, 3))) - cv2.erode(depth, np.ones((3, 3))) > 0.02 * (
        PHOTO_SIZE / size
    )
    edge = np.flatnonzero(jump.ravel())
    offsets = np.array([[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]])
    fine_pixels = (pixels[edge][:, None] + offsets).reshape(-1, 2)
    fine = rays.cast(pixel_rays(camera, fine_pixels, far), down)
    fine_color = np.zeros((len(fine_pixels), 3), np.float32)
    fine_color[fine.hit] = _shade(scene, lit, fine, fine_pixels, film).color * factor
    count = fine.hit.reshape(-1, 4).sum(axis=1)
    coverage[edge] = count / 4
    own[edge] = (fine.hit & scene.is_person(fine.face)).reshape(-1, 4).sum(axis=1) / 4
    color[edge] = fine_color.reshape(-1, 4, 3).sum(axis=1) / np.maximum(count, 1)[:, None]
    feet = np.ceil(corner[: scene.person_vertices, 1].max()) + 2
    return _Layer(
        slice(low[1], high[1]),
        slice(low[0], high[0]),
        color.reshape(*shape, 3),
        coverage.reshape(shape),
        own.reshape(shape),
        float(np.clip(feet, 0, size)),
        gain,
    )


@dataclass(frozen=True, eq=False)
class _Shaded:
    """Linear colors (n, 3) float32, and only the irradiance over pi (n, 3)."""

    color: FloatArray
    irradiance: FloatArray


def _shade(scene: Sitting, lit: Lit, hits: Hits, pixels: FloatArray, film: Film) -> _Shaded:
    """Shade the hits of rays through pixels (n, 2) of the photo: texture times light, plus
    highlights."""
    surface = scene.surface
    normals = facing(hits.interpolate(scene.normals, surface.faces), 1)
    at = (pixels[hits.hit] * (film.shadows / film.size) - 0.5).astype(np.float32)
    found = sample_bilinear(lit.shadows, at)
    reach = Shadows(found[:, 0], found[:, 1:].T)
    light_on = irradiance(lit.light, normals, reach)
    albedo = texture_at(surface, hits.face[hits.hit], hits.barycentric[hits.hit])
    return _Shaded(
        (albedo * light_on + highlights(lit.light, normals, reach)).astype(np.float32), light_on
    )
