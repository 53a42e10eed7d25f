"""Predict the unseen side of a head from its outline in the photo: hair row by row, its end, and
the collar."""

from __future__ import annotations

import numpy as np

from a2v.geometry.images import nearest_known, sample_image
from a2v.reconstruction.palettes import lab_of
from a2v.types import BoolArray, FloatArray

_SHADE = np.array([0.5, 1.0, 1.0])
"""Weights of lightness, a and b in comparisons of colors: shadows are the same material."""


class HeadLook:
    """The unseen side of a head, predicted from its outline in the photo.

    Attributes
    ----------
    top, eye_line, chin, nape : float
        Rows of the photo, pixels.
    middle : float
        Column of the head's middle, pixels.
    unit : float
        Height from the eyes to the mouth, or half the distance of the ears, pixels.
    skin, hair : (3,)
        CIELAB.
    collar : float
        Row at which the sides of the neck turn from skin to clothes.
    hair_end : float
        Row down to which hair hangs beside the neck; at least the nape.
    """

    def __init__(
        self,
        clean: FloatArray,
        person: BoolArray,
        box: tuple[float, float, float, float, float],
        *,
        skin: FloatArray,
        typical: FloatArray,
    ) -> None:
        left, top, right, chin, eye_line = box
        self.top, self.eye_line = top, eye_line
        self.unit, self.middle, self.chin = (chin - eye_line) / 2.1, (left + right) / 2, chin
        self.nape = eye_line + 1.3 * self.unit
        self.skin = lab_of(skin)
        self._lab = lab_of(clean)
        height = len(person)
        self._centers, self._halves = _row_extents(person, left, right)
        first, last = max(0, int(top)), min(height - 1, int(self.nape))
        rows = np.arange(first, last + 1)
        sides = []
        for side in (-1, 1):
            column = self._centers[rows] + side * 0.82 * self._halves[rows]
            found = sample_image(clean, np.stack([column, rows + 0.5], axis=1)).astype(np.float64)
            bare = self._toward_skin(lab_of(found), lab_of(typical)) > 0.18
            sides.append(
                _filled_rows(np.where(bare[:, None], np.nan, found), typical, 0.12 * self.unit)
            )
        self._first, self._sides = first, sides
        self.hair = lab_of(
            np.median(
                np.concatenate([side[: max(1, int(eye_line) - first)] for side in sides]), axis=0
            )
        )
        self.collar = self._collar(person)
        self.hair_end = self._hair_end(person)

    def _toward_skin(self, colors: FloatArray, hair: FloatArray) -> FloatArray:
        """Return the position of CIELAB colors (..., 3) between `hair` (0) and the skin (1) by hue.

        By hue, glossy hair and striped hats do not count as skin.
        """
        hue = np.array([0.15, 1.0, 1.0])
        way = (self.skin - hair) * hue
        share: FloatArray = ((colors - hair) * hue) @ way / max(float(way @ way), 1e-6)
        return share

    @staticmethod
    def _nearer(colors: FloatArray, one: FloatArray, other: FloatArray) -> BoolArray:
        """Return which CIELAB colors (..., 3) are nearer to `one` than to `other`; lightness counts
        half."""
        return np.asarray(
            np.linalg.norm((colors - one) * _SHADE, axis=-1)
            < np.linalg.norm((colors - other) * _SHADE, axis=-1)
        )

    def _window(self, row: int, low: float, high: float) -> FloatArray:
        """Return the colors of a row from `low` to `high` units beside the middle, on both
        sides."""
        columns = np.arange(self._lab.shape[1])
        distance = np.abs(columns - self.middle) / self.unit
        found: FloatArray = self._lab[row, (distance >= low) & (distance <= high)]
        return found

    def _cloth(self) -> FloatArray | None:
        """Median color of the clothes below the neck; None if that is skin."""
        rows = range(int(self.chin + 1.5 * self.unit), int(self.chin + 3.5 * self.unit))
        found = [self._window(row, 1.0, 2.5) for row in rows if row < len(self._lab)]
        if not found:
            return None
        color: FloatArray = np.median(np.concatenate(found), axis=0)
        return None if np.linalg.norm((color - self.skin) * _SHADE) < 9 else color

    def _collar(self, person: BoolArray) -> float:
        """Row at which the sides of the neck turn from skin to clothes."""
        cloth = self._cloth()
        default = self.chin + 0.2 * self.unit
        if cloth is None:
            return default
        rows = np.arange(
            int(self.chin - 0.6 * self.unit), min(int(self.chin + 1.5 * self.unit), len(person))
        )
        for row in rows:
            edge = [int(self._centers[row] + side * 0.8 * self._halves[row]) for side in (-1, 1)]
            inner = self._lab[row, np.clip(edge, 0, self._lab.shape[1] - 1)]
            if (
                self._nearer(inner, cloth, self.skin).all()
                and not self._nearer(inner, self.hair, cloth).any()
            ):
                return float(row)
        return default

    def _hair_end(self, person: BoolArray) -> float:
        """Row down to which hair hangs beside the neck; at least the nape."""
        end = self.nape
        cloth = self._cloth()
        for row in range(int(self.nape), min(int(self.chin + 3 * self.unit), len(person))):
            columns = np.nonzero(person[row])[0]
            columns = columns[
                (np.abs(columns - self.middle) > 0.7 * self.unit)
                & (np.abs(columns - self.middle) < 2.2 * self.unit)
            ]
            colors = self._lab[row, columns]
            like = np.linalg.norm((colors - self.hair) * _SHADE, axis=-1) < 18
            like &= ~self._nearer(colors, self.skin, self.hair)
            if cloth is not None:
                like &= ~self._nearer(colors, cloth, self.hair)
            if like.sum() < 0.2 * self.unit:
                break
            end = float(row)
        return end if end > self.nape + 0.8 * self.unit else self.nape

    def around(self, row: FloatArray, across: FloatArray) -> FloatArray:
        """Colors (N, 3) at pixel rows (N,) and distances beside the middle (N,), pixels, blended
        from the left border to the right one."""
        place = np.clip(row.astype(np.int64) - self._first, 0, len(self._sides[0]) - 1)
        half = self._halves[np.clip(row.astype(np.int64), 0, len(self._halves) - 1)]
        share = np.clip(0.5 + 0.6 * across / np.maximum(half, 1.0), 0, 1)[:, None]
        mixed: FloatArray = (1 - share) * self._sides[0][place] + share * self._sides[1][place]
        return mixed

    def without_neckline(self, clean: FloatArray) -> FloatArray:
        """The photo with skin and hair around the neckline replaced by the nearest clothes."""
        import cv2

        cloth = self._cloth()
        if cloth is None:
            return clean
        height, width = clean.shape[:2]
        top, bottom = (
            max(0, int(self.chin - self.unit)),
            min(height, int(self.chin + 8 * self.unit)),
        )
        low, high = (
            max(0, int(self.middle - 3.5 * self.unit)),
            min(width, int(self.middle + 3.5 * self.unit)),
        )
        part = self._lab[top:bottom, low:high]
        bare = self._nearer(part, self.skin, cloth) & (
            np.linalg.norm((part - self.skin) * _SHADE, axis=-1) < 22
        )
        if self.hair_end > self.nape:
            bare |= self._nearer(part, self.hair, cloth) & (
                np.linalg.norm((part - self.hair) * _SHADE, axis=-1) < 12
            )
        # lapels, ties and zips belong to the front
        bare[
            : max(1, int(self.chin + 4 * self.unit) - top),
            np.abs(np.arange(low, high) - self.middle) < 1.1 * self.unit,
        ] = True
        bare[: max(1, int(self.collar) - top)] = True
        size = max(3, int(0.25 * self.unit) | 1)
        bare = cv2.dilate(
            bare.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
        ).astype(bool)
        if bare.all():
            return clean
        index = nearest_known(~bare)
        result = clean.copy()
        patch = clean[top:bottom, low:high][index[0], index[1]]
        blurred = cv2.GaussianBlur(patch, (0, 0), max(0.8, 0.25 * self.unit))
        result[top:bottom, low:high] = np.where(
            bare[..., None], blurred, clean[top:bottom, low:high]
        )
        return result


def _filled_rows(values: FloatArray, fallback: FloatArray, width: float) -> FloatArray:
    """Fill NaN rows of (N, 3) from the nearest known ones, and smooth over `width` rows."""
    from scipy.ndimage import gaussian_filter1d

    known = np.nonzero(np.isfinite(values[:, 0]))[0]
    if len(known) == 0:
        return np.tile(fallback, (len(values), 1))
    near = known[np.abs(np.arange(len(values))[:, None] - known[None]).argmin(axis=1)]
    smooth: FloatArray = gaussian_filter1d(values[near], max(width, 0.5), axis=0, mode="nearest")
    return smooth


def _row_extents(person: BoolArray, left: float, right: float) -> tuple[FloatArray, FloatArray]:
    """Middle and half width of the head in each row of the mask, between the columns `left` and
    `right`, pixels."""
    low, high = max(0, int(left)), min(person.shape[1], int(right) + 1)
    window = person[:, low:high]
    first = window.argmax(axis=1) + low
    last = high - window[:, ::-1].argmax(axis=1)
    empty = ~window.any(axis=1)
    first[empty], last[empty] = int((left + right) / 2), int((left + right) / 2) + 1
    return (first + last) / 2, (last - first) / 2
