"""The stage: the ground, a sun and a spot light above it, and a fill light from all directions."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear, to_bytes
from a2v.geometry.steps import smoothstep
from a2v.record import Record
from a2v.rendering.lights import DiskLight, spot_disk, sun_disk
from a2v.types import ByteArray, FloatArray

Triple = tuple[float, float, float]

FINEST = 0.05
"""Width of the finest patches of a mottled ground, meters (four texels)."""


@dataclass(frozen=True, kw_only=True)
class LookSettings(Record):
    """Lights, ground and background.

    Directions are world axes (y up, the person faces +z, its left is +x). Irradiance is given over
    pi: 1 makes a white surface that faces the light exactly white.

    Attributes
    ----------
    background : tuple of 3 float
        sRGB in [0, 1] of the backdrop, which is also the constant light from all directions (the
        fill light). The ground's albedo follows from it: far from the spot light, lit ground has
        the backdrop's color, so that the horizon is invisible.
    zenith : tuple of 3 float or None
        sRGB in [0, 1] of the sky overhead. The sky blends from the background's color at the
        horizon to this one. None: the background's color everywhere.
    haze : float
        Scale of that blend: the sine of the elevation at which it has reached 63 %.
    ground : tuple of 3 float or None
        sRGB reflectance of the ground near the origin. It blends into the reflectance that follows
        from `background` toward `ground_radius`. None: that one everywhere.
    sun : tuple of 3 float
        Irradiance over pi (linear RGB) of the directional light on a surface that faces it.
    sun_direction : tuple of 3 float
        Towards it.
    sun_angle : float
        Angular radius, degrees: the softness of its shadows (the real sun's is 0.27).
    spot : tuple of 3 float
        Irradiance over pi (linear RGB) of the spot light at the character.
    spot_position : tuple of 3 float
        Position relative to the ground point below the camera's target, meters. The light follows
        the character.
    spot_radius : float
        Radius of its disk, meters: the softness of its shadows.
    grid : float
        Distance between the lines on the ground, meters; they make travel visible. 0: no lines.
    grid_contrast : float
        Fraction by which the lines are darker than the ground.
    mottle : float
        Standard deviation of the ground's irregular lightness (grass, sand, asphalt), a fraction of
        its albedo; 0: none.
    mottle_size : float
        Width of its largest patches, meters; the finest are `FINEST`.
    ground_radius : float
        Half the side of the ground, meters; the lines fade towards it.
    gloss : bool
        True: skin and eyes are glossy, and shadow borders on skin are soft
        (`a2v.rendering.matter`). False: all is matte.
    bounces : int
        Path length: 1 is direct light only, 2 includes light reflected once.
    """

    background: Triple = (0.77, 0.79, 0.81)
    zenith: Triple | None = None
    haze: float = 0.2
    ground: Triple | None = None
    sun: Triple = (0.74, 0.69, 0.62)
    sun_direction: Triple = (0.55, 1.15, 0.8)
    sun_angle: float = 3.0
    spot: Triple = (0.55, 0.56, 0.58)
    spot_position: Triple = (-1.6, 4.2, -2.6)
    spot_radius: float = 0.35
    grid: float = 0.5
    grid_contrast: float = 0.16
    mottle: float = 0.0
    mottle_size: float = 1.2
    ground_radius: float = 12.0
    gloss: bool = True
    bounces: int = 2

    def __post_init__(self) -> None:
        shown = np.array(
            [self.background, self.zenith or self.background, self.ground or self.background]
        )
        colors = np.concatenate([shown, [self.sun, self.spot]])
        if not np.isfinite(colors).all() or colors.min() < 0 or shown.max() > 1:
            raise InputError(
                "light must be finite and not negative, and background, zenith and ground sRGB in "
                "[0, 1]"
            )
        if not 0.01 <= self.haze <= 10:
            raise InputError(f"haze is {self.haze}; expected 0.01 to 10")
        if self.sun_direction[1] <= 0 or self.spot_position[1] <= 0:
            raise InputError(
                "the sun and the spot light must be above the ground; give their y a positive value"
            )
        if not 0 <= self.mottle <= 0.35 or not FINEST <= self.mottle_size <= self.ground_radius:
            raise InputError(
                f"mottle is {self.mottle}, mottle_size {self.mottle_size} m; expected 0 to 0.35, "
                f"and {FINEST} m to ground_radius"
            )
        if (
            not 0 < self.sun_angle < 45
            or self.spot_radius <= 0
            or self.ground_radius <= 0
            or self.grid < 0
            or self.bounces < 1
        ):
            raise InputError(
                "expected sun_angle in (0, 45), positive spot_radius, ground_radius and bounces, "
                "grid >= 0"
            )

    @property
    def sun_light(self) -> DiskLight:
        """Disk of the sun."""
        return sun_disk(np.array(self.sun_direction), self.sun_angle, np.array(self.sun))

    def spot_light(self, target: Triple = (0.0, 0.0, 0.0)) -> DiskLight:
        """Return the spot light above `target`, meters; only the ground position of `target`
        matters."""
        return spot_disk(
            np.array(self.spot_position),
            self.spot_radius,
            np.array(self.spot),
            target=np.array(target),
        )

    @property
    def fill(self) -> FloatArray:
        """Linear light (3,) of the sky at the horizon."""
        return np.asarray(np.maximum(srgb_to_linear(np.array(self.background)), 1e-3))

    def sky(self, rise: FloatArray) -> FloatArray:
        """Return the sky's linear light (..., 3) in directions whose sine of elevation is `rise`
        (...).

        Below the horizon it is the horizon's.
        """
        if self.zenith is None:
            return np.broadcast_to(self.fill, (*np.shape(rise), 3))
        over = 1 - np.exp(-np.maximum(np.asarray(rise), 0) / self.haze)
        return np.asarray(self.fill + over[..., None] * (self._overhead - self.fill))

    @property
    def sky_on_ground(self) -> FloatArray:
        """Irradiance over pi (3,) of the whole sky on open ground: the integral of `sky` times
        twice the sine of elevation."""
        if self.zenith is None:
            return self.fill
        low = 2 * (self.haze**2 - np.exp(-1 / self.haze) * (self.haze**2 + self.haze))
        return np.asarray(self._overhead + low * (self.fill - self._overhead))

    @property
    def _overhead(self) -> FloatArray:
        return np.asarray(np.maximum(srgb_to_linear(np.array(self.zenith)), 1e-3))

    @property
    def ground_albedo(self) -> FloatArray:
        """Linear albedo (3,) at which sunlit open ground is as bright as the backdrop."""
        slope = self.sun_direction[1] / float(np.linalg.norm(self.sun_direction))
        return np.asarray(
            np.minimum(self.fill / (self.sky_on_ground + slope * np.array(self.sun)), 0.98),
            np.float32,
        )

    @property
    def plain_ground(self) -> bool:
        """Whether the ground has the same albedo everywhere."""
        return self.ground is None and not self.is_patterned

    @property
    def is_patterned(self) -> bool:
        """Whether lines or irregular lightness change the ground's albedo."""
        return (self.grid > 0 and self.grid_contrast > 0) or self.mottle > 0

    def ground_at(self, place: FloatArray) -> FloatArray:
        """Return the linear albedo (..., 3) of the ground without its lines at `place` (..., 2), x
        and z in meters."""
        beyond = self.ground_albedo
        if self.ground is None:
            return np.broadcast_to(beyond, (*place.shape[:-1], 3))
        share = _fade(np.hypot(place[..., 0], place[..., 1]) / self.ground_radius)[..., None]
        return np.asarray(
            beyond + share * (srgb_to_linear(np.array(self.ground)) - beyond), np.float32
        )


def stage(mi: Any, look: LookSettings) -> dict[str, Any]:
    """Return ground and lights as a Mitsuba dictionary."""
    transform = mi.ScalarTransform4f
    # A distant disk is a directional light with soft shadows. (A bright patch in an environment map
    # is noisier: one sample would have to choose between the sun and the sky.)
    sun, spot = look.sun_light, look.spot_light()
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.0, 0.0, 0.0]}}
    objects: dict[str, Any] = {
        "ground": {
            "type": "rectangle",
            "to_world": transform().rotate([1, 0, 0], -90).scale(look.ground_radius),
            "bsdf": {"type": "diffuse", "reflectance": _ground_texture(mi, look)},
        },
        "horizon": {  # extends the ground; slightly lower, so that rays do not hit both
            "type": "rectangle",
            "to_world": transform().translate([0, -0.002, 0]).rotate([1, 0, 0], -90).scale(100.0),
            "bsdf": {
                "type": "diffuse",
                "reflectance": {"type": "rgb", "value": look.ground_albedo.tolist()},
            },
        },
        "fill": _sky(mi, look),
        "sun": {
            "type": "disk",
            "to_world": transform()
            .look_at(origin=sun.center.tolist(), target=[0, 0, 0], up=[0, 0, 1])
            .scale(sun.radius),
            "bsdf": black,
            "light": {"type": "area", "radiance": {"type": "rgb", "value": sun.radiance.tolist()}},
        },
    }
    if max(look.spot) > 0:  # a dark spot light would still cast a shadow
        objects["spot"] = {
            "type": "disk",
            "to_world": transform(spot.matrix),
            "bsdf": black,
            "light": {"type": "area", "radiance": {"type": "rgb", "value": spot.radiance.tolist()}},
        }
    return objects


