"""Landmarks of the hands by mediapipe's hand models, which are in its wheel."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.kinematics.names import LANDMARK_INDEX
from a2v.perception.detector import Solution, cut_square, from_square, silenced
from a2v.types import ByteArray, FloatArray

HAND_POINTS = 21
"""Landmarks of a hand: the wrist, then four of each finger from the thumb to the little one, from
the palm to the tip."""
CROP = 256
"""Side of the square in which a hand is detected, pixels."""
LEAST_HAND = 12.0
"""Smallest distance between wrist and knuckles, pixels, of a hand that is detected."""
GLANCES = (0.8, 1.0, 1.25)
"""Squares in which a hand is detected, in sides of the square."""
_FAR = 1.0
"""Distance of the wrist, in lengths of the palm, above which the detected hand is another one."""


class HandDetector(Solution):
    """Mediapipe's hands; use as a context manager."""

    def _made(self, solutions: Any) -> Any:
        graph = solutions.hands.Hands(
            static_image_mode=True,
            max_num_hands=1,
            model_complexity=1,
            min_detection_confidence=0.4,
        )
        graph.process(
            np.zeros((32, 32, 3), np.uint8)
        )  # it starts in a thread of its own, and logs what it does
        return graph

    def one(self, picture: ByteArray) -> tuple[FloatArray, str, float] | None:
        """Find the hand in `picture` (H, W, 3) uint8; None if there is no hand.

        Returns
        -------
        points : (21, 3) float32
            u, v, pixels, and depth in them, larger is nearer, 0 at the wrist.
        side : "left" or "right"
            Side of the person.
        confidence : float
            Confidence in the side, 0.5 to 1.
        """
        height, width = picture.shape[:2]
        with silenced():
            found = self._graph.process(np.ascontiguousarray(picture))
        if not found.multi_hand_landmarks:
            return None
        points = np.array(
            [
                [p.x * width, p.y * height, -p.z * width]
                for p in found.multi_hand_landmarks[0].landmark
            ],
            np.float32,
        )
        side = found.multi_handedness[0].classification[0]
        return (
            points,
            "right" if side.label == "Left" else "left",
            float(side.score),
        )  # it takes pictures to be mirrored


def find_hands(image: ByteArray, keypoints: FloatArray) -> FloatArray | None:
    """Find the landmarks of a person's hands: the median of the detections in `GLANCES`.

    A hand counts if most detections find a hand of that side at its wrist.

    Parameters
    ----------
    image : (H, W, 3) uint8
    keypoints : (33, 3)
        BlazePose landmarks in its pixels, which locate the hands.

    Returns
    -------
    (2, 21, 4) float32 or None
        The left hand and the right one: u, v in pixels of `image`, depth in the same unit, larger
        is nearer, 0 at the wrist, and 1; zeros for a hand that is not visible. None if neither
        hand is visible.
    """
    found = np.zeros((2, HAND_POINTS, 4), np.float32)
    squares = [_square(keypoints, side) for side in ("left", "right")]
    if not any(squares):
        return None
    with HandDetector() as detector:
        for row, side, square in zip(found, ("left", "right"), squares, strict=True):
            points = _look(detector, image, side, *square) if square else None
            if points is not None:
                row[:, :3], row[:, 3] = points, 1
    return found if found.any() else None


def _square(keypoints: FloatArray, side: str) -> tuple[FloatArray, FloatArray, float] | None:
    """Return the wrist (2,), the middle (2,) of a square around the hand, and half of its side.

    All are in pixels; None if no hand can be expected.
    """
    wrist, elbow, index, little = (
        keypoints[LANDMARK_INDEX[f"{side}_{name}"]] for name in ("wrist", "elbow", "index", "pinky")
    )
    if min(wrist[2], index[2], little[2]) < 0.5:
        return None
    reach = (index[:2] + little[:2]) / 2 - wrist[:2]
    half = max(
        0.6 * float(np.linalg.norm(wrist[:2] - elbow[:2])), 1.6 * float(np.linalg.norm(reach))
    )
    return (wrist[:2], wrist[:2] + reach, half) if half > 2 * LEAST_HAND else None


def _look(
    detector: HandDetector,
    image: ByteArray,
    side: str,
    wrist: FloatArray,
    middle: FloatArray,
    half: float,
) -> FloatArray | None:
    seen = []
    for size in GLANCES:
        picture, scale = cut_square(image, middle.astype(np.float64), half * size, CROP)
        hand = detector.one(picture)
        if hand is None or hand[1] != side:
            continue
        points = from_square(hand[0], middle, scale, CROP)
        length = float(np.linalg.norm(points[[5, 9, 13, 17], :3].mean(axis=0) - points[0]))
        if np.linalg.norm(points[0, :2] - wrist) < _FAR * max(length, LEAST_HAND):
            seen.append(points)
    return np.median(seen, axis=0).astype(np.float32) if len(seen) > len(GLANCES) / 2 else None
