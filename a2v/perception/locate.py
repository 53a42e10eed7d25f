"""Find the person in a photo: landmarks, a rough mask, and other people."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.names import BLAZEPOSE, LANDMARK_INDEX
from a2v.perception.depth import put_upright
from a2v.perception.detector import Detection, Detector
from a2v.perception.landmarks import SKELETON_LINES
from a2v.perception.segmenter import (
    is_doubted,
    is_false,
    may_lack_parts,
    missing_parts,
    probability_of_people,
)
from a2v.types import BoolArray, ByteArray, FloatArray

_IN_BOX = 0.2
"""Smallest overlap (intersection over union) of a person's box and the user's box."""
NOBODY = (
    "no person found in the photo; use a photo that shows one whole person, "
    "or give --mask and --keypoints"
)


@dataclass(frozen=True, eq=False)
class Located:
    """A located person, in the photo's pixels.

    Attributes
    ----------
    keypoints : (33, 3) float32
    keypoints_3d : (33, 3) float32
    mask : (H, W) float32
        Rough mask of the person.
    others : (H, W) bool or None
        Mask of other people.
    boxes : (n, 4) float32 or None
        Left, top, right, bottom of all people who are large enough to be selected, the largest
        first; None for a single person.
    """

    keypoints: FloatArray
    keypoints_3d: FloatArray
    mask: FloatArray
    others: BoolArray | None = None
    boxes: FloatArray | None = None


Who = int | tuple[float, ...] | None
"""Selection among several people: a number by size from 1 on, or a box in pixels of the photo;
None: the largest."""


def locate(
    rgb: ByteArray,
    mask: FloatArray | None,
    keypoints: FloatArray | None,
    *,
    confidence: float,
    warnings: list[str],
    who: Who = None,
) -> Located:
    """Find the person; `mask` (H, W) and `keypoints` (33, 3) are those that the user gave, or None.

    Notes for the user are appended to `warnings`.

    Raises
    ------
    InputError
        Nobody is found, or two inputs select the person.
    """
    with Detector(confidence) as detector:
        if mask is None and keypoints is None:
            return _search(detector, rgb, who, warnings)
        if who is not None:
            raise InputError(
                "the corrections select a person, and so do a mask or keypoints; "
                "leave one of them out"
            )
        return _look_at_given(detector, rgb, mask, keypoints)


def _look_at_given(
    detector: Detector, rgb: ByteArray, mask: FloatArray | None, keypoints: FloatArray | None
) -> Located:
    """Find the person at the user's mask or keypoints; ignore the rest of the photo."""
    height, width = rgb.shape[:2]
    hint = _thicken(keypoints, height, width) if mask is None and keypoints is not None else mask
    assert hint is not None  # one of the two is given
    box = crop_box(hint, keypoints, (width, height), 0.15)
    person = _detect_in(detector, rgb, box, hint if mask is not None else None)
    if person is not None and keypoints is not None and not _agree(person.keypoints, keypoints):
        person = None
    if person is None and keypoints is None:
        raise InputError(
            "no person's pose found inside the mask; give --keypoints (OpenPose JSON) or another "
            "photo"
        )
    points = keypoints if keypoints is not None or person is None else person.keypoints
    assert points is not None
    points_3d = (
        put_upright(person.keypoints, person.keypoints_3d)
        if person is not None
        else np.full((len(BLAZEPOSE), 3), np.nan, np.float32)
    )
    rough = mask if mask is not None else person.mask if person is not None else hint
    return Located(points, points_3d, rough)