def _sky(mi: Any, look: LookSettings) -> dict[str, Any]:
    if look.zenith is None:
        return {"type": "constant", "radiance": {"type": "rgb", "value": look.fill.tolist()}}
    rows = 256  # a picture of the whole sphere; row 0 is overhead
    picture = look.sky(np.cos((np.arange(rows) + 0.5) / rows * np.pi))[:, None].repeat(8, axis=1)
    return {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(picture, np.float32))}


def _ground_texture(mi: Any, look: LookSettings) -> dict[str, Any]:
    if look.plain_ground:
        return {"type": "rgb", "value": look.ground_albedo.tolist()}
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(grid_texture(look))),
        "filter_type": "bilinear",
        "wrap_mode": "clamp",
        "raw": False,
    }


def ground_pattern(look: LookSettings, pixels: int = 2048) -> FloatArray:
    """Return the factor (pixels, pixels) on the ground's albedo: faint lines and irregular
    lightness that fade toward the rim.

    Rows go along z and columns along x.
    """
    if not look.is_patterned:
        return np.ones((pixels, pixels))
    at, pixel = _texels(look, pixels), 2 * look.ground_radius / pixels
    change = look.mottle * _mottle(look, pixels) if look.mottle > 0 else np.zeros((pixels, pixels))
    if look.grid > 0:
        off = np.abs(
            (at + look.grid / 2) % look.grid - look.grid / 2
        )  # distance to the nearest line
        line = np.clip(1.25 - off / pixel, 0, 1)
        change = change - look.grid_contrast * np.maximum(line[:, None], line[None, :])
    radius = np.hypot(at[:, None], at[None, :]) / look.ground_radius
    return np.asarray(np.maximum(1 + change * _fade(radius), 0.05))


