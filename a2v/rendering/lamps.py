"""The sun, the spot light and the sky, in the form that the tracer samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.matter import Hit
from a2v.rendering.opaque import opaque_number, opaque_numbers
from a2v.rendering.scene import LookSettings


@dataclass(frozen=True, kw_only=True)
class Lamps:
    """Sun, lamp and fill light of the scene.

    A power is irradiance over pi times distance squared over cosines. `fill` is the sky's light
    overhead; `rest` is the horizon's light minus the overhead light.
    """

    mi: Any
    center: tuple[Any, Any]
    across: tuple[tuple[Any, Any], tuple[Any, Any]]
    normal: tuple[Any, Any]
    power: tuple[Any, Any]
    fill: Any
    rest: Any
    haze: Any

    @classmethod
    def of(cls, mi: Any, look: LookSettings, camera: ViewCamera) -> Lamps:
        """Build the lamps of a look. The spot light follows the camera's target."""
        lights = (look.sun_light, look.spot_light(camera.target))
        sides = [light.axes * light.radius for light in lights]
        # The sun's disk is sampled mirrored: seeds give the same noise as in earlier versions.
        sides[0][1] *= -1
        vectors = [
            vector
            for light, two in zip(lights, sides, strict=True)
            for vector in (light.center, *two, light.normal)
        ]
        c, a, b, n, sc, sa, sb, sn = (mi.Vector3f(*opaque_numbers(mi, value)) for value in vectors)
        overhead = look.sky(np.array(np.inf))
        sun_power, spot_power, fill, rest = (
            mi.Color3f(*opaque_numbers(mi, v))
            for v in (*(light.power for light in lights), overhead, look.fill - overhead)
        )
        return cls(
            mi=mi,
            center=(c, sc),
            across=((a, b), (sa, sb)),
            normal=(n, sn),
            power=(sun_power, spot_power),
            fill=fill,
            rest=rest,
            haze=None if look.zenith is None else opaque_number(mi, -1 / look.haze),
        )

    def sky(self, way: Any) -> Any:
        """Return the light of the sky in directions `way` (`LookSettings.sky`)."""
        import drjit as dr

        return (
            self.fill
            if self.haze is None
            else self.fill + self.rest * dr.exp(dr.maximum(way.y, 0) * self.haze)
        )

    def sun(
        self, scene: Any, si: Any, normal: Any, draw: Any, active: Any, made: Hit | None = None
    ) -> tuple[Any, Any]:
        """Sample the sun once: irradiance over pi, and the light that the surface (`made`) reflects
        as gloss."""
        return self._one(0, scene, si, normal, draw, active, made)

    def spot(
        self, scene: Any, si: Any, normal: Any, draw: Any, active: Any, made: Hit | None = None
    ) -> tuple[Any, Any]:
        """Sample the spot light once, as `sun` does."""
        return self._one(1, scene, si, normal, draw, active, made)

    def _one(
        self, which: int, scene: Any, si: Any, normal: Any, draw: Any, active: Any, made: Hit | None
    ) -> tuple[Any, Any]:
        import drjit as dr

        disk = self.mi.warp.square_to_uniform_disk_concentric(draw)
        way, square, length, here, there = self._to_lamp(which, disk, si, normal)
        active = active & (here > (0 if made is None else made.least())) & (there > 0)
        ray = si.spawn_ray(way)
        if made is not None:
            ray = made.raised(ray)
        ray.maxt = length * (1 - 1e-3)
        light = dr.select(
            active & ~scene.ray_test(ray, active), self.power[which] * (there / square), 0.0
        )
        return (
            (light * here, self.mi.Color3f(0))
            if made is None
            else (light * made.falloff(here), light * made.gloss(way, here))
        )

    def _to_lamp(
        self, which: int, disk: Any, si: Any, normal: Any
    ) -> tuple[Any, Any, Any, Any, Any]:
        """Return the direction from hits to points on a lamp, given by points of the unit `disk`;
        the squared distance and the distance; and the cosines at the hit and at the lamp."""
        import drjit as dr

        way = (
            self.center[which]
            + self.across[which][0] * disk.x
            + self.across[which][1] * disk.y
            - self.mi.Vector3f(si.p)
        )
        square = dr.squared_norm(way)
        length = dr.sqrt(square)
        way /= length
        return way, square, length, dr.dot(way, normal), -dr.dot(way, self.normal[which])

    def any(self, scene: Any, si: Any, normal: Any, draw: Any, active: Any) -> Any:
        """Estimate the irradiance over pi from all three lights with one ray to one of them.

        The unoccluded light of the three is known. So half of it is taken as given. Three times
        half the light of the sampled lamp is added if the ray is free and subtracted if it is
        occluded (a control variate). This has less noise than three times the light of the sampled
        lamp.
        """
        import drjit as dr

        pick = draw.x * 3
        chosen = dr.floor(pick)
        draw = self.mi.Point2f(pick - chosen, draw.y)
        disk = self.mi.warp.square_to_uniform_disk_concentric(draw)
        way = self.mi.Frame3f(normal).to_world(self.mi.warp.square_to_cosine_hemisphere(draw))
        light, reach = self.sky(way), self.mi.Float(1e5)
        total = light
        for which in (0, 1):
            toward, square, length, here, there = self._to_lamp(which, disk, si, normal)
            given = dr.select(
                (here > 0) & (there > 0), self.power[which] * (here * there / square), 0.0
            )
            total = total + given  # not in place: `total` began as the sky's array
            this = chosen == float(which)
            way, light, reach = (
                dr.select(this, a, b)
                for a, b in ((toward, way), (given, light), (length * (1 - 1e-3), reach))
            )
        ray = si.spawn_ray(way)
        ray.maxt = reach
        found = dr.select(scene.ray_test(ray, active), -1.5, 1.5) * light
        return dr.select(active, 0.5 * total + found, 0.0)
