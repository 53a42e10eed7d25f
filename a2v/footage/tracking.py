"""Track one person through a video: landmarks, face and hands per frame."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace

import cv2
import numpy as np
from typing_extensions import Self

from a2v.errors import InputError
from a2v.footage.background import Background
from a2v.footage.hands import SIDES, HandTracker
from a2v.footage.reading import Shown
from a2v.footage.settings import FollowSettings
from a2v.perception.bodymap import height_in_pixels, look_at_body, mended
from a2v.perception.depth import put_upright
from a2v.perception.detector import Detection, Detector, cut_square
from a2v.perception.face import FaceDetector
from a2v.types import ByteArray, FloatArray

SQUARE = 448
"""Side in pixels of the detectors' input, a square around the person."""
AROUND = 1.4
"""Side of that square relative to the longer side of the person's box."""
SAME_BOX = 0.25
"""Smallest overlap (intersection over union) with the expected box."""
SAME_LOOK = 0.55
"""Smallest similarity of colors (Bhattacharyya coefficient) of two pictures of the same person."""
RARELY = 10
"""Number of frames between two searches of the whole picture for a lost person."""
_EYES = 26.0
"""Distance in pixels between the outer corners of the eyes below which a face is not used."""


@dataclass(frozen=True, kw_only=True)
class Sighting:
    """Observations of the person in one frame.

    Attributes
    ----------
    time : float
        Seconds.
    warp : (2, 3) float64
        From the previous frame, of the background (`a2v.footage.background.Change`).
    steady : bool
        Whether `warp` is known.
    cut : bool
        Another shot begins.
    keypoints : (33, 3) float32 or None
        u, v in pixels of the picture, confidence. This and the following are None if the person
        is not seen.
    points : (33, 3) float32 or None
        Meters of a person of typical height, from the middle of the hips, y up, +z towards the
        camera along the floor.
    height : float
        Standing height in pixels, from the lengths of the limbs.
    box : (4,) float32 or None
        Left, top, right, bottom, pixels.
    face : (478, 3) float16 or None
        Mediapipe's landmarks, in units of the eyes' distance from their middle: u, v, depth.
    hands : pair of (21, 3) float16 or None
        Left and right, as of `a2v.footage.hands.HandTracker.look`.
    """

    time: float
    warp: FloatArray
    steady: bool = False
    cut: bool = False
    keypoints: FloatArray | None = None
    points: FloatArray | None = None
    height: float = 0.0
    box: FloatArray | None = None
    face: FloatArray | None = None
    hands: tuple[FloatArray | None, FloatArray | None] = (None, None)


AHEAD = 4
"""Number of frames by which the search for the person runs ahead of body, face and hands."""


@dataclass(frozen=True, eq=False)
class _Spotted:
    """A person found in a frame: the detection in a square of the picture, the center of the square
    (2,) and its scale."""

    person: Detection
    square: ByteArray
    middle: FloatArray
    scale: float


