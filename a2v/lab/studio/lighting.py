"""Light, backgrounds and the sensor of the fast studio: all steps from a ray's hit to a JPEG."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.rays import RayScene
from a2v.geometry.sampling import cosine_directions
from a2v.types import ByteArray, FloatArray


@dataclass(frozen=True)
class Lamp:
    """A distant light.

    Attributes
    ----------
    direction : (3,) float
        Direction to the light, unit.
    color : (3,) float
        Irradiance over pi on a surface that faces it.
    spread : float
        Standard deviation of its directions, radians: the softness of its shadows.
    """

    direction: FloatArray
    color: FloatArray
    spread: float


@dataclass(frozen=True)
class Light:
    """Light of one photograph: a first-order environment, and distant lights.

    The radiance of the environment from direction w is ``ambient + gradient . w`` (per channel,
    never negative).

    Attributes
    ----------
    ambient : (3,) float
    gradient : (3, 3) float
        Axes by channels.
    lamps : tuple of Lamp
    gloss : float
        Strength of highlights.
    """

    ambient: FloatArray
    gradient: FloatArray
    lamps: tuple[Lamp, ...]
    gloss: float

    @classmethod
    def draw(cls, generator: np.random.Generator) -> Light:
        """Draw a light between an overcast day, a room with lamps and hard sun."""
        ambient = generator.uniform(0.25, 1.0) * _tint(generator, 0.06)
        up = generator.uniform(-0.1, 0.75)
        slopes = np.array([generator.normal(0, 0.25), up, generator.normal(0.1, 0.25)])
        gradient = slopes[:, None] * ambient * np.stack([_tint(generator, 0.08) for _ in range(3)])
        lamps: list[Lamp] = []
        for index in range(int(generator.integers(1, 4))):
            azimuth = (
                generator.uniform(-85, 85)
                if generator.random() < 0.85
                else generator.uniform(95, 265)
            )
            elevation = np.radians(generator.uniform(8, 75))
            azimuth = np.radians(azimuth)
            direction = np.array(
                [
                    np.cos(elevation) * np.sin(azimuth),
                    np.sin(elevation),
                    np.cos(elevation) * np.cos(azimuth),
                ]
            )
            strength = generator.uniform(0.15, 1.5) * (1.0 if index == 0 else 0.5)
            lamps.append(
                Lamp(
                    direction,
                    strength * _tint(generator, 0.1),
                    float(np.radians(generator.uniform(1.5, 14))),
                )
            )
        return cls(
            ambient,
            gradient,
            tuple(lamps),
            float(generator.choice([0.0, generator.uniform(0.0, 0.12)])),
        )

    def environment(self, directions: FloatArray) -> FloatArray:
        """Return the radiance (n, 3) from directions (n, 3)."""
        return np.asarray(np.maximum(self.ambient + directions @ self.gradient, 0))

    def ambient_irradiance(self, normals: FloatArray) -> FloatArray:
        """Return the irradiance over pi (n, 3) of the whole environment on surfaces with normals
        (n, 3)."""
        return np.asarray(
            np.maximum(self.ambient + (2 / 3) * (normals @ self.gradient), 0.02 * self.ambient)
        )


def _tint(generator: np.random.Generator, spread: float) -> FloatArray:
    """Draw a color cast (3,), mostly between warm and cold."""
    warm = generator.normal(0, spread)
    return np.asarray(np.exp([warm, generator.normal(0, 0.25 * spread), -warm]))


@dataclass(frozen=True)
class Shadows:
    """Fractions of the light that reach points.

    Attributes
    ----------
    ambient : (n,) float32
        Fraction of the environment's light.
    lamps : (L, n) float32
        Fraction of each lamp's light.
    """

    ambient: FloatArray
    lamps: FloatArray


def cast_shadows(
    scene: RayScene,
    points: FloatArray,
    normals: FloatArray,
    light: Light,
    generator: np.random.Generator,
    *,
    rays: int = 6,
    lamp_rays: int = 3,
) -> Shadows:
    """Trace ambient occlusion and soft shadows at points (n, 3) with unit normals, by a few random
    rays each.

    The result is noisy and has to be smoothed in the image.
    """
    start = points + 2e-3 * normals
    reach, free = np.zeros(len(points)), np.zeros(len(points))
    for _ in range(rays):
        direction = cosine_directions(normals, generator)
        radiance = light.environment(direction).mean(axis=1)
        reach += radiance
        free += radiance * ~scene.occluded(start, direction)
    lamps = []
    for lamp in light.lamps:
        facing = np.flatnonzero(normals @ lamp.direction > 0)
        lit = np.zeros(len(points))
        for _ in range(lamp_rays):
            direction = lamp.direction + lamp.spread * generator.standard_normal((len(facing), 3))
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
            lit[facing] += ~scene.occluded(start[facing], direction)
        lamps.append(lit / lamp_rays)
    return Shadows(
        (free / np.maximum(reach, 1e-9)).astype(np.float32), np.asarray(lamps, np.float32)
    )


def irradiance(light: Light, normals: FloatArray, shadows: Shadows) -> FloatArray:
    """Return the irradiance over pi (n, 3): the radiance of a white matte surface."""
    total = light.ambient_irradiance(normals) * shadows.ambient[:, None]
    for lamp, reach in zip(light.lamps, shadows.lamps, strict=True):
        total = total + (np.maximum(normals @ lamp.direction, 0) * reach)[:, None] * lamp.color
    return np.asarray(total)


def highlights(light: Light, normals: FloatArray, shadows: Shadows) -> FloatArray:
    """Return the light (n, 3) that a slightly glossy surface reflects toward +z (Blinn-Phong)."""
    total = np.zeros_like(normals, dtype=np.float64)
    if light.gloss > 0:
        for lamp, reach in zip(light.lamps, shadows.lamps, strict=True):
            half = lamp.direction + np.array([0.0, 0.0, 1.0])
            half = half / max(float(np.linalg.norm(half)), 1e-9)
            total += (light.gloss * 4 * np.maximum(normals @ half, 0) ** 24 * reach)[
                :, None
            ] * lamp.color
    return total


def background(size: int, feet: float, generator: np.random.Generator) -> FloatArray:
    """Draw a background, linear light (size, size, 3): wall and floor, gradients, textures of
    several scales, blurred shapes.

    Parameters
    ----------
    feet : float
        Row of the person's feet, pixels; the floor begins above it.
    """
    import cv2

    small = size // 2
    image = np.empty((small, small, 3), np.float32)
    corners = srgb_to_linear(
        np.clip(_color(generator) + generator.normal(0, 0.07, (2, 2, 3)), 0.02, 1)
    ).astype(np.float32)
    image[:] = cv2.resize(corners, (small, small), interpolation=cv2.INTER_LINEAR)
    line = None
    if generator.random() < 0.65:
        line = int(np.clip(feet / 2 - generator.uniform(0.02, 0.4) * small, 0, small - 1))
        floor = srgb_to_linear(
            np.clip(_color(generator) + generator.normal(0, 0.05, (2, 2, 3)), 0.02, 1)
        ).astype(np.float32)
        image[line:] = cv2.resize(floor, (small, small - line), interpolation=cv2.INTER_LINEAR)
    for _ in range(int(generator.integers(0, 14))):
        color = srgb_to_linear(_color(generator)).tolist()
        center, extent = generator.uniform(0, small, 2), generator.uniform(0.02, 0.3, 2) * small
        box = (
            center,
            2 * extent,
            float(generator.uniform(-20, 20) if generator.random() < 0.4 else 0),
        )
        if generator.random() < 0.6:
            cv2.fillConvexPoly(image, cv2.boxPoints(box).astype(np.int32), color)
        else:
            cv2.ellipse(image, box, color, -1)
    image = cv2.GaussianBlur(
        image, (0, 0), float(generator.uniform(0.7, 14) if generator.random() < 0.6 else 0.6)
    )
    texture = np.zeros((small, small), np.float32)
    for cells in (6, 24, 96, small):
        coarse = generator.standard_normal((cells, cells)).astype(np.float32)
        texture += generator.uniform(0, 0.14) * cv2.resize(
            coarse, (small, small), interpolation=cv2.INTER_CUBIC
        )
    image *= np.exp(generator.uniform(0, 1) * texture)[..., None]
    if line is not None:  # the person darkens the floor
        shade = np.zeros((small, small), np.float32)
        middle = (small / 2 + generator.normal(0, 0.04) * small, feet / 2)
        cv2.ellipse(shade, (middle, (0.3 * small, 0.05 * small), 0.0), 1.0, -1)
        shade = cv2.GaussianBlur(shade, (0, 0), 0.02 * small)
        shade[:line] = 0
        image *= (1 - generator.uniform(0, 0.7) * shade)[..., None]
    return np.asarray(cv2.resize(image, (size, size), interpolation=cv2.INTER_LINEAR))


def _color(generator: np.random.Generator) -> FloatArray:
    """Draw an sRGB color (3,), mostly a muted one."""
    import colorsys

    muted = generator.random() < 0.75
    return np.array(
        colorsys.hsv_to_rgb(
            generator.random(),
            generator.uniform(0, 0.35 if muted else 0.9),
            generator.uniform(0.1, 0.98),
        )
    )


@lru_cache(maxsize=1)
def _tone_curve() -> FloatArray:
    """Return a table of sRGB in [0, 1] for linear light in steps of 1/2048, up to 4. Highlights are
    compressed instead of clipped."""
    light = (np.arange(8192) + 0.5) / 2048
    start, room = 0.75, 0.25
    return linear_to_srgb(
        np.where(light > start, start + room * (1 - np.exp(-(light - start) / room)), light)
    )


def develop(linear: FloatArray, generator: np.random.Generator) -> tuple[ByteArray, int]:
    """Simulate a camera on light (H, W, 3): returns sRGB (H, W, 3) uint8, and the quality of its
    JPEG.

    The steps are blur of lens or size, vignette, compressed instead of clipped highlights, and
    noise that grows with the light.
    """
    import cv2

    height, width = linear.shape[:2]
    image = linear.astype(np.float32)
    if generator.random() < 0.25:  # a small picture, enlarged
        share = generator.uniform(0.4, 0.9)
        image = cv2.resize(
            image, (round(share * width), round(share * height)), interpolation=cv2.INTER_AREA
        )
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_CUBIC)
    else:
        image = cv2.GaussianBlur(image, (0, 0), float(generator.uniform(0.3, 1.0)))
    if generator.random() < 0.4:
        at = ((np.arange(width) + 0.5) / width * 2 - 1).astype(np.float32)
        down = ((np.arange(height) + 0.5) / height * 2 - 1).astype(np.float32)
        image = image * (
            1 - generator.uniform(0, 0.25) * (at[None, :, None] ** 2 + down[:, None, None] ** 2) / 2
        )
    encoded = _tone_curve()[np.clip(image * 2048, 0, 8191).astype(np.uint16)]
    noise = np.empty(encoded.shape, np.float32)
    cv2.setRNGSeed(int(generator.integers(2**31)))
    cv2.randn(noise, (0, 0, 0), (1, 1, 1))
    if generator.random() < 0.5:
        noise = 1.8 * cv2.GaussianBlur(noise, (0, 0), 0.7)
    encoded += abs(generator.normal(0, 2.5)) / 255 * noise * (1.2 - 0.7 * encoded)
    return np.rint(255 * np.clip(encoded, 0, 1)).astype(np.uint8), int(generator.integers(70, 97))
