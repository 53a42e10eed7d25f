"""Landmarks of the parts of a face."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray

RIGHT_EYE = (33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246)
"""Mediapipe's landmarks around the opening of the person's right eye, from the outer corner under
it to the inner one and back above it."""
LEFT_EYE = (263, 249, 390, 373, 374, 380, 381, 382, 362, 398, 384, 385, 386, 387, 388, 466)
RIGHT_IRIS = (468, 469, 470, 471, 472)
"""Middle and four points of the rim."""
LEFT_IRIS = (473, 474, 475, 476, 477)
"""Middle and four points of the rim."""
LIPS = (61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291, 409, 270, 269, 267, 0, 37, 39, 40, 185)
MOUTH_ABOVE = (78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308)
MOUTH_BELOW = (78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308)
"""The opening of the mouth, both from the person's right corner to the left one."""
BROWS = (70, 63, 105, 66, 107, 46, 53, 52, 65, 55, 300, 293, 334, 296, 336, 276, 283, 282, 295, 285)
NOSE = (168, 6, 197, 195, 5, 4, 1, 2, 98, 327, 64, 294, 129, 358)
CHEEKS = (116, 345, 117, 346, 118, 347, 205, 425, 50, 280, 101, 330, 199, 175, 32, 262)
SURROUNDINGS = (205, 425, 50, 280, 199)
"""Cheeks and chin, up to which the patch extends."""


def placing_points(points: FloatArray) -> FloatArray:
    """Return those of the 478 points that place the face, (K, 2 or 3).

    The opening of the mouth counts as a line, even if it is open.
    """
    line = (points[list(MOUTH_ABOVE)] + points[list(MOUTH_BELOW)]) / 2
    return np.concatenate([points[[*RIGHT_EYE, *LEFT_EYE, *LIPS, *BROWS, *NOSE, *CHEEKS]], line])
