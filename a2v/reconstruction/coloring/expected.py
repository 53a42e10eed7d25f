"""Prior colors of the unseen side without a network: the mirrored front, and hair on the back of
the head."""

from __future__ import annotations

import numpy as np

from a2v.geometry.images import sample_image
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.coloring.head_look import HeadLook
from a2v.reconstruction.coloring.painting import Painting
from a2v.reconstruction.reading.skin import head_box
from a2v.types import BoolArray, FloatArray, Subject


def mirrored_prior(painting: Painting, *, known: BoolArray) -> FloatArray:
    """Return prior colors (V, 3) for Eq. 14.

    A vertex gets the color of the photo at its pixel: the back of a jacket looks like its front.
    The skin of the neckline is not copied to the back below the collar. Behind the ears, a vertex
    gets the color of the head's border in the same row (hair or a hat), so that no face is painted
    on the back of the head. This reaches down to the nape, or as far as hair hangs beside the neck.

    Parameters
    ----------
    painting : Painting
    known : (V,) bool
        Vertices whose colors the photo shows well.
    """
    import cv2

    vertices, normals, colors = painting.vertices, painting.normals, painting.colors
    subject, camera, clean = painting.photo.subject, painting.photo.camera, painting.photo.clean
    head = painting.head
    person = subject.mask > 0.5
    tall = float(np.ptp(np.nonzero(person)[0]) + 1)
    blur = max(0.8, 0.004 * tall)
    pixels, box = camera.project(vertices), head_box(subject)
    plain = sample_image(cv2.GaussianBlur(clean, (0, 0), blur), pixels)
    if box is None:
        return plain
    left, top, right, chin, eye_line = box
    unit, middle = (chin - eye_line) / 2.1, (left + right) / 2
    inside = _in_box(pixels, box, 0.05 * tall) & (pixels[:, 1] < chin if head is None else head)
    crown = inside & known & (pixels[:, 1] < top + 0.28 * (eye_line - top))
    if crown.sum() < 5:
        return plain
    cheeks = (
        inside
        & known
        & (np.abs(pixels[:, 1] - eye_line - 0.65 * unit) < 0.35 * unit)
        & (np.abs(pixels[:, 0] - middle) < unit)
    )
    skin = np.median(colors[cheeks if cheeks.sum() >= 5 else crown], axis=0)
    look = HeadLook(clean, person, box, skin=skin, typical=np.median(colors[crown], axis=0))

    row, across = pixels[:, 1], pixels[:, 0] - middle
    torso = sample_image(cv2.GaussianBlur(look.without_neckline(clean), (0, 0), blur), pixels)
    below = (
        smoothstep(row, look.collar - 0.3 * unit, look.collar)
        * (np.abs(across) < 3.5 * unit)
        * (row < chin + 8 * unit)
    )[:, None]
    prior = below * torso + (1 - below) * plain
    behind = _behind_ears(
        vertices, normals, inside, row, subject=subject, look=look, scale=camera.scale
    )
    # skin from the hairline to the collar, hair above or as far down as it hangs
    neck = behind * inside * smoothstep(-row, -look.collar, -(look.collar - 0.2 * unit))
    prior = prior + (neck * ~known)[:, None] * (0.92 * skin - prior)
    hanging = np.abs(across) < (1.9 * unit if look.hair_end > look.nape + 0.3 * unit else np.inf)
    hair = behind * (
        inside | (hanging & (vertices[:, 2] < np.median(vertices[inside, 2])) & (row > look.nape))
    )
    hair = (
        hair
        * hanging
        * smoothstep(-row, -(look.hair_end + 0.15 * unit), -(look.hair_end - 0.15 * unit))
    )
    return np.asarray(prior + (hair * ~known)[:, None] * (look.around(row, across) - prior))


def _in_box(
    pixels: FloatArray, box: tuple[float, float, float, float, float], above: float
) -> BoolArray:
    """Return which pixels (V, 2) lie in the box of a head (`head_box`), or up to `above` pixels
    over it."""
    left, top, right, chin, eye_line = box
    return np.asarray(
        (pixels[:, 0] > left)
        & (pixels[:, 0] < right)
        & (pixels[:, 1] < chin + (chin - eye_line) / 2.1)
        & (pixels[:, 1] > top - above)
    )


def _behind_ears(
    vertices: FloatArray,
    normals: FloatArray,
    inside: BoolArray,
    row: FloatArray,
    *,
    subject: Subject,
    look: HeadLook,
    scale: float,
) -> FloatArray:
    """Weight (V,), 0 to 1, of vertices behind the ears, relative to the direction of the head.

    `inside` (V,) are the vertices of the head, `row` (V,) their pixel rows, `scale` the pixels per
    meter.
    """
    angle = _head_azimuth(subject)
    where = vertices - np.median(vertices[inside], axis=0)
    ahead = (where[:, 0] * np.sin(angle) + where[:, 2] * np.cos(angle)) * scale / look.unit
    forehead = look.eye_line - look.top
    behind = np.maximum(
        smoothstep(-ahead, -0.6, 0.0),
        smoothstep(-row, -(look.eye_line - 0.3 * forehead), -(look.eye_line - 0.5 * forehead)),
    )
    # the neck is not a sphere around the middle of the head, so its normals are used
    away = normals[:, 0] * np.sin(angle) + normals[:, 2] * np.cos(angle)
    low = smoothstep(row, look.nape - 0.2 * look.unit, look.nape + 0.2 * look.unit)
    return np.asarray((1 - low) * behind + low * smoothstep(-away, -0.3, 0.2))


def _head_azimuth(subject: Subject) -> float:
    """Angle, radians, by which the head is turned to the right of the picture (+x); 0 if
    unknown."""
    nose, ears = subject.keypoints_3d[0], subject.keypoints_3d[[7, 8]].mean(axis=0)
    ahead = nose - ears
    return (
        float(np.arctan2(ahead[0], max(float(ahead[2]), 0.0))) if np.isfinite(ahead).all() else 0.0
    )
