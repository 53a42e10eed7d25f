"""Estimate the photo's camera: its distance and its pitch."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from a2v.types import FloatArray, PhotoCamera, Subject

USUAL = (2.4, 0.4)
"""Usual distance of a camera that shows a whole person, meters, and the standard deviation of its
logarithm."""
HELD = 1.45
"""Usual height of a hand-held camera above the ground, meters."""
STEEPEST = 0.6
"""Largest estimated pitch of a camera, up or down, radians."""
_LENS = 26.0
"""Focal length of a phone's main camera, 35 mm equivalent, millimeters."""
_LENS_SPREAD = 0.45
"""Standard deviation of the logarithm of a distance from that focal length: phones have other
lenses, and photos are cropped."""
_SHAPES = (4 / 3, 3 / 2, 16 / 9)
"""Usual ratios of the longer to the shorter side of photos. Other photos are cropped."""
_FILM = 43.27
"""Diagonal of 35 mm film, millimeters."""
_LIMITS = (1.0, 30.0)
"""Smallest and largest estimated distance, meters."""


@dataclass(frozen=True)
class View:
    """Estimated camera of a photo. A fit keeps the distance and the axis; it starts from the pitch
    and changes it.

    Attributes
    ----------
    distance, pitch, source
        See `PhotoCamera`.
    axis : tuple of 2 float
        Pixel that the optical axis meets.
    spread : float
        Standard deviation of the logarithm of the distance; 0 for a known distance.
    """

    distance: float = 0.0
    pitch: float = 0.0
    axis: tuple[float, float] = (0.0, 0.0)
    source: str = ""
    spread: float = 0.0

    @classmethod
    def of(cls, camera: PhotoCamera) -> View:
        """Make the view of a camera."""
        u, v = camera.flat.project(np.array(camera.aim))
        return cls(camera.distance, camera.pitch, (float(u), float(v)), camera.source)


LEVEL = View()
"""An orthographic camera."""


def estimated_view(
    subject: Subject, box: FloatArray, *, height: float, tall: float, distance: float | None
) -> View:
    """Estimate the camera's distance, and its pitch from the height at which cameras are held.

    Parameters
    ----------
    subject : Subject
        If the photo's file has a focal length, it gives the distance. Otherwise the aspect ratio
        counts. A photo with the usual ratio of a camera is probably not cropped: the distance is
        the mean of the usual distance and the one by a phone's usual lens. Any other photo gets the
        usual distance.
    box : (4,)
        Left, top, right, bottom of the person, pixels of the subject's image.
    height : float
        The person's standing height, pixels.
    tall : float
        The same in meters.
    distance : float, optional
        Given by the user, meters; 0 for an orthographic camera.
    """
    axis = (float(box[0] + box[2]) / 2, float(box[1] + box[3]) / 2)
    spread = 0.0
    if distance == 0:
        return View(source="orthographic, as given")
    if distance is not None:
        source = "given"
    elif subject.focal_length is not None:
        distance, source = (
            _by_lens(subject, subject.focal_length, height, tall),
            "the focal length in the photo's file",
        )
    else:
        distance, source, spread = USUAL[0], "the usual distance", USUAL[1]
        sides = sorted(subject.photo_size)
        if min(abs(sides[1] / sides[0] / shape - 1) for shape in _SHAPES) < 0.01:
            lens, own = _by_lens(subject, _LENS, height, tall), (_LENS_SPREAD / USUAL[1]) ** 2
            distance = math.exp((math.log(lens) + own * math.log(USUAL[0])) / (1 + own))
            spread = USUAL[1] * math.sqrt(own / (1 + own))
            source = "a telephone's usual field of view and the person's share of the photo"
    distance = float(np.clip(distance, *_LIMITS)) if source != "given" else distance
    over = tall * (box[3] - axis[1]) / height  # height of the axis above the ground
    pitch = float(np.clip(np.arctan((HELD - over) / distance), -STEEPEST, STEEPEST))
    return View(distance, pitch, axis, source, spread)


def _by_lens(subject: Subject, focal: float, height: float, tall: float) -> float:
    """Return the distance, meters, at which a person of `tall` meters has this size in the photo.

    `focal` is the focal length in mm, as for 35 mm film.
    """
    left, _, right, _ = subject.crop
    zoom = subject.image.shape[1] / (right - left)
    return focal / _FILM * math.hypot(*subject.photo_size) * zoom * tall / height


def field_of_view(camera: PhotoCamera, pixels: float) -> float:
    """Return the field of view, degrees, of `pixels` around the optical axis."""
    focal = camera.scale * camera.distance / math.cos(camera.pitch)
    return math.degrees(2 * math.atan(pixels / 2 / focal))
