"""People in a picture by mediapipe, which finds one person at a time."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from typing_extensions import Self

from a2v.kinematics.names import MIRRORED_BLAZEPOSE
from a2v.perception.mediapipe import load_mediapipe
from a2v.types import BoolArray, ByteArray, FloatArray

_WIDER = (0.0, 0.12, 0.3, 0.6)
"""Borders that are added if nobody is found, as shares of the longer side: stooping people and
people seen from behind are found when they are smaller."""
_CONSPICUOUS = 0.02
"""Smallest share of the picture that a person found in this way fills. Smaller people are searched
in tiles."""


@dataclass(frozen=True, kw_only=True)
class Detection:
    """One person that mediapipe found.

    Attributes
    ----------
    keypoints : (33, 3) float32
        u, v in pixels of the picture, confidence in [0, 1].
    keypoints_3d : (33, 3) float32
        Meters, relative to the middle of the hips, y up, +z towards the camera.
    mask : (H, W) float32
        Probability of the person, resolution of the picture.
    """

    keypoints: FloatArray
    keypoints_3d: FloatArray
    mask: FloatArray

    @property
    def area(self) -> float:
        """Size of the person: pixels of the mask."""
        return float((self.mask > 0.5).sum())

    def mirrored(self) -> Detection:
        """The person in the mirrored picture."""
        keypoints, keypoints_3d = (
            self.keypoints[MIRRORED_BLAZEPOSE],
            self.keypoints_3d[MIRRORED_BLAZEPOSE],
        )
        keypoints[:, 0] = self.mask.shape[1] - keypoints[:, 0]
        keypoints_3d[:, 0] *= -1
        return Detection(
            keypoints=keypoints,
            keypoints_3d=keypoints_3d,
            mask=np.ascontiguousarray(self.mask[:, ::-1]),
        )

    def scaled(self, scale: float, offset: tuple[float, float], size: tuple[int, int]) -> Detection:
        """Map the detection to a picture of `size` (width, height).

        Pixel p of this detection's picture is ``p * scale + offset`` of the other one.
        """
        import cv2

        keypoints = self.keypoints.copy()
        keypoints[:, :2] = keypoints[:, :2] * scale + np.asarray(offset, np.float32)
        placed = np.zeros((size[1], size[0]), np.float32)
        # warpAffine counts from the center of the first pixel, we from its corner
        shift = np.asarray(offset) + (scale - 1) / 2
        matrix = np.array([[scale, 0, shift[0]], [0, scale, shift[1]]], np.float64)
        cv2.warpAffine(self.mask, matrix, size, dst=placed, flags=cv2.INTER_LINEAR)
        return Detection(keypoints=keypoints, keypoints_3d=self.keypoints_3d, mask=placed)


_REMARK = re.compile(rb"(INFO|WARNING|libEGL warning|MESA[\w-]*): |[IW]\d{4}")
"""Beginnings of log lines of mediapipe's C++ (absl, TensorFlow Lite) and of graphics libraries that
report no error."""


@contextmanager
def silenced() -> Iterator[None]:
    """Remove the log lines of mediapipe's C++ code from the process's stderr.

    Python's settings do not control them. All other lines are written at the end.
    """
    sys.stderr.flush()
    saved = os.dup(2)
    with tempfile.TemporaryFile() as kept:
        try:
            os.dup2(kept.fileno(), 2)
            yield
        finally:
            sys.stderr.flush()
            os.dup2(saved, 2)
            kept.seek(0)
            for line in kept.read().splitlines(keepends=True):
                if line.strip() and not _REMARK.match(line):
                    os.write(saved, line)
            os.close(saved)


class Solution:
    """A graph of mediapipe with the models of its wheel; use as a context manager."""

    _graph: Any = None

    def _made(self, solutions: Any) -> Any:
        """Make the graph of ``mediapipe.solutions``."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        os.environ.setdefault("GLOG_minloglevel", "3")
        os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
        with silenced():
            self._graph = self._made(load_mediapipe().solutions)
            self._graph._graph.wait_until_idle()  # its threads open the models, and log it
        return self

    def __exit__(self, *_: object) -> None:
        with silenced():
            self._graph.close()


def cut_square(
    image: ByteArray, middle: FloatArray, half: float, pixels: int
) -> tuple[ByteArray, float]:
    """Cut a square out of `image` (H, W, 3) and scale it to (pixels, pixels, 3).

    `middle` (2,) and half of the side, `half`, are in pixels. Also returns the scale: pixels of the
    square per pixel of the image.
    """
    import cv2

    scale = pixels / (2 * half)
    shift = (
        pixels / 2 - scale * middle + (scale - 1) / 2
    )  # warpAffine counts from the center of the first pixel
    matrix = np.array([[scale, 0, shift[0]], [0, scale, shift[1]]])
    flags = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
    return np.asarray(
        cv2.warpAffine(
            image, matrix, (pixels, pixels), flags=flags, borderMode=cv2.BORDER_REPLICATE
        )
    ), scale