class Tracker:
    """Tracks one person; use as a context manager.

    The search in the next frame needs only the position of the person in this one. A second thread
    computes body, face and hands.
    """

    def __init__(self, settings: FollowSettings) -> None:
        self.settings = settings
        self.people = 0  # largest number of people found in one search
        self.shape: tuple[int, int] | None = None
        self._background = Background()
        self._box: FloatArray | None = None
        self._speed = np.zeros(4, np.float32)
        self._look: FloatArray | None = None
        self._lost, self._count = 0, 0

    def __enter__(self) -> Self:
        self._stack = ExitStack()
        self._aside = self._stack.enter_context(ThreadPoolExecutor(1))
        self._pose = self._stack.enter_context(Detector())
        self._face = self._stack.enter_context(FaceDetector()) if self.settings.face else None
        self._hands = (
            [self._stack.enter_context(HandTracker()) for _ in SIDES] if self.settings.hands else []
        )
        self._turn = 0
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def follow(self, frames: Iterable[Shown]) -> Iterator[Sighting]:
        """Observe the person in every frame, in order."""
        waiting: deque[Future[Sighting]] = deque()
        for shown in frames:
            image, plain, spotted = self._spot(shown)
            waiting.append(self._aside.submit(self._seen, image, plain, spotted))
            if len(waiting) > AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()

    def _spot(self, shown: Shown) -> tuple[ByteArray, Sighting, _Spotted | None]:
        """Find the person in the next frame."""
        image = shown.image
        if self.shape is None:
            self.shape = image.shape[0], image.shape[1]
        elif image.shape[:2] != self.shape:
            image = np.asarray(cv2.resize(image, self.shape[::-1], interpolation=cv2.INTER_AREA))
        self._count += 1
        change = self._background.look(image, self._box)
        if change.cut:
            self._box, self._speed, self._lost = None, np.zeros(4, np.float32), 0
        found = self._find(image)
        plain = Sighting(time=shown.time, warp=change.warp, steady=change.known, cut=change.cut)
        if found is None:
            self._lost += 1
            return image, plain, None
        self._lost = 0
        look = _look_of(found.square, found.person.mask)
        self._look = look if self._look is None else 0.95 * self._look + 0.05 * look
        box = _in_picture(_box_of(found.person), found.middle, found.scale)
        if self._box is not None:
            self._speed = (0.5 * self._speed + 0.5 * (box - self._box)).astype(np.float32)
        self._box = box
        return image, plain, found

    # --- position of the person

    def _find(self, image: ByteArray) -> _Spotted | None:
        """Find the person near the expected place, or else in the whole picture."""
        if self._box is not None and self._lost < RARELY:
            expected = self._box + self._speed
            found = self._find_near(image, expected)
            if found is not None:
                return found
        if self._box is None or self._lost % RARELY == 0:
            return self._find_anywhere(image)
        return None

    def _find_near(self, image: ByteArray, expected: FloatArray) -> _Spotted | None:
        middle, half = _square_of(expected)
        square, scale = cut_square(image, middle, half, SQUARE)
        person = self._pose.one(square)
        if person is None:
            return None
        if not self._is_same(
            image, _in_picture(_box_of(person), middle, scale), expected, person, square
        ):
            others = self._pose._search(square, 3)[1:]
            person = next(
                (
                    other
                    for other in others
                    if self._is_same(
                        image, _in_picture(_box_of(other), middle, scale), expected, other, square
                    )
                ),
                None,
            )
            if person is None:
                return None
        return _Spotted(person, square, middle, scale)

    def _is_same(
        self,
        image: ByteArray,
        box: FloatArray,
        expected: FloatArray,
        person: Detection,
        square: ByteArray,
    ) -> bool:
        if _overlap(box, expected) < SAME_BOX:
            return False
        return (
            self._look is None or _likeness(self._look, _look_of(square, person.mask)) > SAME_LOOK
        )

    def _find_anywhere(self, image: ByteArray) -> _Spotted | None:
        """Search the whole picture: for the requested person at first, for the same person
        later."""
        shrink = min(1.0, 640 / max(image.shape[:2]))
        small = np.asarray(
            cv2.resize(image, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
        )
        people = (
            self._pose.people(small, limit=4)
            if self._count == 1 or self._lost % (3 * RARELY) == 0
            else _some(self._pose.one(small))
        )
        people = [person for person in people if person.area > 0.1 * people[0].area]
        self.people = max(self.people, len(people))
        if not people:
            return None
        chosen = self._selected(people, small)
        if chosen is None:
            return None
        box = _box_of(chosen) / shrink
        middle, half = _square_of(box)
        square, scale = cut_square(image, middle, half, SQUARE)
        closer = self._pose.one(square)
        if (
            closer is not None
            and _overlap(_in_picture(_box_of(closer), middle, scale), box) > SAME_BOX
        ):
            return _Spotted(closer, square, middle, scale)
        return None

    def _selected(self, people: list[Detection], picture: ByteArray) -> Detection | None:
        if self._look is not None and self._box is not None:  # the tracked person
            likely = [
                (person, _likeness(self._look, _look_of(picture, person.mask))) for person in people
            ]
            best, value = max(likely, key=lambda pair: pair[1])
            return best if value > SAME_LOOK else None
        number = self.settings.person
        if number:
            if number > len(people):
                return None
            return people[number - 1]
        width = picture.shape[1]
        return max(
            people,
            key=lambda person: (
                person.area * (1.2 - abs(float(_box_of(person)[[0, 2]].mean()) / width - 0.5))
            ),
        )

    # --- body, face and hands

    def _seen(self, image: ByteArray, plain: Sighting, spotted: _Spotted | None) -> Sighting:
        """Observe body, face and hands of a person who was found."""
        if spotted is None:
            return plain
        person, middle, scale = spotted.person, spotted.middle, spotted.scale
        try:
            found = look_at_body(spotted.square, person.mask, threads=1)
        except InputError:  # an empty mask
            return plain
        keypoints, points = mended(
            person.keypoints, put_upright(person.keypoints, person.keypoints_3d), found
        )
        keypoints[:, 2] = np.minimum(keypoints[:, 2], 0.3 + person.keypoints[:, 2])
        keypoints[:, :2] = (keypoints[:, :2] - SQUARE / 2) / scale + middle
        return replace(
            plain,
            keypoints=keypoints.astype(np.float32),
            points=points.astype(np.float32),
            height=float(height_in_pixels(found.landmarks) / scale),
            box=_in_picture(_box_of(person), middle, scale),
            face=self._see_face(image, keypoints),
            hands=self._see_hands(image, keypoints),
        )

    def _see_hands(
        self, image: ByteArray, keypoints: FloatArray
    ) -> tuple[FloatArray | None, FloatArray | None]:
        """Find the landmarks of one hand; left and right take turns."""
        found: list[FloatArray | None] = [None, None]
        if self._hands:
            self._turn = 1 - self._turn
            found[self._turn] = self._hands[self._turn].look(image, keypoints, SIDES[self._turn])
        return found[0], found[1]

    def _see_face(self, image: ByteArray, keypoints: FloatArray) -> FloatArray | None:
        head = keypoints[:11]
        if self._face is None or np.isin(head[[0, 2, 5], 2] < 0.4, True).any():
            return None
        apart = float(np.linalg.norm(head[3, :2] - head[6, :2]))
        if apart < _EYES / 4:
            return None
        half = 1.7 * max(float(np.ptp(head[:, :2], axis=0).max()), 1.5 * apart)
        square, _ = cut_square(image, head[:, :2].mean(axis=0).astype(np.float64), half, 256)
        found = self._face.one(square)
        if found is None:
            return None
        eyes = found[[33, 263]]
        distance = float(np.linalg.norm(eyes[0] - eyes[1]))
        if distance < _EYES:
            return None
        return np.asarray((found - eyes.mean(axis=0)) / distance, np.float16)


def _some(person: Detection | None) -> list[Detection]:
    return [] if person is None else [person]


def _box_of(person: Detection) -> FloatArray:
    """Return left, top, right, bottom (4,) of a box around a person's mask and reliable landmarks,
    in pixels of the detection."""
    rows, columns = np.nonzero(person.mask > 0.5)
    sure = person.keypoints[person.keypoints[:, 2] > 0.5, :2]
    low, high = sure.min(axis=0), sure.max(axis=0)
    if len(rows):
        low = np.minimum(low, [columns.min(), rows.min()])
        high = np.maximum(high, [columns.max() + 1, rows.max() + 1])
    return np.asarray(np.concatenate([low, high]), np.float32)


def _in_picture(box: FloatArray, middle: FloatArray, scale: float) -> FloatArray:
    found: FloatArray = ((box - SQUARE / 2) / scale + np.tile(middle, 2)).astype(np.float32)
    return found


def _square_of(box: FloatArray) -> tuple[FloatArray, float]:
    """Return the center (2,) and half the side of the detectors' square."""
    low, high = box[:2].astype(np.float64), box[2:].astype(np.float64)
    return (low + high) / 2, max(AROUND * float((high - low).max()) / 2, 16.0)


def _overlap(one: FloatArray, two: FloatArray) -> float:
    """Return the intersection over union of two boxes (4,)."""
    low, high = np.maximum(one[:2], two[:2]), np.minimum(one[2:], two[2:])
    common = float(np.prod(np.maximum(high - low, 0)))
    areas = float(np.prod(one[2:] - one[:2]) + np.prod(two[2:] - two[:2]))
    return common / max(areas - common, 1e-9)


def _look_of(picture: ByteArray, mask: FloatArray) -> FloatArray:
    """Return histograms (2, 64) of the colors of the upper and the lower half of a person."""
    inside = mask > 0.6
    rows = np.nonzero(inside.any(axis=1))[0]
    if not len(rows):
        return np.full((2, 64), 1 / 64, np.float32)
    small = (picture >> 6).astype(np.int64)
    codes = small[..., 0] * 16 + small[..., 1] * 4 + small[..., 2]
    middle = int(np.median(np.nonzero(inside)[0]))
    halves = []
    for part in (slice(None, middle), slice(middle, None)):
        counts = np.bincount(codes[part][inside[part]], minlength=64).astype(np.float32) + 1e-3
        halves.append(counts / counts.sum())
    return np.stack(halves)


def _likeness(one: FloatArray, two: FloatArray) -> float:
    return float(np.sqrt(one * two).sum(axis=1).mean())
