"""Distances of faces by dlib's descriptor: below `SAME` two pictures show the same person.

dlib's five-point and descriptor models are CC0 (King, http://dlib.net). The package of the models
has others with other licenses; they are not used.
"""

from __future__ import annotations

import functools
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import MissingDependencyError
from a2v.types import ByteArray, FloatArray

SAME = 0.6
"""Distance of descriptors below which dlib's authors take two faces for those of one person."""
_LEAST = 160
"""Smallest width of a face that the detector gets, pixels; smaller ones are enlarged."""
_MODELS = ("shape_predictor_5_face_landmarks.dat", "dlib_face_recognition_resnet_model_v1.dat")
_BOX = (10, 152, 234, 454)
"""Mediapipe's landmarks at the top, the chin and both sides of a face."""


def face_descriptor(picture: ByteArray, landmarks: FloatArray) -> FloatArray:
    """The descriptor (128,) of a face.

    Parameters
    ----------
    picture : (H, W, 3) uint8
    landmarks : (478, 3)
        Mediapipe's, in its pixels. They place the face, so that a turned one is found too.

    Raises
    ------
    MissingDependencyError
        dlib or its models are not installed.
    """
    import cv2
    import dlib

    points, network = load_models()
    corners = landmarks[list(_BOX), :2].astype(np.float64)
    wide = max(float(np.ptp(landmarks[:, 1])), 1.0)
    zoom = max(1.0, _LEAST / wide)
    low = np.maximum(np.floor(corners.mean(axis=0) - 1.2 * wide).astype(int), 0)
    high = np.ceil(corners.mean(axis=0) + 1.2 * wide).astype(int)
    window = np.ascontiguousarray(picture[low[1] : high[1], low[0] : high[0]])
    large = cv2.resize(window, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_CUBIC)
    # dlib's boxes go from the brows to the chin
    chin, top = corners[1], corners[0]
    middle, half = (0.4 * top + 0.6 * chin - low) * zoom, 0.45 * wide * zoom
    box = dlib.rectangle(*(int(x) for x in (*(middle - half), *(middle + half))))
    shape = points(large, box)
    return np.asarray(network.compute_face_descriptor(large, shape, 0, 0.25), np.float64)


@functools.cache
def load_models() -> tuple[Any, Any]:
    """Load dlib's predictor of five points, and its network.

    Raises
    ------
    MissingDependencyError
        dlib or its models are not installed.
    """
    found = find_spec("face_recognition_models")
    if find_spec("dlib") is None or found is None or not found.submodule_search_locations:
        raise MissingDependencyError(
            "faces are compared by dlib, which is not installed; install it with: pip install "
            "'a2v[evaluation]'"
        )
    import dlib

    first, second = (
        str(Path(found.submodule_search_locations[0]) / "models" / name) for name in _MODELS
    )
    return dlib.shape_predictor(first), dlib.face_recognition_model_v1(second)