def from_square(points: FloatArray, middle: FloatArray, scale: float, pixels: int) -> FloatArray:
    """Convert points (n, 3) of u, v and depth from a square of `cut_square` to the image."""
    found = points.copy()
    found[:, :2] = (points[:, :2] - pixels / 2) / scale + middle
    found[:, 2] = points[:, 2] / scale
    return found


class Detector(Solution):
    """Mediapipe's pose graph with the bundled models (complexity 1); use as a context manager.

    Parameters
    ----------
    confidence : float
        Minimum confidence of a detection, in (0, 1).
    """

    def __init__(self, confidence: float = 0.5) -> None:
        self.confidence = confidence

    def _made(self, solutions: Any) -> Any:
        return solutions.pose.Pose(
            static_image_mode=True,
            model_complexity=1,
            enable_segmentation=True,
            min_detection_confidence=self.confidence,
        )

    def one(self, picture: ByteArray) -> Detection | None:
        """Return the most conspicuous person of `picture` (H, W, 3) uint8, or None."""
        height, width = picture.shape[:2]
        with silenced():
            result = self._graph.process(np.ascontiguousarray(picture))
        if result.pose_landmarks is None or result.segmentation_mask is None:
            return None
        keypoints = np.array(
            [[p.x * width, p.y * height, p.visibility] for p in result.pose_landmarks.landmark],
            np.float32,
        )
        outside = (
            (keypoints[:, :2] < 0).any(axis=1)
            | (keypoints[:, 0] > width)
            | (keypoints[:, 1] > height)
        )
        keypoints[:, 2] = np.clip(
            np.where(outside, np.minimum(keypoints[:, 2], 0.3), keypoints[:, 2]), 0, 1
        )
        world = np.array(
            [[p.x, -p.y, -p.z] for p in result.pose_world_landmarks.landmark], np.float32
        )
        mask = np.clip(np.asarray(result.segmentation_mask, np.float32), 0, 1)
        detection = Detection(keypoints=keypoints, keypoints_3d=world, mask=mask)
        return detection if _is_plausible(detection) else None

    def persistent(self, picture: ByteArray) -> Detection | None:
        """Search with `one`; if it finds nobody, with `one_wider`."""
        return self.one(picture) or self.one_wider(picture)

    def one_wider(self, picture: ByteArray) -> Detection | None:
        """Return the largest person in smaller and mirrored pictures with wider borders, or
        None."""
        import cv2

        found: list[Detection] = []
        height, width = picture.shape[:2]
        for share in _WIDER:
            border = round(share * max(height, width))
            wider = cv2.copyMakeBorder(
                picture, border, border, border, border, cv2.BORDER_REPLICATE
            )
            shrink = max(1.0, max(wider.shape[:2]) / 1024)
            size = (round(wider.shape[1] / shrink), round(wider.shape[0] / shrink))
            smaller = cv2.resize(wider, size, interpolation=cv2.INTER_AREA)
            for mirrored in (False, True):
                if (person := self.one(smaller[:, ::-1] if mirrored else smaller)) is not None:
                    person = person.mirrored() if mirrored else person
                    found.append(
                        person.scaled(wider.shape[1] / size[0], (-border, -border), (width, height))
                    )
        return max(found, key=lambda person: person.area, default=None)

    def people(
        self, picture: ByteArray, *, limit: int = 5, full: ByteArray | None = None
    ) -> list[Detection]:
        """Find several people of `picture` (H, W, 3) uint8, largest first, in its pixels.

        `full` is the same picture at full resolution, where tiles are cut from.

        Each person found is painted over before the next search, first in the whole picture and
        then, while nobody was found, in wider ones (`one_wider`) and in overlapping tiles of a
        half, a quarter and an eighth of its longer side: mediapipe overlooks people under a third
        of its picture.
        """
        import cv2

        found = self._search(picture, limit)
        if (
            not found
            and (person := self.one_wider(picture)) is not None
            and person.area > _CONSPICUOUS * picture.shape[0] * picture.shape[1]
        ):
            found.append(person)
        size = (picture.shape[1], picture.shape[0])
        full = picture if full is None else full
        height, width = full.shape[:2]
        back = size[0] / width
        for part in (2, 4, 8):
            side = max(height, width) // part
            if found or side < 160:
                break
            for top in _starts(height, side):
                for left in _starts(width, side):
                    tile = full[top : top + side, left : left + side]
                    shrink = max(1.0, side / 512)
                    if shrink > 1:
                        reduced = (
                            max(1, round(tile.shape[1] / shrink)),
                            max(1, round(tile.shape[0] / shrink)),
                        )
                        tile = cv2.resize(tile, reduced, interpolation=cv2.INTER_AREA)
                    if float(tile.std(axis=(0, 1)).max()) < 4:  # sky
                        continue
                    for person in self._search(tile, 2):
                        whole = self._search_around(
                            full,
                            person.scaled(shrink, (left, top), (1, 1)).keypoints[:, :2],
                            back,
                            size,
                        )
                        placed = whole or person.scaled(
                            shrink * back, (left * back, top * back), size
                        )
                        if not any(
                            _overlap(placed.mask > 0.5, other.mask > 0.5) > 0.3 for other in found
                        ):
                            found.append(placed)
        return sorted(found, key=lambda person: -person.area)

    def _search_around(
        self, full: ByteArray, points: FloatArray, back: float, size: tuple[int, int]
    ) -> Detection | None:
        """Search again around a person that a tile's edge may have cut."""
        import cv2

        low, high = points.min(axis=0), points.max(axis=0)
        middle, half = (low + high) / 2, 0.85 * float((high - low).max())
        left, top = (max(0, int(x)) for x in middle - half)
        right, bottom = (
            int(x) for x in np.ceil(np.minimum(middle + half, (full.shape[1], full.shape[0])))
        )
        tile = full[top:bottom, left:right]
        if min(tile.shape[:2]) < 16:
            return None
        shrink = max(1.0, max(tile.shape[:2]) / 512)
        reduced = (max(1, round(tile.shape[1] / shrink)), max(1, round(tile.shape[0] / shrink)))
        person = self.one(cv2.resize(tile, reduced, interpolation=cv2.INTER_AREA))
        return (
            None
            if person is None
            else person.scaled(shrink * back, (left * back, top * back), size)
        )

    def _search(self, picture: ByteArray, limit: int) -> list[Detection]:
        import cv2

        found: list[Detection] = []
        rest = picture
        taken = np.zeros(picture.shape[:2], bool)
        while len(found) < limit:
            person = self.one(rest)
            if person is None:
                break
            body = person.mask > 0.5
            # a remnant of a person who was painted over
            if (body & taken).sum() > 0.3 * body.sum():
                break
            found.append(person)
            grown = cv2.dilate(
                (person.mask > 0.2).astype(np.uint8), np.ones((9, 9), np.uint8)
            ).astype(bool)
            taken |= grown
            rest = _paint_over(rest, grown)
        return found


