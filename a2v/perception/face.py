"""Landmarks of the face by mediapipe's face mesh, whose models are in its wheel."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from a2v.perception.detector import silenced
from a2v.types import ByteArray, FloatArray

FACE_POINTS = 478
"""Landmarks of a face: mediapipe's 468 of the mesh and 5 of each iris."""
CROP = 512
"""The face is looked at in a square of so many pixels."""
LEAST_FACE = 14.0
"""Faces of less distance between the eyes, pixels, are not looked at."""


class FaceDetector:
    """Mediapipe's face mesh with irises; use as a context manager."""

    def __init__(self) -> None:
        self._graph: Any = None

    def __enter__(self) -> FaceDetector:
        os.environ.setdefault("GLOG_minloglevel", "3")
        os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
        with silenced():
            import mediapipe as mp

            self._graph = mp.solutions.face_mesh.FaceMesh(
                static_image_mode=True, refine_landmarks=True, max_num_faces=1, min_detection_confidence=0.4
            )
        return self

    def __exit__(self, *_: object) -> None:
        with silenced():
            self._graph.close()

    def one(self, picture: ByteArray) -> FloatArray | None:
        """Landmarks (478, 3) float32 of the face in `picture` (H, W, 3) uint8, or None: u, v, pixels, and depth in them, larger is nearer."""
        height, width = picture.shape[:2]
        with silenced():
            found = self._graph.process(np.ascontiguousarray(picture)).multi_face_landmarks
        if not found:
            return None
        return np.array([[p.x * width, p.y * height, -p.z * width] for p in found[0].landmark], np.float32)


def find_face(image: ByteArray, keypoints: FloatArray) -> FloatArray | None:
    """Landmarks of a person's face.

    Parameters
    ----------
    image : (H, W, 3) uint8
    keypoints : (33, 3)
        BlazePose landmarks in its pixels: where the face is.

    Returns
    -------
    (478, 3) float32 or None
        u, v in pixels of `image`, and depth in the same unit, larger is nearer; None where no face is seen, or one that is too small.
    """
    import cv2

    head = keypoints[:11]
    if head[:7, 2].min() < 0.5:
        return None
    apart = float(np.linalg.norm(head[2, :2] - head[5, :2]))
    if apart < LEAST_FACE / 2:
        return None
    middle = head[:, :2].mean(axis=0)
    half = 1.6 * max(float(np.ptp(head[:, :2], axis=0).max()), 1.5 * apart)
    scale = CROP / (2 * half)
    shift = CROP / 2 - scale * middle + (scale - 1) / 2  # warpAffine counts from the centre of the first pixel
    matrix = np.array([[scale, 0, shift[0]], [0, scale, shift[1]]])
    tile = cv2.warpAffine(
        image, matrix, (CROP, CROP), flags=cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA, borderMode=cv2.BORDER_REPLICATE
    )
    with FaceDetector() as detector:
        found = detector.one(tile)
    if found is None:
        return None
    found[:, :2] = (found[:, :2] - CROP / 2) / scale + middle
    found[:, 2] /= scale
    eyes = np.linalg.norm(found[33, :2] - found[263, :2])
    if eyes < LEAST_FACE or np.linalg.norm(found[[33, 263], :2].mean(axis=0) - head[[2, 5], :2].mean(axis=0)) > eyes:
        return None
    return found
