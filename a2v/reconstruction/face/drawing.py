"""Draw the face of the photo over the features of the body.

A face that was not bent to the landmarks of the photo gets its colors this way.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.body.face import face_landmarks
from a2v.geometry.images import sample_image
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.face.places import placing_points
from a2v.types import FloatArray, OrthographicCamera, Surface

_SMOOTHING = 0.02
"""Smoothing of the drawing, which lets it miss landmarks: squared widths of the face times the
value of the kernel."""
_FADE = (0.05, 0.4)
"""Distances from the landmarks: up to the first the photo moves with them, from the second on it
does not move; in widths of the face."""
_BETWEEN = (107, 336, 285, 55)
"""Landmarks around the skin between the brows: their inner ends."""
_BESIDE = (151, 108, 337, 6, 197)
"""Landmarks on forehead and bridge of the nose, whose median color it has."""
_SOFT = 0.1
"""Softness of its border, as a share of its diagonal."""
_STEP = 2
"""Distance between the pixels at which the displacement is computed."""


def drawn_over(
    photo: FloatArray, surface: Surface, camera: OrthographicCamera
) -> tuple[FloatArray, Surface]:
    """Move the face in the photo (H, W, 3) to the landmarks of the surface in the frame of
    `camera`.

    Returns the photo and the surface with these landmarks. The first vertices of the surface are
    those of Anny, whose face it has.
    """
    import cv2
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import cKDTree

    assert surface.face is not None
    corners, weights = face_landmarks()
    lying = camera.project(
        np.einsum("kc,kcd->kd", weights, surface.vertices[corners].astype(np.float64))
    )
    landmarks = surface.face.landmarks.copy()
    landmarks[:, :2] = lying
    made = dataclasses.replace(surface, face=dataclasses.replace(surface.face, landmarks=landmarks))
    # the outline of a turned face is not a fixed line on the skin
    own, lying, shown = (
        lying,
        placing_points(lying),
        placing_points(surface.face.landmarks[:, :2].astype(np.float64)),
    )
    wide = max(float(np.ptp(lying, axis=0).max()), 1.0)
    move = RBFInterpolator(
        lying / wide, (shown - lying) / wide, kernel="thin_plate_spline", smoothing=_SMOOTHING
    )
    height, width = photo.shape[:2]
    low = np.maximum(np.floor(lying.min(axis=0) - _FADE[1] * wide).astype(np.int64), 0)
    high = np.minimum(
        np.ceil(lying.max(axis=0) + _FADE[1] * wide).astype(np.int64), [width, height]
    )
    columns, rows = np.arange(low[0], high[0], _STEP), np.arange(low[1], high[1], _STEP)
    if not len(columns) or not len(rows):
        return photo, made
    places = np.stack(np.meshgrid(columns + 0.5, rows + 0.5), axis=-1).reshape(-1, 2)
    away, nearest = cKDTree(lying).query(places, workers=1)
    share = 1 - smoothstep(away / wide, *_FADE)
    # Beyond the landmarks a spline continues in straight lines and may fold. There the displacement
    # of the nearest landmark is used.
    within = lying[nearest] + np.minimum(1.0, _FADE[0] * wide / np.maximum(away, 1e-9))[:, None] * (
        places - lying[nearest]
    )
    shift = (
        (share[:, None] * wide * move(within / wide))
        .reshape(len(rows), len(columns), 2)
        .astype(np.float32)
    )
    size = (int(high[0] - low[0]), int(high[1] - low[1]))
    shift = cv2.resize(shift, size, interpolation=cv2.INTER_LINEAR)
    across, down = np.meshgrid(
        np.arange(low[0], high[0], dtype=np.float32), np.arange(low[1], high[1], dtype=np.float32)
    )
    result = np.array(photo)
    window = (slice(low[1], high[1]), slice(low[0], high[0]))
    result[window] = cv2.remap(
        np.asarray(photo, np.float32),
        across + shift[..., 0],
        down + shift[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    result[window] = _brows_apart(result[window], own - low)
    return result, made


def _brows_apart(photo: FloatArray, landmarks: FloatArray) -> FloatArray:
    """Draw skin between the brows.

    A brow that reaches the outline of a turned face would otherwise meet its mirror image.
    """
    import cv2

    region = np.zeros(photo.shape[:2], np.uint8)
    corners = landmarks[list(_BETWEEN)]
    cv2.fillConvexPoly(region, np.round(16 * corners).astype(np.int32), 255, cv2.LINE_AA, 4)
    wide = float(np.linalg.norm(np.ptp(corners, axis=0)))
    share = cv2.GaussianBlur(region.astype(np.float32) / 255, (0, 0), max(_SOFT * wide, 0.5))
    skin = np.median(sample_image(photo, landmarks[list(_BESIDE)]), axis=0)
    return np.asarray(photo + share[..., None] * (skin - photo), np.float32)
