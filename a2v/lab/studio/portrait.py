"""Portraits: photorealistic pictures of 3D people with ground truth, path traced in seconds.

`a2v.lab.studio.photograph` has the fast ones, for the training of networks.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear, to_bytes
from a2v.record import Record
from a2v.rendering.camera import ViewCamera
from a2v.rendering.renderer import Renderer
from a2v.rendering.scene import LookSettings
from a2v.rendering.variant import activate
from a2v.types import ByteArray, FloatArray, RenderSettings, Surface

Triple = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class PortraitSettings(Record):
    """Settings of a photograph. Angles in degrees, lengths in meters, colors sRGB in [0, 1].

    Attributes
    ----------
    size : int
        Width and height, pixels.
    spp : int
        Samples per pixel before denoising.
    distance, height, yaw : float
        Position of the camera: distance from the person, height over the floor, angle about the
        person (positive: toward the person's left).
    fill_frame : float
        The person's height as a fraction of the picture's.
    key_direction : tuple of 3 float
        Direction to the main light.
    key, fill : float
        Irradiance over pi of the main light, and radiance of the light from all directions.
    key_size : float
        Angular radius of the main light: the softness of shadows.
    warmth : float
        Tint of the main light from -1 (blue) to 1 (orange).
    wall, floor : tuple of 3 float
        Colors of the background. The two meet in a round corner.
    wall_distance : float
        From the person to the wall.
    gloss : float
        Strength of the highlights on the person, 0 to 1.
    noise : float
        Standard deviation of the sensor's noise at mid gray, in units of 1/255.
    vignette : float
        Darkening of the corners, 0 to 1.
    seed : int
        Seed of the rendering and of the sensor's noise.
    variant, threads
        As in `RenderSettings`.
    """

    size: int = 1024
    spp: int = 64
    distance: float = 3.8
    height: float = 1.25
    yaw: float = 0.0
    fill_frame: float = 0.86
    key_direction: Triple = (-0.75, 1.1, 1.15)
    key: float = 0.95
    fill: float = 0.5
    key_size: float = 9.0
    warmth: float = 0.25
    wall: Triple = (0.66, 0.70, 0.72)
    floor: Triple = (0.55, 0.50, 0.45)
    wall_distance: float = 1.7
    gloss: float = 0.35
    noise: float = 1.6
    vignette: float = 0.16
    seed: int = 0
    variant: str = "auto"
    threads: int = 0

    def __post_init__(self) -> None:
        if not (
            self.distance > 0.5
            and 0 < self.fill_frame <= 1
            and self.height > 0
            and self.wall_distance > 0.3
        ):
            raise InputError(
                "expected distance > 0.5 m, height > 0, wall_distance > 0.3 m and fill_frame in "
                "(0, 1]"
            )
        if min(self.key, self.fill, self.noise, self.vignette, self.gloss) < 0:
            raise InputError("light, noise, vignette and gloss must not be negative")


@dataclass(frozen=True, kw_only=True)
class Portrait(Record):
    """A picture with ground truth.

    Attributes
    ----------
    image : (H, W, 3) uint8
        sRGB.
    mask : (H, W) float32
        The person's coverage of each pixel, exact up to sampling.
    camera : ViewCamera
        Its camera, in the surface's frame.
    """

    image: ByteArray
    mask: FloatArray
    camera: ViewCamera


def portrait_camera(vertices: FloatArray, settings: PortraitSettings) -> ViewCamera:
    """Return the camera of `take_portrait`: all of `vertices` (V, 3) are centered in the
    picture."""
    points = np.asarray(vertices, np.float64)
    yaw = np.radians(settings.yaw)
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    origin = np.array(
        [
            middle[0] + settings.distance * np.sin(yaw),
            settings.height,
            middle[2] + settings.distance * np.cos(yaw),
        ]
    )
    target = middle
    fov = 30.0
    for _ in range(
        8
    ):  # the aim and the field of view that center the person depend slightly on each other
        camera = ViewCamera(origin=_triple(origin), target=_triple(target), fov=fov)
        plane = (points - origin) @ camera.axes.T
        slopes = plane[:, :2] / -plane[:, 2:]
        least, most = slopes.min(axis=0), slopes.max(axis=0)
        target = target + camera.axes[:2].T @ ((least + most) / 2) * np.linalg.norm(target - origin)
        half = max(float(most[1] - least[1]), float(most[0] - least[0])) / 2 / settings.fill_frame
        fov = float(np.degrees(2 * np.arctan(half)))
    return ViewCamera(origin=_triple(origin), target=_triple(target), fov=fov)


def take_portrait(surface: Surface, settings: PortraitSettings = PortraitSettings()) -> Portrait:
    """Take a photograph of a person who stands on y = 0.

    Parameters
    ----------
    surface : Surface
        The person, posed (`Avatar.surface`), meters, facing +z.
    settings : PortraitSettings

    Returns
    -------
    Portrait
        The same settings give the same picture (up to the renderer's rounding, well under one
        level).
    """
    scene = LookSettings(
        background=_triple(np.clip(linear_to_srgb(np.full(3, settings.fill)), 0, 1)),
        sun=_triple(settings.key * (1 + 0.25 * settings.warmth * np.array([0.6, -0.05, -1.0]))),
        sun_direction=settings.key_direction,
        sun_angle=settings.key_size,
        grid=0,
    )
    material = {
        "type": "principled",
        "base_color": "surface",
        "roughness": 0.55,
        "specular": min(1.0, settings.gloss),
    }
    render = RenderSettings(
        size=settings.size,
        spp=settings.spp,
        variant=settings.variant,
        threads=settings.threads,
        seed=settings.seed,
    )
    mi = activate(settings.variant, settings.threads)
    renderer = Renderer(surface, render, scene, bsdf=material, extra=_room(mi, settings))
    camera = portrait_camera(surface.vertices, settings)
    linear = renderer.linear(surface.vertices, camera)
    image = _develop(linear, settings)
    return Portrait(
        image=image,
        mask=renderer.mask(surface.vertices, camera, samples=64),
        camera=camera,
        provenance={
            **surface.provenance,
            "settings": {
                k: v for k, v in dataclasses.asdict(settings).items() if k != "provenance"
            },
        },
    )


def _room(mi: Any, settings: PortraitSettings) -> dict[str, Any]:
    """Return floor and wall with a round corner behind the person, in place of the stage's ground;
    no spot light."""
    yaw = np.radians(settings.yaw)
    # profile in (depth behind the person, height): floor toward the camera, a quarter circle, the
    # wall
    radius = 0.12
    corner = np.linspace(0, np.pi / 2, 13)
    depth = np.concatenate(
        [
            [-14.0],
            settings.wall_distance - radius + radius * np.sin(corner),
            [settings.wall_distance],
        ]
    )
    height = np.concatenate([[0.0], radius - radius * np.cos(corner), [7.0]])
    across = np.array([-12.0, 12.0])
    away, side = np.array([-np.sin(yaw), 0, -np.cos(yaw)]), np.array([np.cos(yaw), 0, -np.sin(yaw)])
    grid = (
        depth[:, None, None] * away
        + across[None, :, None] * side
        + height[:, None, None] * np.array([0, 1.0, 0])
    )
    length = np.concatenate([[0], np.cumsum(np.hypot(np.diff(depth), np.diff(height)))])
    rows = np.arange(len(depth) - 1)
    quads = np.stack([2 * rows, 2 * rows + 1, 2 * rows + 3, 2 * rows + 2], axis=1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    uv = np.stack(
        np.broadcast_arrays(np.array([0.0, 1.0]), (length / length[-1])[:, None]), axis=-1
    )
    properties = mi.Properties()
    texture = {
        "type": "bitmap",
        "bitmap": mi.Bitmap(_room_texture(settings, length)),
        "filter_type": "bilinear",
        "wrap_mode": "clamp",
    }
    properties["bsdf"] = mi.load_dict(
        {"type": "twosided", "inside": {"type": "diffuse", "reflectance": texture}}
    )
    mesh = mi.Mesh("room", grid.size // 3, len(faces), has_vertex_texcoords=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = grid.astype(np.float32).ravel()
    parameters["vertex_texcoords"] = uv.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return {"ground": mesh, "horizon": None, "spot": None}


def _room_texture(settings: PortraitSettings, length: FloatArray, pixels: int = 1024) -> ByteArray:
    """Return sRGB (pixels, pixels, 3) along the room's profile: colors of floor and wall with soft,
    uneven patches and grain."""
    from scipy.ndimage import gaussian_filter

    generator = np.random.default_rng(settings.seed)
    total = float(length[-1])
    along = (np.arange(pixels) + 0.5) / pixels * total
    foot = float(length[-2] + length[1]) / 2  # the middle of the round corner
    wall_part = np.clip((along - foot) / 0.05 + 0.5, 0, 1)
    color = (
        srgb_to_linear(np.array(settings.floor)) * (1 - wall_part[:, None])
        + srgb_to_linear(np.array(settings.wall)) * wall_part[:, None]
    )
    patches = np.zeros((pixels, pixels))
    for sigma, strength in ((60.0, 0.05), (18.0, 0.03), (3.0, 0.02), (0.7, 0.02)):
        layer = gaussian_filter(generator.standard_normal((pixels, pixels)), sigma, mode="wrap")
        patches += strength * layer / layer.std()
    image = color[:, None] * (1 + patches[..., None])
    return to_bytes(linear_to_srgb(image))


def _develop(linear: FloatArray, settings: PortraitSettings) -> ByteArray:
    """Simulate a camera: a slight bloom of the lens, vignette, noise of the sensor, a gentle tone
    curve."""
    from scipy.ndimage import gaussian_filter

    size = linear.shape[0]
    generator = np.random.default_rng(settings.seed + 1)
    # lenses are not perfectly sharp, and spread a little light
    sharp = gaussian_filter(linear, (0.45, 0.45, 0))
    light = 0.97 * sharp + 0.03 * gaussian_filter(linear, (size / 60, size / 60, 0))
    at = (np.arange(size) + 0.5) / size * 2 - 1
    light = (
        light
        * (1 - settings.vignette * np.clip((at[:, None] ** 2 + at[None, :] ** 2) / 2, 0, 1))[
            ..., None
        ]
    )
    # photon noise grows with the square root of the light; coarse as after a camera's denoising
    grain = gaussian_filter(generator.standard_normal(light.shape), (0.6, 0.6, 0))
    encoded = linear_to_srgb(_shoulder(light))
    return to_bytes(encoded + settings.noise / 255 * grain / grain.std() * (1.2 - 0.8 * encoded))


def _shoulder(light: FloatArray, start: float = 0.7) -> FloatArray:
    """Compress highlights smoothly above `start` instead of clipping them at 1."""
    room = 1 - start
    over = np.maximum(light - start, 0)
    return np.where(light > start, start + room * (1 - np.exp(-over / room)), light)


def _triple(vector: FloatArray) -> Triple:
    x, y, z = (float(value) for value in vector)
    return x, y, z
