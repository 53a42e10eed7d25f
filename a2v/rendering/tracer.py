"""Light on the stage, ray by ray, for chosen pixels: every sample asks the sun, the lamp and one direction of the sky.

Mitsuba's path integrator picks one of the lights for a sample; asking all of them costs about the same number of rays and is
far less noisy, and a list of pixels instead of a picture leaves out what nobody touches. Dr.Jit compiles it once (LLVM only).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.matter import Hit
from a2v.rendering.scene import SUN_DISTANCE, SceneSettings, spot_matrix
from a2v.types import FloatArray, IntArray

_MOST = 1 << 22
"""Samples of one launch; more are traced in parts."""


@dataclass(frozen=True, kw_only=True)
class Traced:
    """Means over the samples of each of N pixels, float32.

    `color` (N, 3) is linear light times `alpha`, `albedo` (N, 3) and `normal` (N, 3) those of what is hit first times `alpha`;
    `alpha` (N,) is the fraction of samples that hit anything, `person` (N,) that hit the person.
    """

    color: FloatArray
    albedo: FloatArray
    normal: FloatArray
    alpha: FloatArray
    person: FloatArray


class Tracer:
    """Traces pixels of one Mitsuba scene whose lights are the stage's (`a2v.rendering.scene.stage`); light once reflected.

    `matter` (F,) says what the person's faces are (`a2v.rendering.matter`); without it all is matt.
    """

    def __init__(self, mi: Any, scene: Any, person: Any, settings: SceneSettings, matter: FloatArray | None = None) -> None:
        self._mi, self._scene, self._person, self._settings = mi, scene, person, settings
        self._matter = None if matter is None else mi.Float(matter.astype(np.float32))
        self._table: Any = None

    def trace(self, pixels: IntArray, samples: IntArray, camera: ViewCamera, size: int, seed: int) -> Traced:
        """Trace `pixels` (N,), row * size + column, with as many samples each as `samples` (N,) says: best with a large common divisor.

        A pixel's samples depend on its place, their number and the seed alone, whatever else is traced beside it.
        """
        block = int(np.gcd.reduce(samples))
        repeat = samples // block
        pixel, mask = np.repeat(pixels, repeat), np.repeat((1 << np.ceil(np.log2(samples)).astype(np.int64)) - 1, repeat)
        first = (np.arange(len(pixel)) - np.repeat(np.cumsum(repeat) - repeat, repeat)) * block
        step = max(1, _MOST // block)
        parts = [
            self._launch(pixel[at : at + step], first[at : at + step], mask[at : at + step], block, camera, size, seed)
            for at in range(0, len(pixel), step)
        ]
        sums = np.add.reduceat(np.concatenate(parts, axis=1), np.cumsum(repeat) - repeat, axis=1) / samples
        means = np.ascontiguousarray(sums.T, np.float32)
        return Traced(color=means[:, :3], albedo=means[:, 3:6], normal=means[:, 6:9], alpha=means[:, 9], person=means[:, 10])

    def _launch(self, pixel: IntArray, first: IntArray, mask: IntArray, block: int, camera: ViewCamera, size: int, seed: int) -> FloatArray:
        """Sums (11, K) over `block` samples from number `first` (K,) on."""
        import drjit as dr

        mi = self._mi
        count = _whole(mi, block)
        lane = dr.arange(mi.UInt32, len(pixel) * block)
        slot = lane // count
        given = [dr.gather(mi.UInt32, mi.UInt32(part.astype(np.uint32)), slot) for part in (pixel, first, mask)]
        draws = _Draws(mi, given[1] + lane % count, given[0], given[2], _whole(mi, seed), self._sobol(mi, int(mask.max()) + 1))
        ray = _primary(mi, given[0], draws.next(), camera, size)
        found = self._light(mi, ray, draws, _Lamps.of(mi, self._settings, camera))
        dr.eval(found)
        return np.stack([np.array(dr.block_sum(part, block)) for part in found])

    def _light(self, mi: Any, ray: Any, draws: _Draws, lamps: _Lamps) -> list[Any]:
        """Light, albedo (3 each), normal (3), hit and person along camera rays."""
        import drjit as dr

        si = self._scene.ray_intersect(ray)
        hit = si.is_valid() & ~si.shape.is_emitter()
        albedo, normal = _matter(si, hit)
        person = hit & (si.shape == mi.ShapePtr(self._person))
        made = None if self._matter is None else Hit.of(mi, self._matter, si, person, normal, ray)
        light, gloss = mi.Color3f(0), mi.Color3f(0)
        for power, lamp in ((self._settings.sun, lamps.sun), (self._settings.spot, lamps.spot)):
            draw = draws.next()
            if max(power) > 0:
                matt, bright = lamp(self._scene, si, normal, draw, hit, made)
                light, gloss = light + matt, gloss + bright
        bounce = si.spawn_ray(mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(draws.next())))
        second = self._scene.ray_intersect(bounce, hit)
        free = hit & ~second.is_valid()
        light += dr.select(free, lamps.sky(bounce.d), 0.0)
        if made is not None:
            way, share = made.mirrored()
            gloss += dr.select(free, share * lamps.sky(way), 0.0)
        if self._settings.bounces > 1:
            struck = hit & second.is_valid()
            other, facing = _matter(second, struck)
            light += dr.select(struck, other * lamps.any(self._scene, second, facing, draws.next(), struck), 0.0)
        color, flag = dr.select(hit, light * albedo + gloss, 0.0), dr.select(hit, mi.Float(1), 0.0)
        albedo, normal = dr.select(hit, albedo, 0.0), dr.select(hit, normal, 0.0)
        return [*color, *albedo, *normal, flag, dr.select(person, mi.Float(1), 0.0)]

    def _sobol(self, mi: Any, least: int) -> Any:
        """The second dimension of Sobol's sequence, at least the first `least` numbers."""
        if self._table is None or len(self._table) < least:
            index = np.arange(max(64, least))
            value, direction = np.zeros_like(index), 1 << 31
            while index.any():
                value ^= np.where(index & 1, direction, 0)
                index, direction = index >> 1, direction ^ (direction >> 1)
            self._table = mi.UInt32(value.astype(np.uint32))
        return self._table


