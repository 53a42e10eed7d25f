"""Merge several photos of one person: displacements of the body at rest, and the photo that gives
the face."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.reconstruction.canonical.face import face_width
from a2v.reconstruction.canonical.observe import Observed
from a2v.reconstruction.reading import Reading, Source, read_photo
from a2v.types import Body, Camera, FloatArray, Reconstruction, Subject

ASIDE = 0.004
"""Error of an observed displacement in the plane of the photo, where the outline determines it,
meters."""
AHEAD = 0.010
"""Error of an observed displacement along the rays of the photo, where only the network predicts
it, meters."""
MOVED = 0.010
"""Additional error of displacements that another photo than the first one shows, meters: there the
clothes hang in another way, and the pose and the camera are fitted on their own. Without it the
outline in the first photo suffers."""
OWN_FACE = 1.3
"""Factor by which another photo has to show the face larger than the first one to give the face."""


@dataclass(frozen=True, eq=False)
class Sight:
    """A photo of a person with the fitted body and the reconstruction.

    Attributes
    ----------
    subject : Subject
    body : Body
        In that photo's pose; its shape is that of all photos.
    camera : Camera
    person : Reconstruction
        In that photo's pose.
    given : Reading, optional
        What the photo shows; None: it is read when it is needed first.
    """

    subject: Subject
    body: Body
    camera: Camera
    person: Reconstruction
    given: Reading | None = None

    @functools.cached_property
    def reading(self) -> Reading:
        """What the photo shows."""
        if self.given is not None:
            return self.given
        return read_photo(Source(self.subject, self.body, self.camera, self.person.surface))


def face_of(subjects: Sequence[Subject]) -> int:
    """Return the index of the photo that shows the face best.

    It is the first one if that is nearly as good, or if no photo shows a face.
    """
    widths = [0.0 if subject.face is None else face_width(subject.face) for subject in subjects]
    best = int(np.argmax(widths))
    return best if widths[best] > OWN_FACE * widths[0] else 0


def merged(
    seen: Sequence[Observed], weights: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Merge the observations of several photos, with `weights` (V,), into displacements (V,),
    meters, and their weights (V,).

    The surface stands as in the first photo. Each observation counts by its precision: in the plane
    of its photo that of the outline, along the rays that of the network, and in all photos but the
    first also that of the change between the photos. The weights of places that a photo does not
    show enter squared.
    """
    total, value = np.zeros(len(seen[0].offset)), np.zeros(len(seen[0].offset))
    for number, (one, weight) in enumerate(zip(seen, weights, strict=True)):
        along = one.normals[:, 2] ** 2
        variance = ASIDE**2 * (1 - along) + AHEAD**2 * along + (MOVED**2 if number else 0.0)
        precise = weight**2 * ASIDE**2 / variance
        total, value = total + precise, value + precise * one.offset
    return value / np.maximum(total, 1e-12), np.max(weights, axis=0)
