"""Landmarks of the face by mediapipe's face mesh, whose models are in its wheel."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.perception.detector import Solution, cut_square, from_square, silenced
from a2v.types import ByteArray, FloatArray

FACE_POINTS = 478
"""Landmarks of a face: mediapipe's 468 of the mesh and 5 of each iris."""
CROP = 512
"""Side of the square in which the face is detected, pixels."""
LEAST_FACE = 14.0
"""Smallest distance between the outer corners of the eyes, depth included, of a face that is
detected, pixels."""

GLANCES = (
    (0.0, 0.0, 1.0),
    (0.06, 0.0, 1.0),
    (-0.06, 0.0, 1.0),
    (0.0, 0.06, 1.0),
    (0.0, -0.06, 1.0),
    (0.0, 0.0, 0.88),
    (0.0, 0.0, 1.14),
    (0.05, 0.05, 0.94),
    (-0.05, -0.05, 1.07),
)
"""Squares in which a face is detected: shift to the right and down, and size, in halves of the
square."""


class FaceDetector(Solution):
    """Mediapipe's face mesh with irises; use as a context manager."""

    def _made(self, solutions: Any) -> Any:
        graph = solutions.face_mesh.FaceMesh(
            static_image_mode=True,
            refine_landmarks=True,
            max_num_faces=1,
            min_detection_confidence=0.4,
        )
        graph.process(
            np.zeros((32, 32, 3), np.uint8)
        )  # it starts in a thread of its own, and logs what it does
        return graph

    def one(self, picture: ByteArray) -> FloatArray | None:
        """Return landmarks (478, 3) float32 of the face in `picture` (H, W, 3) uint8, or None.

        They are u, v in pixels, and depth in the same unit, larger is nearer.
        """
        height, width = picture.shape[:2]
        with silenced():
            found = self._graph.process(np.ascontiguousarray(picture)).multi_face_landmarks
        if not found:
            return None
        return np.array(
            [[p.x * width, p.y * height, -p.z * width] for p in found[0].landmark], np.float32
        )


def find_face(image: ByteArray, keypoints: FloatArray) -> FloatArray | None:
    """Find the landmarks of a person's face.

    Parameters
    ----------
    image : (H, W, 3) uint8
    keypoints : (33, 3)
        BlazePose landmarks in its pixels, which locate the face.

    Returns
    -------
    (478, 3) float32 or None
        u, v in pixels of `image`, and depth in the same unit, larger is nearer; None if no face is
        found, or it is too small.
    """
    head = keypoints[:11]
    if head[:7, 2].min() < 0.5:
        return None
    apart = float(np.linalg.norm(head[2, :2] - head[5, :2]))
    if apart < LEAST_FACE / 2:
        return None
    found = look_closely(
        image,
        head[:, :2].mean(axis=0),
        1.6 * max(float(np.ptp(head[:, :2], axis=0).max()), 1.5 * apart),
    )
    if found is None:
        return None
    # in three dimensions: a face in profile is as large as one from the front
    eyes = np.linalg.norm(found[33] - found[263])
    if (
        eyes < LEAST_FACE
        or np.linalg.norm(found[[33, 263], :2].mean(axis=0) - head[[2, 5], :2].mean(axis=0)) > eyes
    ):
        return None
    return found


def look_closely(image: ByteArray, middle: FloatArray, half: float) -> FloatArray | None:
    """Find landmarks of the face in a square: the median of the detections in `GLANCES`.

    A single detection is noisy: if the square moves by 3 %, landmarks move by up to 5 pixels on a
    face of 512 pixels (docs/face.md).

    Parameters
    ----------
    image : (H, W, 3) uint8
    middle : (2,)
        Middle of the square, pixels.
    half : float
        Half of the square's side, pixels.

    Returns
    -------
    (478, 3) float32 or None
        See `find_face`; None if fewer than half of the detections find a face.
    """
    seen = []
    with FaceDetector() as detector:
        for across, down, size in GLANCES:
            place = np.asarray(middle, np.float64) + half * np.array([across, down])
            picture, scale = cut_square(image, place, half * size, CROP)
            points = detector.one(picture)
            if points is not None:
                seen.append(from_square(points, place, scale, CROP))
    return np.median(seen, axis=0).astype(np.float32) if len(seen) > len(GLANCES) / 2 else None
