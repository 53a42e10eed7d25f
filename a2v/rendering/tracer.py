"""Light on the person and on the ground for chosen pixels. Every sample traces the sun, the lamp
and one sky direction.

Mitsuba's path integrator picks one of the lights for each sample. Tracing all of them takes about
the same number of rays and has far less noise. A list of pixels instead of a picture leaves out the
unchanged pixels. Dr.Jit compiles the code once (LLVM only).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.lamps import Lamps
from a2v.rendering.matter import Hit
from a2v.rendering.opaque import opaque_integer
from a2v.rendering.samples import Draws, Lanes
from a2v.rendering.scene import LookSettings
from a2v.types import FloatArray, IntArray

_MOST = 1 << 22
"""Largest number of samples per launch; more are traced in parts."""


@dataclass(frozen=True, kw_only=True)
class Traced:
    """Means over the samples of each of N pixels, float32.

    `person` (N,) is the fraction of samples that hit the person. `color` (N, 3) is the person's
    linear light, `albedo` (N, 3) its reflectance and `normal` (N, 3) its shading normal on the
    visible side, all times `person`.
    """

    color: FloatArray
    albedo: FloatArray
    normal: FloatArray
    person: FloatArray

    def laid(
        self, pixels: IntArray, size: int
    ) -> tuple[tuple[slice, slice], tuple[FloatArray, FloatArray, FloatArray, FloatArray]]:
        """Lay out the values of `pixels` (N,) in the part of a picture that they need.

        Returns the part's rows and columns in a picture of `size` x `size` pixels (even), and
        color, albedo and normal (h, w, 3) and person (h, w) in it; 0 in other pixels. The part
        begins at even rows and columns, and h and w are even.
        """
        rows, columns = np.divmod(pixels, size)
        top, left = (int(at.min()) // 2 * 2 for at in (rows, columns))
        bottom, right = ((int(at.max()) // 2 + 1) * 2 for at in (rows, columns))
        shape = bottom - top, right - left
        at = (rows - top) * shape[1] + columns - left
        laid = []
        for values in (self.color, self.albedo, self.normal, self.person):
            layer = np.zeros((shape[0] * shape[1], *values.shape[1:]), np.float32)
            layer[at] = values
            laid.append(layer.reshape(*shape, *values.shape[1:]))
        color, albedo, normal, person = laid
        return (slice(top, bottom), slice(left, right)), (color, albedo, normal, person)


class Tracer:
    """Traces the person and the light on the ground in one Mitsuba scene.

    The lights are the stage's (`a2v.rendering.scene.stage`); light is reflected once. `matter` (F,)
    holds the materials of the person's faces (`a2v.rendering.matter`); without it all are matte.
    """

    def __init__(
        self,
        mi: Any,
        scene: Any,
        person: Any,
        settings: LookSettings,
        matter: FloatArray | None = None,
    ) -> None:
        self._mi, self._scene, self._person, self._settings = mi, scene, person, settings
        self._matter = None if matter is None else mi.Float(matter.astype(np.float32))
        self._table: Any = None
        # the textured part of the ground; a plain ground is one shape with the outer part
        self._ground = (
            None
            if settings.plain_ground
            else next(shape for shape in scene.shapes() if shape.id() == "ground")
        )

    def trace(
        self, pixels: IntArray, samples: int, camera: ViewCamera, size: int, seed: int
    ) -> Traced:
        """Trace the person in `pixels` (N,), each given as row * size + column, with `samples`
        samples each.

        `samples` is even. The result depends only on the pixel's position, the number of samples
        and the seed. Two samples share one ray to the sky, which costs as much as the rest of a
        sample.
        """

        def light(lanes: Lanes) -> list[Any]:
            return self._light(
                lanes.pair(camera, size), lanes.draws, Lamps.of(self._mi, self._settings, camera)
            )

        means = self._means(light, pixels, samples // 2, seed) / 2
        return Traced(
            color=np.maximum(means[:, :3], 0),
            albedo=means[:, 3:6],
            normal=means[:, 6:9],
            person=means[:, 9],
        )

    def covered(
        self, pixels: IntArray, samples: int, camera: ViewCamera, size: int, seed: int
    ) -> FloatArray:
        """Return the fraction (N,) of each pixel that the person covers."""
        import drjit as dr

        def seen(lanes: Lanes) -> list[Any]:
            si = self._scene.ray_intersect_preliminary(lanes.ray(camera, size))
            return [
                dr.select(
                    si.is_valid() & (si.shape == self._mi.ShapePtr(self._person)),
                    self._mi.Float(1),
                    0.0,
                )
            ]

        return self._means(seen, pixels, samples, seed)[:, 0]

    def on_ground(
        self,
        pixels: IntArray,
        sides: IntArray,
        samples: int,
        camera: ViewCamera,
        size: int,
        seed: int,
    ) -> FloatArray:
        """Return the irradiance over pi (N, 3) of the ground, also behind occluders.

        Each value is the mean over a rectangle of `sides` (N, 2), columns and rows of pixels, from
        each of `pixels` (N,) to the right and down; NaN where no ray meets the ground.
        """

        def light(lanes: Lanes) -> list[Any]:
            return self._ground_light(
                lanes.ray(camera, size), lanes.draws, Lamps.of(self._mi, self._settings, camera)
            )

        return self._means(light, pixels, samples, seed, sides)

    def _means(
        self,
        light: Callable[[Lanes], list[Any]],
        pixels: IntArray,
        samples: int,
        seed: int,
        sides: IntArray | None = None,
    ) -> FloatArray:
        """Return means (N, K) of the K values of `light` over the samples of each pixel.

        With `sides` (N, 2), the samples of an item spread over a rectangle of pixels.
        """
        import drjit as dr

        mi, mask, step, parts = (
            self._mi,
            (1 << (samples - 1).bit_length()) - 1,
            max(1, _MOST // samples),
            [],
        )
        for at in range(0, len(pixels), step):
            part = pixels[at : at + step]
            count = opaque_integer(mi, samples)
            lane = dr.arange(mi.UInt32, len(part) * samples)
            slot = lane // count
            pixel = dr.gather(mi.UInt32, mi.UInt32(part.astype(np.uint32)), slot)
            draws = Draws(
                mi,
                lane - slot * count,
                pixel,
                opaque_integer(mi, mask),
                opaque_integer(mi, seed),
                self._sobol(mi, 2 * mask + 2),
            )
            spread = (
                None
                if sides is None
                else [
                    dr.gather(mi.Float, mi.Float(side[at : at + step].astype(np.float32)), slot)
                    for side in sides.T
                ]
            )
            found = light(Lanes(mi, pixel, spread, draws))
            dr.eval(found)
            parts.append(
                np.stack([np.array(dr.block_sum(value, samples)) for value in found], axis=-1)
            )
        return np.asarray(np.concatenate(parts) / np.float32(samples), np.float32)

    def _light(self, rays: list[Any], draws: Draws, lamps: Lamps) -> list[Any]:
        """Return the person's light (3), albedo (3), normal (3) and hits, summed over two rays."""
        import drjit as dr

        mi, seen = self._mi, []
        points = draws.pair(), draws.pair()
        for which, ray in enumerate(rays):
            met = self._scene.ray_intersect_preliminary(ray)
            hit = met.is_valid() & (met.shape == mi.ShapePtr(self._person))
            si, albedo, normal = self._on_person(met, ray, hit)
            made = None if self._matter is None else Hit.of(mi, self._matter, si, hit, normal, ray)
            direct = self._direct(si, normal, [two[which] for two in points], lamps, hit, made)
            seen.append((hit, si, albedo, normal, made, direct))
        (_, one, _, normal, _, _), (second, two, _, other, _, _) = seen
        where = dr.zeros(mi.SurfaceInteraction3f, dr.width(second))
        where.p, where.n, facing = (
            dr.select(second, b, a) for a, b in ((one.p, two.p), (one.n, two.n), (normal, other))
        )
        around, _, free = self._indirect(where, facing, draws, lamps, seen[0][0] | second)
        sums: list[Any] = [mi.Float(0)] * 10
        for hit, _, albedo, normal, made, (light, gloss) in seen:
            if made is not None:
                way, share = made.mirrored()
                gloss = gloss + dr.select(free, share * lamps.sky(way), 0.0)
            values = [*((light + around) * albedo + gloss), *albedo, *normal, mi.Float(1)]
            sums = [
                total + dr.select(hit, value, 0.0)
                for total, value in zip(sums, values, strict=True)
            ]
        return sums

    def _ground_light(self, ray: Any, draws: Draws, lamps: Lamps) -> list[Any]:
        """Return the irradiance over pi (3) where rays meet the plane of the ground, NaN
        elsewhere."""
        import drjit as dr

        mi = self._mi
        down = ray.d.y < -1e-6
        length = -ray.o.y / dr.select(down, ray.d.y, -1)
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(length))
        up = mi.Vector3f(0, 1, 0)
        si.p, si.n, si.t = ray.o + ray.d * length, mi.Normal3f(up), length
        si.p.y = 0
        si.sh_frame = mi.Frame3f(up)
        light, _ = self._direct(si, up, [draws.next(), draws.next()], lamps, down, None)
        around, _, _ = self._indirect(si, up, draws, lamps, down)
        return [dr.select(down, value, dr.nan) for value in light + around]

    def _direct(
        self, si: Any, normal: Any, points: list[Any], lamps: Lamps, hit: Any, made: Hit | None
    ) -> tuple[Any, Any]:
        """Sample sun and lamp once each: irradiance over pi, and light reflected as gloss."""
        mi = self._mi
        light, gloss = mi.Color3f(0), mi.Color3f(0)
        for power, lamp, draw in (
            (self._settings.sun, lamps.sun, points[0]),
            (self._settings.spot, lamps.spot, points[1]),
        ):
            if max(power) > 0:
                matt, bright = lamp(self._scene, si, normal, draw, hit, made)
                light, gloss = light + matt, gloss + bright
        return light, gloss

    def _indirect(
        self, si: Any, normal: Any, draws: Draws, lamps: Lamps, hit: Any
    ) -> tuple[Any, Any, Any]:
        """Sample one sky direction: irradiance over pi from the sky or from its occluder.

        Also returns the ray and where it met nothing.
        """
        import drjit as dr

        mi = self._mi
        bounce = si.spawn_ray(
            mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(draws.next()))
        )
        met = self._scene.ray_intersect_preliminary(bounce, active=hit)
        free = hit & ~met.is_valid()
        light = dr.select(free, lamps.sky(bounce.d), 0.0)
        if self._settings.bounces > 1:
            second, other, facing, struck = self._on_person_or_ground(met, bounce, hit)
            light += dr.select(
                struck, other * lamps.any(self._scene, second, facing, draws.next(), struck), 0.0
            )
        return light, bounce, free

    def _on_person(self, met: Any, ray: Any, hit: Any) -> tuple[Any, Any, Any]:
        """Return where a ray met the person, the albedo there, and the shading normal on the
        visible side.

        The mesh and its material are called directly: a call through the scene would dispatch over
        all its kinds of shapes and materials.
        """
        import drjit as dr

        mi = self._mi
        si = self._person.compute_surface_interaction(
            ray, met, mi.RayFlags.UV | mi.RayFlags.ShadingFrame, hit
        )
        si.t = met.t
        albedo = self._person.bsdf().eval_diffuse_reflectance(si, hit)
        seen_behind = dr.dot(si.sh_frame.n, ray.d) > 0
        return si, albedo, mi.Vector3f(si.sh_frame.n) * dr.select(seen_behind, -1.0, 1.0)

    def _on_person_or_ground(self, met: Any, ray: Any, hit: Any) -> tuple[Any, Any, Any, Any]:
        """`_on_person` for rays that met the person or the ground, and whether they did. Lamps
        reflect nothing."""
        import drjit as dr

        mi = self._mi
        body = hit & met.is_valid() & (met.shape == mi.ShapePtr(self._person))
        floor = hit & met.is_valid() & ~body & ~met.shape.is_emitter()
        si, albedo, normal = self._on_person(met, ray, body)
        up, ground = (
            mi.Vector3f(0, 1, 0),
            mi.Color3f(*(float(value) for value in self._settings.ground_albedo)),
        )
        si.p, si.n = dr.select(floor, ray(met.t), si.p), dr.select(floor, mi.Normal3f(up), si.n)
        if self._ground is not None:
            near, reach = (
                floor & (met.shape == mi.ShapePtr(self._ground)),
                2 * self._settings.ground_radius,
            )
            si.uv = dr.select(near, mi.Point2f(0.5 + si.p.x / reach, 0.5 - si.p.z / reach), si.uv)
            ground = dr.select(near, self._ground.bsdf().eval_diffuse_reflectance(si, near), ground)
        return si, dr.select(floor, ground, albedo), dr.select(floor, up, normal), body | floor

    def _sobol(self, mi: Any, least: int) -> Any:
        """Return the second dimension of Sobol's sequence, at least its first `least` numbers."""
        if self._table is None or len(self._table) < least:
            index = np.arange(max(64, least))
            value, direction = np.zeros_like(index), 1 << 31
            while index.any():
                value ^= np.where(index & 1, direction, 0)
                index, direction = index >> 1, direction ^ (direction >> 1)
            self._table = mi.UInt32(value.astype(np.uint32))
        return self._table
