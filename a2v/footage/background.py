"""Measure camera motion and cuts from the background of a video."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from a2v.types import ByteArray, FloatArray

WIDTH = 320
"""Longer side in pixels of the frames in which the background is tracked."""
FEATURES = 160
"""Number of tracked corners."""
LEAST = 12
"""Number of consistent corners below which the result is ignored."""
_THUMB = (32, 18)
_CUT = 26.0
"""Mean difference of two thumbnails, out of 255, above which a cut is possible."""
_FOLLOWED = 0.35
"""Share of the corners that must be found again within one shot."""


@dataclass(frozen=True)
class Change:
    """Change of the background from the previous frame to this one.

    Attributes
    ----------
    warp : (2, 3) float64
        Similarity from pixels of the background in the previous frame to this one.
    known : bool
        Whether enough of the background was tracked; otherwise `warp` is the identity.
    cut : bool
        Whether another shot begins.
    """

    warp: FloatArray
    known: bool
    cut: bool


SAME = np.eye(2, 3)


class Background:
    """Tracks corners beside the person (Lucas and Kanade 1981) and fits a similarity by RANSAC."""

    def __init__(self) -> None:
        self._gray: ByteArray | None = None
        self._corners: FloatArray | None = None
        self._thumb: FloatArray | None = None

    def look(self, image: ByteArray, box: FloatArray | None) -> Change:
        """Compare a frame with the previous one.

        Parameters
        ----------
        image : (H, W, 3) uint8
        box : (4,) or None
            Left, top, right, bottom of the person in this frame, pixels. This region is not
            background.
        """
        shrink = min(1.0, WIDTH / max(image.shape[:2]))
        small = cv2.resize(image, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
        gray = np.asarray(cv2.cvtColor(small, cv2.COLOR_RGB2GRAY))
        thumb = cv2.resize(small, _THUMB, interpolation=cv2.INTER_AREA).astype(np.float32)
        change = self._change(gray, thumb, shrink)
        around = np.full(gray.shape, 255, np.uint8)
        if box is not None:
            low, high = box[:2] * shrink, box[2:] * shrink
            grown = 0.12 * (high - low)
            left, top = np.maximum(low - grown, 0).astype(int)
            right, bottom = np.ceil(high + grown).astype(int)
            around[top:bottom, left:right] = 0
        self._corners = cv2.goodFeaturesToTrack(gray, FEATURES, 0.01, 6, mask=around)
        self._gray, self._thumb = gray, thumb
        return change

    def _change(self, gray: ByteArray, thumb: FloatArray, shrink: float) -> Change:
        if self._gray is None or self._thumb is None or self._gray.shape != gray.shape:
            return Change(SAME, False, False)
        differs = float(np.abs(thumb - self._thumb).mean()) > _CUT
        if self._corners is None or len(self._corners) < LEAST:
            return Change(SAME, False, differs)
        found, status, _ = cv2.calcOpticalFlowPyrLK(
            self._gray, gray, self._corners, None, winSize=(15, 15), maxLevel=3
        )
        good = status.ravel() == 1
        if good.sum() < LEAST:
            return Change(SAME, False, differs)
        warp, inliers = cv2.estimateAffinePartial2D(
            self._corners[good],
            found[good],
            method=cv2.RANSAC,
            ransacReprojThreshold=1.0,
            maxIters=500,
        )
        agreed = 0 if inliers is None else int(inliers.sum())
        if warp is None or agreed < LEAST or agreed < _FOLLOWED * len(self._corners):
            return Change(SAME, False, differs)
        warp[:, 2] /= shrink
        return Change(np.asarray(warp, np.float64), True, False)
