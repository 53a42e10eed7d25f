"""The 33 BlazePose landmarks, and landmarks of OpenPose in their order."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import parse_json
from a2v.kinematics.names import BLAZEPOSE, LANDMARK_INDEX
from a2v.types import FloatArray

SKELETON_LINES: tuple[tuple[str, str], ...] = (
    ("left_shoulder", "right_shoulder"),
    ("left_hip", "right_hip"),
    ("left_shoulder", "left_hip"),
    ("right_shoulder", "right_hip"),
    ("left_shoulder", "left_elbow"),
    ("left_elbow", "left_wrist"),
    ("left_wrist", "left_index"),
    ("right_shoulder", "right_elbow"),
    ("right_elbow", "right_wrist"),
    ("right_wrist", "right_index"),
    ("left_hip", "left_knee"),
    ("left_knee", "left_ankle"),
    ("left_ankle", "left_foot_index"),
    ("right_hip", "right_knee"),
    ("right_knee", "right_ankle"),
    ("right_ankle", "right_foot_index"),
    ("nose", "left_shoulder"),
    ("nose", "right_shoulder"),
)
"""Pairs of landmarks to draw, or to thicken into a rough figure."""

MAX_JSON_BYTES = 16 << 20

_ARMS = (
    "nose",
    None,
    *(f"{side}_{joint}" for side in ("right", "left") for joint in ("shoulder", "elbow", "wrist")),
)  # None: neck
_LEGS = tuple(f"{side}_{joint}" for side in ("right", "left") for joint in ("hip", "knee", "ankle"))
_FACE = ("right_eye", "left_eye", "right_ear", "left_ear")
_FEET = (
    "left_foot_index",
    None,
    "left_heel",
    "right_foot_index",
    None,
    "right_heel",
)  # the big toe stands for the foot index
_COCO_18 = (*_ARMS, *_LEGS, *_FACE)
_BODY_25 = (*_ARMS, None, *_LEGS, *_FACE, *_FEET)  # None: middle of the hips
_HAND = {
    2: "thumb",
    5: "index",
    17: "pinky",
}  # knuckles of OpenPose's hand that BlazePose also has


def read_openpose(
    data: bytes | str, *, photo_size: tuple[int, int] | None = None, name: str = "keypoints"
) -> FloatArray:
    """Read the landmarks of the largest person in a JSON file that OpenPose wrote.

    BODY_25 and COCO-18 layouts (``people[i].pose_keypoints_2d``: x, y, confidence) are
    distinguished by length; knuckles come from ``hand_left_keypoints_2d`` and
    ``hand_right_keypoints_2d`` if present.

    Parameters
    ----------
    data : bytes or str
        The JSON text itself.
    photo_size : tuple of 2 int, optional
        Width and height of the photo in pixels; needed only for coordinates that OpenPose scaled to
        [0, 1].
    name : str
        Name in error messages.

    Returns
    ------- (33, 3) float32: u, v in pixels of the upright photo, confidence in [0, 1]; 0 if
    OpenPose has no such landmark.

    Raises
    ------
    InputError
        Not JSON, another layout, invalid numbers, or no person in it.
    """
    expected = (
        "expected OpenPose's JSON with people[..].pose_keypoints_2d of 25 or 18 points "
        "(x, y, confidence)"
    )
    if len(data) > MAX_JSON_BYTES:
        raise InputError(f"{name} has {len(data) >> 20} MB; {expected}")
    document = parse_json(
        data.encode("utf-8", "surrogatepass") if isinstance(data, str) else data,
        name,
        expected.removeprefix("expected "),
    )
    people = document.get("people") if isinstance(document, dict) else None
    if not isinstance(people, list):
        raise InputError(f"{name} has no list 'people'; {expected}")
    if not people:
        raise InputError(
            f"{name} lists nobody; run OpenPose on a photo with a person, or leave the keypoints "
            "out"
        )
    found = [_read_person(person, name, expected) for person in people]
    best = max(found, key=_extent)
    seen = best[:, 2] > 0
    if seen.sum() < 4:
        raise InputError(
            f"{name}: the largest person has {int(seen.sum())} landmarks; at least 4 are needed"
        )
    if np.abs(best[seen, :2]).max() <= 1.0:
        if photo_size is None:
            raise InputError(
                f"{name} holds coordinates in [0, 1]; expected pixels (run OpenPose with "
                "--keypoint_scale 0)"
            )
        best[:, :2] *= np.asarray(photo_size, np.float32)
    return best


def _read_person(person: Any, name: str, expected: str) -> FloatArray:
    points = _read_points(
        person.get("pose_keypoints_2d") if isinstance(person, dict) else None, name, expected
    )
    if len(points) not in (18, 25):
        raise InputError(f"{name} has a person of {len(points)} points; {expected}")
    layout = _COCO_18 if len(points) == 18 else _BODY_25
    landmarks = np.zeros((len(BLAZEPOSE), 3), np.float32)
    for point, landmark in zip(points, layout, strict=True):
        if landmark is not None:
            landmarks[LANDMARK_INDEX[landmark]] = point
    for side in ("left", "right"):
        hand = person.get(f"hand_{side}_keypoints_2d")
        if hand:
            knuckles = _read_points(hand, name, expected)
            if len(knuckles) == 21:
                for source, finger in _HAND.items():
                    landmarks[LANDMARK_INDEX[f"{side}_{finger}"]] = knuckles[source]
    landmarks[:, 2] = np.clip(landmarks[:, 2], 0, 1)
    return landmarks


def _read_points(values: Any, name: str, expected: str) -> FloatArray:
    if not isinstance(values, list) or not values or len(values) % 3:
        raise InputError(f"{name} has a person without pose_keypoints_2d triples; {expected}")
    if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        raise InputError(f"{name} has coordinates that are no numbers; {expected}")
    try:
        points = np.asarray(values, np.float64).reshape(-1, 3)
    except OverflowError:
        points = np.full((1, 3), np.inf)
    if not np.isfinite(points).all() or np.abs(points).max() > 1e6:
        raise InputError(f"{name} has coordinates that are NaN or beyond any photo; {expected}")
    return points.astype(np.float32)


def _extent(landmarks: FloatArray) -> float:
    """Return the area of the box around the visible landmarks, square pixels."""
    seen = landmarks[landmarks[:, 2] > 0.05, :2]
    return float(np.prod(np.ptp(seen, axis=0) + 1)) if len(seen) else 0.0