def _starts(length: int, side: int) -> list[int]:
    if length <= side:
        return [0]
    count = int(np.ceil((length - side) / (side / 2))) + 1
    return [round(float(start)) for start in np.linspace(0, length - side, count)]


def _overlap(a: BoolArray, b: BoolArray) -> float:
    return float((a & b).sum() / max(1, min(int(a.sum()), int(b.sum()))))


def _paint_over(picture: ByteArray, region: BoolArray) -> ByteArray:
    """Fill `region` with strongly blurred surroundings, so that no figure remains."""
    import cv2

    height, width = picture.shape[:2]
    kernel = (max(3, (width // 4) | 1), max(3, (height // 4) | 1))
    weight = cv2.blur((~region).astype(np.float32), kernel)
    around = cv2.blur(np.where(region[..., None], 0, picture).astype(np.float32), kernel)
    known = picture[~region]
    mean = known.mean(axis=0) if len(known) else np.full(3, 128.0)
    fill = np.where(weight[..., None] > 1e-3, around / np.maximum(weight, 1e-3)[..., None], mean)
    return np.where(region[..., None], np.clip(fill, 0, 255), picture).astype(np.uint8)


def _is_plausible(person: Detection) -> bool:
    """Return whether landmarks and mask belong to the same figure (mediapipe sometimes detects one
    in a texture)."""
    height, width = person.mask.shape
    if person.area < 0.001 * height * width:
        return False
    sure = person.keypoints[person.keypoints[:, 2] > 0.5]
    if len(sure) < 8:
        return False
    columns = np.clip(sure[:, 0].astype(int), 0, width - 1)
    rows = np.clip(sure[:, 1].astype(int), 0, height - 1)
    import cv2

    reach = max(3, int(0.05 * np.ptp(sure[:, 1]))) | 1
    grown = cv2.dilate((person.mask > 0.4).astype(np.uint8), np.ones((reach, reach), np.uint8))
    return bool(grown[rows, columns].mean() > 0.6)
