"""Where the photo's camera stood: how steeply it saw the ground, how far away and how high it was,
and what it makes of the person.

The person was reconstructed as an orthographic camera sees, upright, depth measured over the floor
(`a2v.lab.studio.solid.PhotoFrame`). In that frame flat ground falls towards the camera by the
tangent of the angle at which the camera sees it, and soles lie on the ground: the slope of the
soles tells height over distance. How far away the camera was only the focal length in the file can
tell, else what is usual.
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
"""Usual height of a camera that sees a whole person, meters, and the spread of its logarithm."""
DISTANCE = (3.8, 0.45)
"""Usual distance of such a camera, meters, and the spread of its logarithm."""

TOLD = 0.15
"""Spread of the logarithm of a distance that follows from the focal length in the file: photos are
cropped."""

SLOPE = 0.13
"""Standard deviation of the slope of reconstructed soles about the ground's
(docs/research/rendering.md)."""

_DOWN = -0.6
"""Largest y of a sole's normals."""
_RAISED = 0.12
"""A foot that is so much higher than the lowest stands on nothing, meters."""

_CLOSE = 0.7
"""The camera is at least so far before what of the person is next to it, meters."""

_FILM = 43.27
"""Diagonal of 35 mm film, millimeters."""


@dataclass(frozen=True, kw_only=True)
class Viewpoint:
    """Of a camera before the person: height over distance, and distance over the floor, meters."""

    slope: float
    distance: float

    @property
    def height(self) -> float:
        """Over the ground, meters."""
        return self.slope * self.distance


def soles_slope(surface: Surface, feet: Sequence[BoolArray]) -> float | None:
    """How far soles fall towards the camera, meters a meter; None where none is flat or they are
    too short to tell.

    Parameters
    ----------
    surface : Surface
        In the frame of the photo's camera.
    feet : sequence of (V,) bool
        Which vertices each foot has.
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
    """The likeliest viewpoint, where height and distance are as usual, soles lie on the ground and
    the file may tell the focal length.

    Parameters
    ----------
    slope : float or None
        `soles_slope`.
    told : float or None
        Distance by the file's focal length, meters (`told_distance`).
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
    """How far away, meters, a camera of `focal` (mm, as for 35 mm film) was, by how large the
    person is in the photo."""
    return focal / _FILM * math.hypot(*subject.photo_size) / _scale(subject, camera)


def perspective_camera(
    subject: Subject,
    camera: OrthographicCamera,
    vertices: FloatArray,
    offset: FloatArray,
    viewpoint: Viewpoint,
) -> tuple[ViewCamera, FloatArray]:
    """The photo's camera in the world, and what moves the person's vertices to where it sees them
    as the photo does.

    Parameters
    ----------
    subject : Subject
    camera : OrthographicCamera
        Of the fit, in pixels of the subject's crop.
    vertices : (V, 3)
        The person in the frame of `camera`.
    offset : (3,)
        From that frame to the world, where the root is over the origin
        (`a2v.animation.photo_to_world`).
    viewpoint : Viewpoint

    Returns
    -------
    camera : ViewCamera
        Sees the square around the photo; pitched, never rolled.
    moved : (V, 3) float32
        To be added to the vertices in the world: none along z, and the lowest comes to the ground.
    """
    pixels = _in_square(subject, camera, vertices)
    side = max(subject.photo_size)
    world = vertices + offset
    over = (
        world[:, 1] + viewpoint.slope * world[:, 2]
    )  # in this frame the ground falls towards the camera
    low = over < over.min() + 0.02
    toward = world[:, 2] - float(world[low, 2].mean())
    distance = max(viewpoint.distance, float(toward.max()) + _CLOSE)
    away = distance - toward  # over the floor
    middle, feet = float(pixels[:, 1].min() + pixels[:, 1].max()) / 2, float(pixels[low, 1].mean())
    focal = _scale(subject, camera) * distance
    for _ in range(
        4
    ):  # pitch by the feet's place in the photo, focal length by the person's size there
        pitch = float(np.arctan(viewpoint.slope) - np.arctan((feet - side / 2) / focal))
        ray = np.arctan((middle - side / 2) / focal)
        focal = _scale(subject, camera) * distance * float(np.cos(ray) / np.cos(pitch + ray))
    down = np.tan(
        pitch + np.arctan((pixels[:, 1] - side / 2) / focal)
    )  # of the rays, a meter over the floor
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
    """Pixels of the photo a meter."""
    left, _, right, _ = subject.crop
    return camera.scale * (right - left) / subject.image.shape[1]


def _in_square(subject: Subject, camera: OrthographicCamera, points: FloatArray) -> FloatArray:
    """Pixels (N, 2) of points (N, 3) in the square with the photo in its middle."""
    left, top, right, _ = subject.crop
    width, height = subject.photo_size
    side = max(width, height)
    border = np.array([(side - width) // 2, (side - height) // 2])
    ratio = (right - left) / subject.image.shape[1]
    return np.asarray(camera.project(points.astype(np.float64)) * ratio + (left, top) + border)


NEAR = 0.3
"""So far from the photo's pose and place, meters (root mean square over the vertices), what
`perspective_camera` moves has faded to a third."""


def as_seen(vertices: FloatArray, start: FloatArray, moved: FloatArray) -> FloatArray:
    """Vertices (V, 3) of a frame, moved as `perspective_camera` says as far as they are those of
    the photo's pose and place, `start` (V, 3).

    Then the first frame of a clip out of the photo is the photo's, and what goes on from there
    stands on flat ground.
    """
    away = float(np.sqrt(((vertices - start) ** 2).sum(axis=1).mean()))
    return np.asarray(vertices + np.exp(-((away / NEAR) ** 2)) * moved, np.float32)
