"""Landmarks of the head from those of the face."""

from __future__ import annotations

import functools

import numpy as np

from a2v.body.face import points_on_face
from a2v.body.registry import load_body_model
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import FloatArray

HEAD = LANDMARK_INDEX["mouth_right"] + 1
"""Number of BlazePose landmarks of the head; they are the first ones."""
_JAW = 0.01
"""Distance below the tip of the nose, meters, from which on landmarks may move with the jaw."""


@functools.cache
def _default_head() -> tuple[FloatArray, FloatArray, np.ndarray]:
    """The face's landmarks (478, 3) and those of the head (11, 3) on Anny's default shape at rest,
    meters, and the indices of the first that do not move with the jaw."""
    import torch

    model = load_body_model("anny")
    vertices, joints = model.rest(torch.from_numpy(model.shape_default))
    face = points_on_face(vertices.numpy())
    head = model.landmarks_of(vertices[model.landmark_vertices], joints)[:HEAD]
    return face, head.numpy().astype(np.float64), np.flatnonzero(face[:, 1] > face[1, 1] - _JAW)


def head_from_face(face: FloatArray) -> tuple[FloatArray, float, float]:
    """Place the landmarks of the head by those of the face.

    Anny's default head is moved, turned and scaled so that its eyes, nose and cheeks lie on those
    of the photo: in depth roughly (least squares in three dimensions), then in the picture.

    Parameters
    ----------
    face : (478, 3)
        Mediapipe's landmarks of a face: u, v in pixels, and depth in the same unit, larger is
        nearer.

    Returns
    -------
    landmarks : (11, 3) float64
        The first 11 BlazePose landmarks in the same axes and unit.
    size : float
        Pixels per meter of the default head.
    turned : float
        Angle between the head's front and the direction to the camera, radians.
    """
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    own, head, stiff = _default_head()
    source = own[stiff]
    seen = face[stiff].astype(np.float64) * [1, -1, 1]
    middle, aim = source.mean(axis=0), seen.mean(axis=0)
    turn, _ = Rotation.align_vectors(seen - aim, source - middle)
    scale = np.sqrt(((seen - aim) ** 2).sum() / ((source - middle) ** 2).sum())

    def turned(values: FloatArray) -> Rotation:
        return Rotation.from_rotvec(values[:3]) * turn

    def placed(values: FloatArray, points: FloatArray) -> FloatArray:
        shift = np.array([values[4], values[5], 0.0])
        size = scale * np.exp(values[3])
        return np.asarray(size * turned(values).apply(points - middle) + aim + scale * shift)

    def missed(values: FloatArray) -> FloatArray:
        return np.asarray(((placed(values, source) - seen)[:, :2] / scale).ravel())

    found = least_squares(missed, np.zeros(6), loss="soft_l1", f_scale=0.003).x
    ahead = turned(found).apply([0.0, 0.0, 1.0])
    return (
        placed(found, head) * [1, -1, 1],
        float(scale * np.exp(found[3])),
        float(np.arccos(np.clip(ahead[2], -1, 1))),
    )
