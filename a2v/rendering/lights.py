"""A disk that shines from one side: the sun or the spot light of a scene, for all renderers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.types import FloatArray

SUN_DISTANCE = 20000.0
"""Distance of the disk that stands for the sun, meters."""
AIM = (0.0, 0.9, 0.0)
"""Point that the spot light is aimed at, meters from the ground point below the camera's target:
the middle of a standing person."""


@dataclass(frozen=True, kw_only=True)
class DiskLight:
    """A disk that emits the same radiance everywhere and in all directions of one side.

    Attributes
    ----------
    center : (3,) float64, meters
    normal : (3,) float64
        Unit vector to the side that shines.
    radius : float, meters
    reach : float, meters
        The distance at which `irradiance` is given.
    irradiance : (3,) float64
        Irradiance over pi, linear RGB, on a surface that faces the disk at distance `reach`.
    """

    center: FloatArray
    normal: FloatArray
    radius: float
    reach: float
    irradiance: FloatArray

    @property
    def power(self) -> FloatArray:
        """`irradiance` times the squared distance between surface and rim (3,).

        For a surface that faces the disk, E = pi L r^2 / (d^2 + r^2).
        """
        return np.asarray(self.irradiance * (self.reach**2 + self.radius**2))

    @property
    def radiance(self) -> FloatArray:
        """Radiance of the disk, linear RGB (3,)."""
        return np.asarray(self.power / self.radius**2)

    @property
    def axes(self) -> FloatArray:
        """Two unit vectors (2, 3) in the plane of the disk, right-handed with the normal."""
        across = np.cross(
            (0.0, 0.0, 1.0) if abs(self.normal[2]) < 0.9 else (1.0, 0.0, 0.0), self.normal
        )
        across /= np.linalg.norm(across)
        return np.stack([across, np.cross(self.normal, across)])

    @property
    def matrix(self) -> FloatArray:
        """Matrix (4, 4) from the unit disk to the world."""
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([*self.axes, self.normal], axis=1) * self.radius
        matrix[:3, 3] = self.center
        return matrix


def sun_disk(direction: FloatArray, angle: float, irradiance: FloatArray) -> DiskLight:
    """Build the sun in `direction` (3,) with the angular radius `angle`, degrees; see `DiskLight`
    for `irradiance`."""
    way = direction / np.linalg.norm(direction)
    radius = SUN_DISTANCE * float(np.tan(np.radians(angle)))
    return DiskLight(
        center=way * SUN_DISTANCE,
        normal=-way,
        radius=radius,
        reach=SUN_DISTANCE,
        irradiance=irradiance,
    )


def spot_disk(
    position: FloatArray, radius: float, irradiance: FloatArray, *, target: FloatArray
) -> DiskLight:
    """Build the spot light, aimed at `AIM`.

    `position` (3,) is in meters from the ground point below `target` (3,).
    """
    foot = np.array([target[0], 0.0, target[2]])
    center, aim = foot + position, foot + np.array(AIM)
    reach = float(np.linalg.norm(np.subtract(position, AIM)))
    return DiskLight(
        center=center,
        normal=(aim - center) / np.linalg.norm(aim - center),
        radius=radius,
        reach=reach,
        irradiance=irradiance,
    )
