"""A camera before a face, and a person whose face is that of a body."""

from __future__ import annotations

import numpy as np

from a2v.body.face import face_landmarks
from a2v.types import Body, OrthographicCamera, Subject
from tests.support.subjects import blank_subject

CAMERA = OrthographicCamera(scale=2048 / 1.8, center_u=1024.0, center_v=1990.0)


def photographed(body: Body, *, turned: float = 0.0) -> Subject:
    """Return a person with the face of `body`, brows 4 mm higher and eyes 3 mm wider apart."""
    ids, weights = face_landmarks()
    points = np.einsum("kc,kcd->kd", weights, body.vertices[ids].astype(np.float64))
    middle = points[:, :2].mean(axis=0)
    points[:, 0] += 0.0015 * np.tanh((points[:, 0] - middle[0]) / 0.02)
    points[:, 1] += 0.004 * np.clip((points[:, 1] - middle[1]) / 0.06, 0, 1)
    away = points - points.mean(axis=0)
    cosine, sine = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    points[:, 0], points[:, 2] = (
        points[:, 0] - away[:, 0] + cosine * away[:, 0] + sine * away[:, 2],
        cosine * away[:, 2] - sine * away[:, 0],
    )
    face = np.concatenate([CAMERA.project(points), CAMERA.scale * points[:, 2:]], axis=1)
    return blank_subject(2048, face=face.astype(np.float32))
