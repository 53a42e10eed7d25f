"""Position of the photo's camera: pitch, distance and height, and its perspective of the person.

The person was reconstructed for an upright orthographic camera, with depth measured over the floor
(`a2v.lab.studio.solid.PhotoFrame`). In that frame flat ground falls toward the camera by the
tangent of the angle at which the camera sees it, and soles lie on the ground. So the slope of the
soles gives height over distance. The distance itself follows only from a focal length in the file;
without one the usual distance is taken.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.geometry.mesh import vertex_normals
from a2v.rendering.camera import ViewCamera
from a2v.types import BoolArray, FloatArray, OrthographicCamera, Subject, Surface

HEIGHT = (1.4, 0.25)
"""Usual height of a camera that sees a whole person, meters, and the standard deviation of its
logarithm."""
DISTANCE = (3.8, 0.45)
"""Usual distance of such a camera, meters, and the standard deviation of its logarithm."""

TOLD = 0.15
"""Standard deviation of the logarithm of a distance from the file's focal length (photos are
cropped)."""

SLOPE = 0.13
"""Standard deviation of the slope of reconstructed soles around the ground's slope
(docs/research/rendering.md)."""

_DOWN = -0.6
"""Largest y of the normals of a sole."""
_RAISED = 0.12
"""A foot higher than the lowest foot by this is in the air, meters."""

_CLOSE = 0.7
"""Smallest distance between the camera and the nearest part of the person, meters."""

_FILM = 43.27
"""Diagonal of 35 mm film, millimeters."""


@dataclass(frozen=True, kw_only=True)
class Viewpoint:
    """Viewpoint of a camera in front of the person: height over distance, and distance over the
    floor, meters."""

    slope: float
    distance: float

    @property
    def height(self) -> float:
        """Height over the ground, meters."""
        return self.slope * self.distance


def soles_slope(surface: Surface, feet: Sequence[BoolArray]) -> float | None:
    """Measure how far soles fall toward the camera, meters per meter.

    None if no sole is flat or the soles are too short to measure.

    Parameters
    ----------
    surface : Surface
        In the frame of the photo's camera.
    feet : sequence of (V,) bool
        The vertices of each foot.
    """
    vertices = surface.vertices.astype(np.float64)
    down = vertex_normals(vertices, surface.faces)[:, 1] < _DOWN
    soles = [vertices[down & foot] for foot in feet if (down & foot).sum() > 20]
    if not soles:
        return None
    lowest = min(float(sole[:, 1].min()) for sole in soles)
    flat = [sole - sole.mean(axis=0) for sole in soles if sole[:, 1].min() < lowest + _RAISED]
    together = np.concatenate(flat)
    if together[:, 2].std() < 0.02:
        return None
    return float(-(together[:, 2] @ together[:, 1]) / (together[:, 2] @ together[:, 2]))


def find_viewpoint(slope: float | None, *, told: float | None = None) -> Viewpoint:
    """Find the likeliest viewpoint.

    Height and distance are likely near the usual ones, soles lie on the ground, and the file may
    give the focal length.

    Parameters
    ----------
    slope : float or None
        `soles_slope`.
    told : float or None
        Distance from the file's focal length, meters (`told_distance`).
    """
    tangent, far = np.meshgrid(
        np.linspace(0.02, 0.9, 177), np.geomspace(1.5, 20, 131), indexing="ij"
    )
    cost = (np.log(far * tangent / HEIGHT[0]) / HEIGHT[1]) ** 2 + (
        np.log(far / DISTANCE[0]) / DISTANCE[1]
    ) ** 2
    if slope is not None:
        cost = cost + ((tangent - slope) / SLOPE) ** 2
    if told is not None:
        cost = cost + (np.log(far / told) / TOLD) ** 2
    best = np.unravel_index(int(cost.argmin()), cost.shape)
    return Viewpoint(slope=float(tangent[best]), distance=float(far[best]))


def told_distance(focal: float, subject: Subject, camera: OrthographicCamera) -> float:
    """Return the distance of a camera of `focal` (mm, 35 mm equivalent), meters, from the person's
    size in the photo."""
    return focal / _FILM * math.hypot(*subject.photo_size) / _scale(subject, camera)


def perspective_camera(
    subject: Subject,
    camera: OrthographicCamera,
    vertices: FloatArray,
    offset: FloatArray,
    viewpoint: Viewpoint,
) -> tuple[ViewCamera, FloatArray]:
    """Return the photo's camera in the world, and offsets with which it shows the person's vertices
    as in the photo.

    Parameters
    ----------
    subject : Subject
    camera : OrthographicCamera
        Of the fit, in pixels of the subject's crop.
    vertices : (V, 3)
        The person in the frame of `camera`.
    offset : (3,)
        From that frame to the world, in which the root is above the origin
        (`a2v.animation.photo_to_world`).
    viewpoint : Viewpoint

    Returns
    -------
    camera : ViewCamera
        It covers the square around the photo, and is pitched but never rolled.
    moved : (V, 3) float32
        To be added to the vertices in the world. Its z is 0, and the lowest vertex comes to the
        ground.
    """
    pixels = _in_square(subject, camera, vertices)
    side = max(subject.photo_size)
    world = vertices + offset
    over = (
        world[:, 1] + viewpoint.slope * world[:, 2]
    )  # in this frame the ground falls toward the camera
    low = over < over.min() + 0.02
    toward = world[:, 2] - float(world[low, 2].mean())
    distance = max(viewpoint.distance, float(toward.max()) + _CLOSE)
    away = distance - toward  # over the floor
    middle, feet = float(pixels[:, 1].min() + pixels[:, 1].max()) / 2, float(pixels[low, 1].mean())
    focal = _scale(subject, camera) * distance
    for _ in range(
        4
    ):  # pitch from the feet's position in the photo, focal length from the person's size there
        pitch = float(np.arctan(viewpoint.slope) - np.arctan((feet - side / 2) / focal))
        ray = np.arctan((middle - side / 2) / focal)
        focal = _scale(subject, camera) * distance * float(np.cos(ray) / np.cos(pitch + ray))
    down = np.tan(
        pitch + np.arctan((pixels[:, 1] - side / 2) / focal)
    )  # slope of the rays, per meter over the floor
    depth = away * (np.cos(pitch) + np.sin(pitch) * down)
    aside = (pixels[:, 0] - side / 2) / focal * depth
    height = float((away * down).max())
    left = float(np.mean(world[:, 0] - aside))
    seen = np.stack([left + aside, height - away * down, world[:, 2]], axis=1)
    origin = (left, height, float(world[low, 2].mean()) + distance)
    target = (left, height - distance * float(np.tan(pitch)), origin[2] - distance)
    fov = float(2 * np.degrees(np.arctan(side / 2 / focal)))
    return ViewCamera(origin=origin, target=target, fov=fov), (seen - world).astype(np.float32)


def _scale(subject: Subject, camera: OrthographicCamera) -> float:
    """Pixels of the photo per meter."""
    left, _, right, _ = subject.crop
    return camera.scale * (right - left) / subject.image.shape[1]


def _in_square(subject: Subject, camera: OrthographicCamera, points: FloatArray) -> FloatArray:
    """Return pixels (N, 2) of points (N, 3) in the square with the photo in its middle."""
    left, top, right, _ = subject.crop
    width, height = subject.photo_size
    side = max(width, height)
    border = np.array([(side - width) // 2, (side - height) // 2])
    ratio = (right - left) / subject.image.shape[1]
    return np.asarray(camera.project(points.astype(np.float64)) * ratio + (left, top) + border)


NEAR = 0.3
"""Distance from the photo's pose and place at which the offsets of `perspective_camera` have faded
to a third, meters (root mean square over the vertices)."""


def as_seen(vertices: FloatArray, start: FloatArray, moved: FloatArray) -> FloatArray:
    """Add the offsets of `perspective_camera` to vertices (V, 3), faded with the distance from the
    photo's pose.

    `start` (V, 3) are the vertices in the photo's pose and place, where the whole offset applies.
    So the first frame of a clip that starts in the photo equals the photo, and later frames stand
    on flat ground.
    """
    away = float(np.sqrt(((vertices - start) ** 2).sum(axis=1).mean()))
    return np.asarray(vertices + np.exp(-((away / NEAR) ** 2)) * moved, np.float32)