def _search(detector: Detector, rgb: ByteArray, who: Who, warnings: list[str]) -> Located:
    """Find the largest person in a photo, or the one selected by `who`."""
    height, width = rgb.shape[:2]
    others: BoolArray | None = None
    reduced, scale = _reduce(rgb, 1280)
    people = without_false(detector.people(reduced, full=rgb), reduced)
    if not people:
        raise InputError(NOBODY)
    big = [person for person in people if person.area > 0.15 * people[0].area]
    number = _selected(
        who, [scale * _box_of(person) for person in (big if isinstance(who, int) else people)]
    )
    best = people[number].scaled(scale, (0.0, 0.0), (width, height))
    if len(big) > 1 or number > 0:
        if who is None:
            warnings.append(
                f"{len(big)} people are in the photo; the largest is used (give --mask or "
                "--corrections to choose another)"
            )
        masks = [person.mask for person in people if person is not people[number]]
        union = np.max(masks, axis=0) > 0.5
        others = (resize(union.astype(np.float32), (width, height)) > 0.5) & (best.mask < 0.9)
    # search again in the crop of the person: landmarks and mask gain resolution
    box = crop_box(best.mask, best.keypoints, (width, height), 0.2)
    closer = _detect_in(detector, rgb, box, None, others)
    if closer is not None and _agree(closer.keypoints, best.keypoints):
        best = closer
    best = completed(detector, rgb, best, others)
    boxes = (
        np.array([scale * _box_of(person) for person in big], np.float32) if len(big) > 1 else None
    )
    return Located(
        best.keypoints, put_upright(best.keypoints, best.keypoints_3d), best.mask, others, boxes
    )


def without_false(people: list[Detection], picture: ByteArray) -> list[Detection]:
    """Drop detections of `picture` that are no people; keep all if none would be left."""
    if len(people) < 2 or not any(map(is_doubted, people)):
        return people
    probability = probability_of_people(picture)
    return [person for person in people if not is_false(person, probability)] or people


def _box_of(person: Detection) -> FloatArray:
    """Return left, top, right, bottom (4,) of a person's mask, or of the landmarks if the mask is
    empty."""
    rows, columns = np.nonzero(person.mask > 0.5)
    if len(rows):
        return np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1], np.float32)
    return np.concatenate(
        [person.keypoints[:, :2].min(axis=0), person.keypoints[:, :2].max(axis=0)]
    )


def _selected(who: Who, boxes: list[FloatArray]) -> int:
    """Return the number, from 0, of the selected person; `boxes` are those of all people.

    Raises
    ------
    InputError
        There is no person of that number, or nobody in the given box.
    """
    if who is None:
        return 0
    if isinstance(who, int):
        if who > len(boxes):
            raise InputError(
                f"the corrections select person {who}, but only {len(boxes)} are distinguished in "
                "the photo; give a box [left, top, right, bottom] instead"
            )
        return who - 1
    shares = []
    for box in boxes:
        low, high = np.maximum(box[:2], who[:2]), np.minimum(box[2:], who[2:])
        common = float(np.prod(np.maximum(high - low, 0)))
        shares.append(
            common
            / (float(np.prod(box[2:] - box[:2])) + (who[2] - who[0]) * (who[3] - who[1]) - common)
        )
    if max(shares) < _IN_BOX:
        raise InputError(
            f"no person is found in the box {', '.join(f'{value:.0f}' for value in who)} of the "
            "corrections; draw it around one person, or give --mask"
        )
    return int(np.argmax(shares))


def completed(
    detector: Detector, rgb: ByteArray, person: Detection, others: BoolArray | None
) -> Detection:
    """Add parts of the person that the detector has missed.

    If a second detection on the whole person is more confident, its landmarks are used.
    """
    if not may_lack_parts(person):
        return person
    reduced, _ = _reduce(rgb, 1280)
    size = (rgb.shape[1], rgb.shape[0])
    probability = resize(probability_of_people(reduced), size)
    missing = missing_parts(person.mask, probability, others)
    if not missing.any():
        return person
    whole = np.where(missing, probability, person.mask).astype(np.float32)
    again = _detect_in(detector, rgb, crop_box(whole, None, size, 0.15), whole)
    better = again is not None and again.keypoints[:, 2].mean() > person.keypoints[:, 2].mean()
    return dataclasses.replace(again if again is not None and better else person, mask=whole)


