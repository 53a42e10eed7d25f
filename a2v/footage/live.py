"""Observe one person in the frames of a camera while they arrive, with past frames only."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np
from typing_extensions import Self

from a2v.errors import InputError
from a2v.footage.tracking import Sighting
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.perception.bodymap import height_in_pixels, look_at_body, mended
from a2v.perception.depth import picture_plane, put_upright
from a2v.perception.detector import Detection, Detector
from a2v.types import ByteArray, FloatArray

SPENT = 0.08
"""Processor time per frame, in seconds, up to which the body map is computed as well."""
LEAST_BODY_MAP = 4
"""Number of frames after which the body map is computed at the latest."""
_BLEND = 0.2
"""Share of the newest frame in running means."""


class VideoDetector(Detector):
    """Mediapipe's pose graph with its own tracking and smoothing from frame to frame."""

    def _made(self, solutions: Any) -> Any:
        return solutions.pose.Pose(
            static_image_mode=False,
            model_complexity=1,
            enable_segmentation=True,
            min_detection_confidence=self.confidence,
        )


class LiveTracker:
    """Observes one person frame after frame; use as a context manager.

    The detector runs in every frame. The body map is skipped in some frames if both together take
    longer than `SPENT`. Landmarks of skipped frames get the last correction of the body map.

    Parameters
    ----------
    spent : float
        Processor time per frame, seconds.
    """

    def __init__(self, spent: float = SPENT) -> None:
        self.spent = spent
        self._owed = 0.0  # processor time above the limit, seconds
        self._since = 0
        self._tall = 0.0  # standing height relative to the detector's scale, 0 if unknown
        self._gap: FloatArray | None = None

    def __enter__(self) -> Self:
        self._stack = ExitStack()
        self._pose = self._stack.enter_context(VideoDetector())
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def look(self, image: ByteArray, time: float, *, used: float = 0.0) -> Sighting:
        """Observe the person in the next frame.

        Parameters
        ----------
        image : (H, W, 3) uint8
            sRGB, upright.
        time : float
            Seconds; larger than the last one.
        used : float
            Processor time that the caller needs for a frame, seconds.
        """
        begun = process_time()
        plain = Sighting(time=time, warp=np.eye(2, 3), steady=True)
        person = self._pose.one(image)
        if person is None:
            self._gap = None
            return plain
        points = put_upright(person.keypoints, person.keypoints_3d)
        seen = self._with_map(image, person, points) if self._due() else None
        if seen is None:
            seen = self._without_map(person, points)
        self._owed = max(0.0, self._owed + process_time() - begun + used - self.spent)
        keypoints, points, height = seen
        return replace(plain, keypoints=keypoints, points=points, height=height)

    def _due(self) -> bool:
        """Return whether the body map is computed in this frame."""
        self._since += 1
        if self._owed > 0 and self._since < LEAST_BODY_MAP and self._gap is not None:
            self._owed = max(0.0, self._owed - self.spent / 2)
            return False
        self._since = 0
        return True

    def _with_map(
        self, image: ByteArray, person: Detection, points: FloatArray
    ) -> tuple[FloatArray, FloatArray, float] | None:
        try:
            found = look_at_body(image, person.mask, threads=1)
        except InputError:  # an empty mask
            return None
        keypoints, merged = mended(person.keypoints, points, found)
        keypoints[:, 2] = np.minimum(keypoints[:, 2], 0.3 + person.keypoints[:, 2])
        height = height_in_pixels(found.landmarks)
        _, scale = picture_plane(person.keypoints, person.keypoints_3d)
        if scale >= 1.0:
            tall = height / scale
            self._tall = tall if not self._tall else (1 - _BLEND) * self._tall + _BLEND * tall
        self._gap = merged[:, 2] - _of_typical_size(points, self._tall)[:, 2]
        return keypoints, merged, height

    def _without_map(
        self, person: Detection, points: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        tall = self._tall or TYPICAL_HEIGHT
        _, scale = picture_plane(person.keypoints, person.keypoints_3d)
        placed = _of_typical_size(points, tall)
        if self._gap is not None:
            placed[:, 2] += self._gap
            self._gap = self._gap * (1 - _BLEND)
        return person.keypoints, placed, max(1.0, float(scale * tall))


def _of_typical_size(points: FloatArray, tall: float) -> FloatArray:
    """Scale points (33, 3) of a person of height `tall` to one of typical height."""
    return np.asarray(points * (TYPICAL_HEIGHT / max(tall, 1e-3)), np.float32)
