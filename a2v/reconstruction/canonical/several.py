"""One person of several photos: what each photo says of the body's displacement, brought together
at rest, and which of them shows the face."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.reconstruction.canonical.face import face_width
from a2v.reconstruction.canonical.observe import Observed
from a2v.types import Body, Camera, FloatArray, Reconstruction, Subject

ASIDE = 0.004
"""Error of an observed displacement in the photo's plane, where the outline tells it, meters."""
AHEAD = 0.010
"""The same along its rays, where the network guesses."""
OWN_FACE = 1.3
"""Another photo than the first gives the face where it shows it so many times as large."""


@dataclass(frozen=True, eq=False)
class Sight:
    """A photo of a person that was understood.

    Attributes
    ----------
    subject : Subject
    body : Body
        In that photo's pose; its shape is that of all photos.
    camera : Camera
    person : Reconstruction
        In that photo's pose.
    """

    subject: Subject
    body: Body
    camera: Camera
    person: Reconstruction


def face_of(subjects: Sequence[Subject]) -> int:
    """Which of the photos shows the face best; the first one if it does nearly as well, or if none
    does."""
    widths = [0.0 if subject.face is None else face_width(subject.face) for subject in subjects]
    best = int(np.argmax(widths))
    return best if widths[best] > OWN_FACE * widths[0] else 0


def merged(
    seen: Sequence[Observed], weights: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Displacements (V,), meters, and what they count for (V,), of several photos' observations
    with `weights` (V,).

    Each counts by how well its photo tells it: along the photo's plane the outline does, along its
    rays the network; what a photo did not see counts by the square.
    """
    total, value = np.zeros(len(seen[0].offset)), np.zeros(len(seen[0].offset))
    for one, weight in zip(seen, weights, strict=True):
        along = one.normals[:, 2] ** 2
        precise = weight**2 * ASIDE**2 / (ASIDE**2 * (1 - along) + AHEAD**2 * along)
        total, value = total + precise, value + precise * one.offset
    return value / np.maximum(total, 1e-12), np.max(weights, axis=0)
