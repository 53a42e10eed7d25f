"""Measure a character from a photo without a ground truth: as photographed beside the photo, and
its face seen again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from a2v.lab.evaluation.photos.made import Made
from a2v.lab.evaluation.photos.recognition import face_descriptor
from a2v.perception.face import FaceDetector
from a2v.reconstruction.beside_photo import SIZE
from a2v.reconstruction.canonical.face import face_width
from a2v.reconstruction.face.facing import turned_away
from a2v.reconstruction.face.look_again import look_again

PROTOCOL = 1
"""Version of the measures."""
TURN = 35.0
"""Turn of the head at which faces are compared a second time, degrees to either side."""


@dataclass(frozen=True)
class PhotoSettings:
    """The protocol.

    Attributes
    ----------
    size : int
        Pixels along the longer side of the pictures that are compared.
    head : int
        Width of the pictures of heads in which faces are compared, pixels.
    """

    size: int = SIZE
    head: int = 512


@dataclass(frozen=True)
class PhotoOutcome:
    """The result of one photo.

    Attributes
    ----------
    name : str
        Of the file, without suffix.
    values : mapping of measure to float
        NaN if it could not be measured; see `measure`.
    notes : tuple of str
        Of the product, for the user.
    failure : str
        Reason why no character was made; "" otherwise.
    seconds : float
        For the character, if it was not in the store.
    """

    name: str
    values: Mapping[str, float] = field(default_factory=dict)
    notes: Sequence[str] = ()
    failure: str = ""
    seconds: float = 0.0


def measure(made: Made, settings: PhotoSettings = PhotoSettings()) -> dict[str, float]:
    """Measure a character.

    Returns
    -------
    dict
        "iou": of the outlines of person and character, in the pose and by the camera of the photo.
        "color" and "color, head" (also trunk, arms, legs): mean CIELAB difference where both are.
        "face px", "face turned": width of the photo's face, pixels, and its angle from the camera,
        degrees. "face" and "face 35": distance of dlib's descriptors of the photo's face and that
        of the head at rest, from the front, and the mean from `TURN` degrees to either side.
        "rest", "blink", "open mouth": largest distance of a feature from its place in the face that
        is detected on the character, in distances of the eyes (`look_again`).
    """
    found = made.beside(size=settings.size).compared()
    looks = look_again(
        made.character.surface, made.character.surface.vertices, made.character.parts
    )
    found |= {name: glance.worst for name, glance in looks.items()}
    return found | compare_faces(made, size=settings.head)


def compare_faces(made: Made, *, size: int) -> dict[str, float]:
    """Distances of faces; see `measure`. NaN if the photo shows no face."""
    landmarks = made.subject.face
    if landmarks is None:
        return dict.fromkeys(("face px", "face turned", "face", "face 35"), float("nan"))
    own = face_descriptor(made.subject.image, landmarks)
    with FaceDetector() as detector:

        def distance(azimuth: float) -> float:
            picture, places = made.head(azimuth=azimuth, size=size)
            seen = detector.one(picture)
            other = face_descriptor(picture, places if seen is None else seen)
            return float(np.linalg.norm(own - other))

        front, turned = distance(0.0), [distance(angle) for angle in (-TURN, TURN)]
    return {
        "face px": face_width(landmarks),
        "face turned": turned_away(landmarks),
        "face": front,
        "face 35": float(np.mean(turned)),
    }
