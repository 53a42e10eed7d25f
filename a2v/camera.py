"""Cameras of a photo; two of the types of `a2v.types`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from a2v.errors import InputError
from a2v.record import Record

FloatArray = NDArray[np.floating[Any]]

NEAREST = 0.25
"""Least depth of a point in front of the camera, as a fraction of the distance. Nearer points, and
points behind the camera, are treated as if they had this depth."""


@dataclass(frozen=True, kw_only=True)
class OrthographicCamera(Record):
    """The photo's camera: on +z, looking down -z, orthographic (weak perspective).

    A point (x, y, z) in meters lands on the pixel ``u = center_u + scale * x``, ``v = center_v -
    scale * y``, with u to the right, v downwards and the center of the first pixel at (0.5, 0.5).
    Larger z is nearer.

    Attributes
    ----------
    scale : float
        Pixels per meter.
    center_u, center_v : float
        Pixel of the world's origin.
    """

    scale: float
    center_u: float
    center_v: float

    def project(self, points: FloatArray) -> FloatArray:
        """Map points (..., 3) meters to pixels (..., 2)."""
        return np.stack(
            [
                self.center_u + self.scale * points[..., 0],
                self.center_v - self.scale * points[..., 1],
            ],
            axis=-1,
        )

    def unproject(self, pixels: FloatArray, depth: FloatArray | float) -> FloatArray:
        """Map pixels (..., 2) at `depth` (z, meters) to points (..., 3)."""
        x, y = (
            (pixels[..., 0] - self.center_u) / self.scale,
            (self.center_v - pixels[..., 1]) / self.scale,
        )
        return np.stack([x, y, np.broadcast_to(depth, x.shape)], axis=-1)

    @property
    def flat(self) -> OrthographicCamera:
        """`PhotoCamera.flat` of this camera: the camera itself."""
        return self

    def looks_down(self, point: FloatArray) -> float:
        """`PhotoCamera.looks_down` of this camera: 0, since its rays are level."""
        return 0.0

    def flatten(self, points: FloatArray) -> FloatArray:
        """`PhotoCamera.flatten` of this camera: the points unchanged."""
        return points

    def raised(self, points: FloatArray) -> FloatArray:
        """`PhotoCamera.raised` of this camera: the points unchanged."""
        return points


@dataclass(frozen=True, kw_only=True)
class PhotoCamera(Record):
    """The photo's camera: perspective, without roll, in front of a person who stands on level
    ground.

    The world's y is up. The optical axis meets the person's depth at the point `aim`; there the
    camera is `distance` meters away, measured over the floor, and looks down by `pitch`. With a
    distance of 0 it is orthographic and level, like `flat`.

    `flatten` warps the world so that the orthographic camera `flat` sees it exactly as this camera
    does: in the camera's axes around `aim`, at d = distance / cos(pitch), ``x' = x d / (d - z)``
    and ``y' = y d / (d - z)``, while z stays the depth over the floor. Along each ray z grows
    toward the camera, so that the order of the points along it is the same.

    Attributes
    ----------
    flat : OrthographicCamera
        Pixels of the flat frame; its scale is that at `aim`.
    aim : tuple of 3 float
        Meters; the flat frame and the world agree there.
    distance : float
        Meters; 0 for an orthographic camera.
    pitch : float
        Radians, positive downwards.
    source : str
        Where the distance comes from; "" if unknown.
    """

    flat: OrthographicCamera
    aim: tuple[float, ...] = (0.0, 0.0, 0.0)
    distance: float = 0.0
    pitch: float = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        if len(self.aim) != 3:
            raise InputError(f"PhotoCamera.aim is {self.aim}; expected three numbers")
        if not (np.isfinite(self.distance) and self.distance >= 0 and abs(self.pitch) < np.pi / 2):
            raise InputError(
                f"PhotoCamera has distance {self.distance} and pitch {self.pitch}; expected meters "
                "of at least 0, and radians"
            )

    @property
    def scale(self) -> float:
        """Pixels per meter at `aim`."""
        return self.flat.scale

    @property
    def height(self) -> float:
        """Height of the camera above y = 0, meters."""
        return float(self.aim[1] + self.distance * np.tan(self.pitch))

    def looks_down(self, point: FloatArray) -> float:
        """Return the angle below the horizon of the ray to a point (3,) of the world, radians."""
        if self.distance == 0:
            return 0.0
        return float(np.arctan2(self.height - point[1], self.aim[2] + self.distance - point[2]))

    def flatten(self, points: FloatArray) -> FloatArray:
        """Map points (..., 3) of the world to the frame of `flat`, meters."""
        if self.distance == 0:
            return points
        offset = np.asarray(points, np.float64) - self.aim
        right, up = seen_from(
            offset[..., 0], offset[..., 1], offset[..., 2], distance=self.distance, pitch=self.pitch
        )
        flat = np.stack([right, up, offset[..., 2]], axis=-1) + self.aim
        return np.asarray(flat, points.dtype)

    def raised(self, points: FloatArray) -> FloatArray:
        """Map points (..., 3) of the flat frame to the world, meters; the inverse of `flatten`."""
        if self.distance == 0:
            return points
        offset = np.asarray(points, np.float64) - self.aim
        sine, cosine = np.sin(self.pitch), np.cos(self.pitch)
        away = self.distance / cosine
        right, up, depth = offset[..., 0], offset[..., 1], offset[..., 2]
        high = (up * (away - cosine * depth) + sine * away * depth) / (cosine * away + sine * up)
        zoom = away / np.maximum(away - cosine * depth - sine * high, NEAREST * self.distance)
        return np.asarray(np.stack([right / zoom, high, depth], axis=-1) + self.aim, points.dtype)

    def project(self, points: FloatArray) -> FloatArray:
        """Map points (..., 3) of the world, meters, to pixels (..., 2)."""
        return self.flat.project(self.flatten(points))

    def unproject(self, pixels: FloatArray, depth: FloatArray | float) -> FloatArray:
        """Map pixels (..., 2) at `depth` (z, meters) to points (..., 3) of the world."""
        return self.raised(self.flat.unproject(pixels, depth))

    def moved(self, shift: FloatArray) -> PhotoCamera:
        """Return the same camera after the world has been moved by `shift` (3,), meters."""
        flat = self.flat
        moved = OrthographicCamera(
            scale=flat.scale,
            center_u=flat.center_u - flat.scale * float(shift[0]),
            center_v=flat.center_v + flat.scale * float(shift[1]),
        )
        aim = tuple(float(own + by) for own, by in zip(self.aim, shift, strict=True))
        return PhotoCamera(
            flat=moved, aim=aim, distance=self.distance, pitch=self.pitch, source=self.source
        )


def seen_from(x: Any, y: Any, z: Any, *, distance: Any, pitch: Any) -> tuple[Any, Any]:
    """`PhotoCamera.flatten` of offsets from `aim`, as arrays or tensors of any shape; returns x'
    and y', meters.

    z' equals z. `distance` (meters) and `pitch` (radians) are numbers or tensors ().
    """
    sine, cosine = (
        (np.sin(pitch), np.cos(pitch)) if isinstance(pitch, float) else (pitch.sin(), pitch.cos())
    )
    away = distance / cosine
    left = away - cosine * z - sine * y
    zoom = away / left.clip(NEAREST * distance)
    return x * zoom, (cosine * y - sine * z) * zoom


Camera = OrthographicCamera | PhotoCamera
"""Either camera. Code that works in the flat frame takes both, by `flat`, `flatten` and
`raised`."""