def _detect_in(
    detector: Detector,
    rgb: ByteArray,
    box: tuple[int, int, int, int],
    mask: FloatArray | None,
    others: BoolArray | None = None,
) -> Detection | None:
    """Find the person inside `box` of the photo, in the photo's pixels; the background of a given
    mask is replaced by gray."""
    import cv2

    left, top, right, bottom = box
    height, width = rgb.shape[:2]
    tile = rgb[top:bottom, left:right]
    if mask is not None:
        cover = cv2.GaussianBlur(
            mask[top:bottom, left:right], (0, 0), max(1.0, 0.004 * max(tile.shape[:2]))
        )
        opacity = np.maximum(cover, mask[top:bottom, left:right])[..., None]
        tile = (tile * opacity + 160 * (1 - opacity)).astype(np.uint8)
    elif others is not None:
        tile = np.where(others[top:bottom, left:right, None], 160, tile).astype(np.uint8)
    reduced, scale = _reduce(tile, 1024)
    person = detector.one(reduced) if mask is None else detector.persistent(reduced)
    return None if person is None else person.scaled(scale, (left, top), (width, height))


def _reduce(picture: ByteArray, side: int) -> tuple[ByteArray, float]:
    """Reduce a picture to a longer side of at most `side`; also return the factor to scale back."""
    longest = max(picture.shape[:2])
    if longest <= side:
        return np.ascontiguousarray(picture), 1.0
    scale = longest / side
    size = (max(1, round(picture.shape[1] / scale)), max(1, round(picture.shape[0] / scale)))
    return resize(picture, size), scale


def resize(picture: Any, size: tuple[int, int]) -> Any:
    """Resize a picture to (width, height); shrinking averages pixels."""
    import cv2

    if (picture.shape[1], picture.shape[0]) == size:
        return picture
    shrink = size[0] < picture.shape[1]
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA if shrink else cv2.INTER_LINEAR)


def _agree(a: FloatArray, b: FloatArray) -> bool:
    """Return whether two sets of landmarks are the same person: median distance under 8 % of the
    figure's extent."""
    both = (a[:, 2] > 0.3) & (b[:, 2] > 0.3)
    if both.sum() < 4:
        return False
    extent = float(np.ptp(b[both, :2], axis=0).max())
    return bool(np.median(np.linalg.norm(a[both, :2] - b[both, :2], axis=1)) < 0.08 * extent)


def _thicken(keypoints: FloatArray, height: int, width: int) -> FloatArray:
    """Draw a rough figure from landmarks: capsules for limbs, a disc for the head, a trunk."""
    import cv2

    canvas = np.zeros((height, width), np.uint8)
    seen = keypoints[:, 2] > 0.1
    extent = float(np.ptp(keypoints[seen, :2], axis=0).max())
    thick = max(2, round(0.07 * extent))
    for first, second in SKELETON_LINES:
        a, b = LANDMARK_INDEX[first], LANDMARK_INDEX[second]
        if seen[a] and seen[b]:
            ends = [tuple(round(float(x)) for x in keypoints[i, :2]) for i in (a, b)]
            cv2.line(canvas, ends[0], ends[1], 255, thick)
    trunk = [
        LANDMARK_INDEX[name]
        for name in ("left_shoulder", "right_shoulder", "right_hip", "left_hip")
    ]
    if seen[trunk].all():
        cv2.fillConvexPoly(canvas, np.round(keypoints[trunk, :2]).astype(np.int32), 255)
    face = [i for i in range(11) if seen[i]]
    if face:
        middle = keypoints[face, :2].mean(axis=0)
        cv2.circle(canvas, (int(middle[0]), int(middle[1])), max(2, round(0.075 * extent)), 255, -1)
    return canvas.astype(np.float32) / 255


def crop_box(
    mask: FloatArray, keypoints: FloatArray | None, size: tuple[int, int], margin: float
) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of a box around mask and landmarks with a margin, inside the
    photo."""
    rows, columns = np.nonzero(mask > 0.5)
    boxes = [(columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)] if len(rows) else []
    if keypoints is not None:
        seen = keypoints[keypoints[:, 2] > 0.5, :2]
        if len(seen):
            boxes.append((*np.clip(seen.min(axis=0), 0, size), *np.clip(seen.max(axis=0), 0, size)))
    if not boxes:
        raise InputError(NOBODY)
    low = np.min([box[:2] for box in boxes], axis=0)
    high = np.max([box[2:] for box in boxes], axis=0)
    border = margin * float((high - low).max()) + 2
    left, top = (max(0, int(np.floor(x - border))) for x in low)
    right, bottom = (
        min(limit, int(np.ceil(x + border))) for x, limit in zip(high, size, strict=True)
    )
    return left, top, max(right, left + 1), max(bottom, top + 1)
