"""Check a person's mask by mediapipe's segmenters of people, which do not depend on the pose."""

from __future__ import annotations

from typing import Any

import numpy as np

from a2v.kinematics.names import LANDMARK_INDEX
from a2v.perception.detector import Detection, Solution, silenced
from a2v.types import BoolArray, ByteArray, FloatArray

SURE = 0.93
"""Least mean probability of a missing piece that belongs to the person."""
PIECE = 0.05
"""Smallest area of a missing piece, as a share of the mask's."""
LARGE = 0.25
"""Smallest area of all missing pieces together, as a share of the mask's."""
NEAR = 0.03
"""Largest distance of a missing piece from the mask, as a share of the mask's extent."""
SEEN = 0.7
"""Confidence of a limb's landmark below which a part of the person may have been overlooked."""
DOUBTED = 0.7
"""Mean confidence of the landmarks below which a detection may be no person."""
IMPROBABLE = 0.35
"""Mean probability of people inside of a doubted detection's mask below which it is no person."""
_LIMB_LANDMARKS = [
    LANDMARK_INDEX[f"{side}_{joint}"]
    for side in ("left", "right")
    for joint in ("elbow", "wrist", "knee", "ankle")
]


class Segmenter(Solution):
    """One of mediapipe's segmenters; `wide` selects the one for wide pictures."""

    def __init__(self, *, wide: bool) -> None:
        self._wide = wide

    def _made(self, solutions: Any) -> Any:
        return solutions.selfie_segmentation.SelfieSegmentation(model_selection=int(self._wide))

    def probability(self, picture: ByteArray) -> FloatArray:
        """Return the probability of people (H, W) float32 at the pixels of `picture` (H, W, 3)
        uint8."""
        with silenced():
            result = self._graph.process(np.ascontiguousarray(picture))
        return np.asarray(result.segmentation_mask, np.float32)


def probability_of_people(picture: ByteArray) -> FloatArray:
    """Return the smaller of both segmenters' probabilities (H, W) at the pixels of `picture` (H, W,
    3) uint8."""
    found = []
    for wide in (False, True):
        with Segmenter(wide=wide) as segmenter:
            found.append(segmenter.probability(picture))
    return np.minimum(*found)


def may_lack_parts(person: Detection) -> bool:
    """Return whether the detector's confidence of a limb is low, or a limb lies outside of the
    mask."""
    height, width = person.mask.shape
    limbs = person.keypoints[_LIMB_LANDMARKS]
    columns, rows = (
        np.clip(limbs[:, axis].astype(int), 0, size - 1) for axis, size in ((0, width), (1, height))
    )
    return bool((limbs[:, 2] < SEEN).any() or (person.mask[rows, columns] < 0.3).any())


def is_doubted(person: Detection) -> bool:
    """Return whether the detector's mean confidence is so low that a detection may be no person."""
    return float(person.keypoints[:, 2].mean()) < DOUBTED


def is_false(person: Detection, probability: FloatArray) -> bool:
    """Return whether a detection is no person: the detector doubts it and the segmenters see nobody
    there.

    `probability` (H, W) is that of people at the pixels of the detection's mask.

    The detector takes wallpaper, curtains and furniture for people where it finds no others.
    """
    inside = person.mask > 0.5
    return is_doubted(person) and not (
        inside.any() and float(probability[inside].mean()) >= IMPROBABLE
    )


def missing_parts(mask: FloatArray, probability: FloatArray, others: BoolArray | None) -> BoolArray:
    """Find pieces (H, W) of a person that are missing in a mask (H, W).

    They are large, lie next to the mask, have a high probability, and are not in `others` (H, W).

    The pose detector overlooks the legs of people who stoop or are seen from behind.
    """
    import cv2

    body = (mask > 0.5).astype(np.uint8)
    found = np.zeros(mask.shape, bool)
    if not body.any():
        return found
    extent = float(max(np.ptp(axis) + 1 for axis in np.nonzero(body)))
    candidates = ((probability > 0.5) & (cv2.dilate(body, _disc(0.01 * extent)) == 0)).astype(
        np.uint8
    )
    if others is not None:
        candidates[cv2.dilate(others.astype(np.uint8), _disc(0.01 * extent)) > 0] = 0
    candidates = cv2.morphologyEx(candidates, cv2.MORPH_OPEN, _disc(0.02 * extent))
    around = cv2.dilate(body, _disc(NEAR * extent)) > 0
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(candidates)
    for number in range(1, count):
        own = pieces == number
        if (
            stats[number, cv2.CC_STAT_AREA] > PIECE * body.sum()
            and (own & around).any()
            and probability[own].mean() > SURE
        ):
            found |= own
    if found.sum() < LARGE * body.sum():
        return np.zeros_like(found)
    joined = (
        cv2.morphologyEx(
            (found | (body > 0)).astype(np.uint8), cv2.MORPH_CLOSE, _disc(NEAR * extent)
        )
        > 0
    )
    return np.asarray(found | (joined & (body == 0) & (probability > 0.5)))


def _disc(radius: float) -> ByteArray:
    import cv2

    size = 2 * max(1, round(radius)) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
