"""How far a face is turned from the camera, and what lies before it."""

from __future__ import annotations

import numpy as np

from a2v.body.face import points_on_face
from a2v.body.parts import on_parts
from a2v.body.skin import outer_skin
from a2v.geometry.rays import RayScene
from a2v.types import Body, BoolArray, Camera, FloatArray

TURNED = 38.0
"""Largest angle of a face from the camera, degrees. Beyond it a fused surface gets no expressions,
and a canonical one keeps the features of the model."""
_BOTH_TURNED = 44.0
"""The same for the mean of the angles of the face and of the fitted head."""
BEFORE = 5.0
"""Depth in front of everything, meters."""


def turned_away(landmarks: FloatArray) -> float:
    """Angle, degrees, of a face with mediapipe's landmarks (478, 3) from the camera."""
    points = landmarks.astype(np.float64)
    across, up = points[263] - points[33], points[10] - points[152]
    ahead = np.cross(across * [1, -1, 1], up * [1, -1, 1])
    return float(
        np.degrees(np.arccos(np.clip(ahead[2] / max(float(np.linalg.norm(ahead)), 1e-9), -1, 1)))
    )


def is_averted(landmarks: FloatArray, body: Body, camera: Camera) -> bool:
    """Return whether a face with mediapipe's landmarks (478, 3) is turned too far away to show its
    features: by its landmarks, or by their mean with the head of the fitted body, if hair covers
    the face."""
    turned = turned_away(landmarks)
    points = camera.flatten(points_on_face(body.vertices))
    places = np.concatenate(
        [camera.flat.project(points), camera.flat.scale * points[:, 2:]], axis=1
    )
    return turned > TURNED or (turned + turned_away(places)) / 2 > _BOTH_TURNED


def behind_limb(body: Body, points: FloatArray) -> BoolArray:
    """Return whether another part of the body, a hand or an arm, lies before the head at the pixels
    of points (n, 3); `body` is that of the flat frame (`flattened`)."""
    skin, faces, parts = outer_skin(body)
    origins = np.concatenate([points[:, :2], np.full((len(points), 1), BEFORE)], axis=1)
    met = RayScene(skin, faces).cast(origins.astype(np.float32), np.array([0, 0, -1], np.float32))
    first = parts[faces[np.where(met.hit, met.face, 0), 0]]
    return np.asarray(met.hit & ~on_parts(first, "head", "neck"))