class _Draws:
    """Points of Sobol's sequence in the square, scrambled anew for each pixel and each pair of dimensions: stratified within a pixel."""

    def __init__(self, mi: Any, index: Any, pixel: Any, mask: Any, seed: Any, table: Any) -> None:
        self._mi, self._index, self._mask, self._table = mi, index, mask, table
        self._key, _ = mi.sample_tea_32(pixel, seed)
        self._pair = 0

    def next(self) -> Any:
        """The next Point2f in [0, 1)."""
        import drjit as dr

        self._pair += 1
        one, two = self._mi.sample_tea_32(self._key, self._mi.UInt32(self._pair))
        at = self._index ^ ((two >> 7) & self._mask)  # another order in every pair, or pairs would go together
        bits = dr.brev(at) ^ one, dr.gather(self._mi.UInt32, self._table, at) ^ two
        return self._mi.Point2f(*(self._mi.Float(part >> 8) * (1 / (1 << 24)) for part in bits))


@dataclass(frozen=True, kw_only=True)
class _Lamps:
    """Sun, lamp and fill light as the scene has them; powers are irradiance over pi times distance squared over cosines;
    `fill` is the sky's light overhead, `rest` what the horizon's has more."""

    mi: Any
    centre: tuple[Any, Any]
    across: tuple[tuple[Any, Any], tuple[Any, Any]]
    normal: tuple[Any, Any]
    power: tuple[Any, Any]
    fill: Any
    rest: Any
    haze: Any

    @classmethod
    def of(cls, mi: Any, scene: SceneSettings, camera: ViewCamera) -> _Lamps:
        """The lamp follows the camera's target."""
        sun = np.array(scene.sun_direction) / np.linalg.norm(scene.sun_direction)
        radius = SUN_DISTANCE * float(np.tan(np.radians(scene.sun_angle)))
        side = np.cross(sun, (0.0, 0.0, 1.0) if abs(sun[2]) < 0.9 else (1.0, 0.0, 0.0))
        side *= radius / np.linalg.norm(side)
        matrix = spot_matrix(camera.target, scene)
        reach = float(np.linalg.norm(np.subtract(scene.spot_position, (0.0, 0.9, 0.0))))
        powers = np.array(scene.sun) * (SUN_DISTANCE**2 + radius**2), np.array(scene.spot) * (reach**2 + scene.spot_radius**2)
        vectors = [
            sun * SUN_DISTANCE,
            side,
            np.cross(sun, side),
            -sun,
            matrix[:3, 3],
            matrix[:3, 0],
            matrix[:3, 1],
            matrix[:3, 2] / scene.spot_radius,
        ]
        c, a, b, n, sc, sa, sb, sn = (mi.Vector3f(*_numbers(mi, value)) for value in vectors)
        overhead = scene.sky(np.array(np.inf))
        sun_power, spot_power, fill, rest = (mi.Color3f(*_numbers(mi, v)) for v in (*powers, overhead, scene.fill - overhead))
        return cls(
            mi=mi, centre=(c, sc), across=((a, b), (sa, sb)), normal=(n, sn), power=(sun_power, spot_power), fill=fill, rest=rest,
            haze=None if scene.zenith is None else _number(mi, -1 / scene.haze),
        )  # fmt: skip

    def sky(self, way: Any) -> Any:
        """Light from the sky in directions `way` (`SceneSettings.sky`)."""
        import drjit as dr

        return self.fill if self.haze is None else self.fill + self.rest * dr.exp(dr.maximum(way.y, 0) * self.haze)

    def sun(self, scene: Any, si: Any, normal: Any, draw: Any, active: Any, made: Hit | None = None) -> tuple[Any, Any]:
        """What the sun gives, one sample: irradiance over pi, and light that what is there (`made`) mirrors."""
        return self._one(0, scene, si, normal, draw, active, made)

    def spot(self, scene: Any, si: Any, normal: Any, draw: Any, active: Any, made: Hit | None = None) -> tuple[Any, Any]:
        """What the lamp gives, as `sun`."""
        return self._one(1, scene, si, normal, draw, active, made)

    def _one(self, which: int, scene: Any, si: Any, normal: Any, draw: Any, active: Any, made: Hit | None) -> tuple[Any, Any]:
        import drjit as dr

        disk = self.mi.warp.square_to_uniform_disk_concentric(draw)
        way = self.centre[which] + self.across[which][0] * disk.x + self.across[which][1] * disk.y - self.mi.Vector3f(si.p)
        square = dr.squared_norm(way)
        length = dr.sqrt(square)
        way /= length
        here, there = dr.dot(way, normal), -dr.dot(way, self.normal[which])
        active = active & (here > (0 if made is None else made.least())) & (there > 0)
        ray = si.spawn_ray(way)
        if made is not None:
            ray = made.raised(ray)
        ray.maxt = length * (1 - 1e-3)
        light = dr.select(active & ~scene.ray_test(ray, active), self.power[which] * (there / square), 0.0)
        return (light * here, self.mi.Color3f(0)) if made is None else (light * made.falloff(here), light * made.gloss(way, here))

    def any(self, scene: Any, si: Any, normal: Any, draw: Any, active: Any) -> Any:
        """Irradiance over pi from all three, one sample of one of them (what is reflected there counts little in the end)."""
        import drjit as dr

        pick = draw.x * 3
        chosen = dr.floor(pick)
        draw = self.mi.Point2f(pick - chosen, draw.y)
        sun, sky = chosen < 0.5, chosen > 1.5
        disk = self.mi.warp.square_to_uniform_disk_concentric(draw)
        centre, one, two, facing = (dr.select(sun, a, b) for a, b in (self.centre, *zip(*self.across, strict=True), self.normal))
        way = centre + one * disk.x + two * disk.y - self.mi.Vector3f(si.p)
        square = dr.squared_norm(way)
        length = dr.sqrt(square)
        way = dr.select(sky, self.mi.Frame3f(normal).to_world(self.mi.warp.square_to_cosine_hemisphere(draw)), way / length)
        here, there = dr.dot(way, normal), -dr.dot(way, facing)
        active = active & (here > 0) & ((there > 0) | sky)
        ray = si.spawn_ray(way)
        ray.maxt = dr.select(sky, 1e5, length * (1 - 1e-3))
        light = dr.select(sky, self.sky(way), dr.select(sun, *self.power) * (here * there / square))
        return dr.select(active & ~scene.ray_test(ray, active), 3 * light, 0.0)


