"""A light as a disk that shines from one side: the sun and the spot light of a scene, which every
renderer reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.types import FloatArray

SUN_DISTANCE = 20000.0
"""Distance of the disk that stands for the sun, meters."""
AIM = (0.0, 0.9, 0.0)
"""Where the spot light points, meters from the point on the ground below the camera's target: the
middle of a standing person."""


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
        The distance at which `irradiance` holds.
    irradiance : (3,) float64
        Linear RGB over pi, on a surface that faces the disk at `reach`.
    """

    center: FloatArray
    normal: FloatArray
    radius: float
    reach: float
    irradiance: FloatArray

    @property
    def power(self) -> FloatArray:
        """`irradiance` times the squared distance between surface and rim (3,): E = pi L r^2 / (d^2
        + r^2), seen face on."""
        return np.asarray(self.irradiance * (self.reach**2 + self.radius**2))

    @property
    def radiance(self) -> FloatArray:
        """Linear RGB (3,) of the disk itself."""
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
        """World from unit disk (4, 4)."""
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([*self.axes, self.normal], axis=1) * self.radius
        matrix[:3, 3] = self.center
        return matrix


def sun_disk(direction: FloatArray, angle: float, irradiance: FloatArray) -> DiskLight:
    """The sun in `direction` (3,) with the angular radius `angle`, degrees; see `DiskLight` for
    `irradiance`."""
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
    """The spot light at `position` (3,) meters from the point on the ground below `target` (3,); it
    points at `AIM`."""
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