def _mottle(look: LookSettings, pixels: int) -> FloatArray:
    """Return noise (pixels, pixels) of mean 0 and standard deviation 1 with patches of several
    sizes.

    The sizes are `mottle_size` and its halves down to `FINEST`.
    """
    import cv2

    generator, size = np.random.default_rng(0), look.mottle_size
    noise = np.zeros((pixels, pixels), np.float32)
    while size >= FINEST:
        cells = max(2, round(2 * look.ground_radius / size))
        coarse = generator.standard_normal((cells, cells)).astype(np.float32)
        noise += np.float32(size**0.4) * cv2.resize(
            coarse, (pixels, pixels), interpolation=cv2.INTER_CUBIC
        )
        size /= 2
    return np.asarray(np.clip((noise - noise.mean()) / noise.std(), -2.5, 2.5))


@functools.lru_cache(maxsize=4)
def grid_texture(look: LookSettings, pixels: int = 2048) -> ByteArray:
    """Return the ground's sRGB texture (pixels, pixels, 3), which cannot be written to: columns
    along x, rows along -z, as Mitsuba maps it."""
    pattern = ground_pattern(look, pixels)
    if look.ground is None:  # most of it has one color
        albedo, changed = np.asarray(look.ground_albedo, float), pattern != 1
        texture = np.empty((pixels, pixels, 3), np.uint8)
        texture[:] = to_bytes(linear_to_srgb(albedo))
        texture[changed] = to_bytes(linear_to_srgb(albedo * pattern[changed][:, None]))
    else:
        at = _texels(look, pixels).astype(np.float32)
        place = np.stack(np.broadcast_arrays(at, at[:, None]), axis=-1)
        texture = to_bytes(linear_to_srgb(look.ground_at(place) * pattern[..., None]))
    texture.flags.writeable = False
    return texture[::-1]


def _texels(look: LookSettings, pixels: int) -> FloatArray:
    """Positions of the texels of the ground's texture along one side, meters."""
    return (np.arange(pixels) + 0.5) / pixels * 2 * look.ground_radius - look.ground_radius


def _fade(radius: FloatArray) -> FloatArray:
    """Return 1 in the middle of the ground, falling to 0 at its rim; `radius` is a fraction of half
    its side."""
    return smoothstep((0.85 - radius) / 0.6, 0, 1)