def _matter(si: Any, active: Any) -> tuple[Any, Any]:
    """Albedo, and the shading normal on the side that is seen."""
    import drjit as dr

    normal = si.sh_frame.n
    return si.bsdf().eval_diffuse_reflectance(si, active), type(si.wi)(normal) * dr.select(si.wi.z < 0, -1.0, 1.0)


def _primary(mi: Any, pixel: Any, at: Any, camera: ViewCamera, size: int) -> Any:
    import drjit as dr

    width, half = _whole(mi, size), _number(mi, size / 2)
    unit = _number(mi, np.tan(np.radians(camera.fov) / 2) / (size / 2))
    right, up, backward = (mi.Vector3f(*_numbers(mi, axis)) for axis in camera.axes)
    u, v = mi.Float(pixel % width) + at.x - half, mi.Float(pixel // width) + at.y - half
    return mi.Ray3f(mi.Point3f(*_numbers(mi, camera.origin)), dr.normalize(right * (u * unit) - up * (v * unit) - backward))


def _number(mi: Any, value: float) -> Any:
    """A number that may change without a new kernel."""
    import drjit as dr

    number = mi.Float(float(value))
    dr.make_opaque(number)
    return number


def _numbers(mi: Any, values: Any) -> list[Any]:
    return [_number(mi, value) for value in values]


def _whole(mi: Any, value: int) -> Any:
    import drjit as dr

    number = mi.UInt32(int(value))
    dr.make_opaque(number)
    return number
