"""The fraction of its light that the ground keeps around a person.

It is traced separately from the picture, in cells of a few pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.rendering.camera import ViewCamera
from a2v.rendering.denoising import denoise_plain
from a2v.rendering.empty import Empty
from a2v.rendering.region import Region
from a2v.rendering.tracer import Tracer
from a2v.types import FloatArray, IntArray

_WIDEST = 4
"""Largest number of pixels of a row in a cell."""
_FINE = 384
"""In pictures of at least this size (pixels), cells have two rows, and two columns near contacts
with the ground; in smaller ones that would blur the shadows visibly."""

_BORDER = 2
"""Number of extra cells on each side of the shown ones for the denoiser."""
_GRAIN = 16
"""The denoised part begins at multiples of this number of cells, the denoiser's own raster.
Otherwise a moving picture would flicker."""


def cell_width(camera: ViewCamera) -> int:
    """Return the number of pixels of a row that span the same distance on the ground as two rows,
    at the camera's target.

    It is a power of two up to 4.
    """
    way = np.subtract(camera.origin, (camera.target[0], 0.0, camera.target[2]))
    down = abs(float(way[1])) / max(float(np.linalg.norm(way)), 1e-6)
    return min(_WIDEST, 1 << int(np.log2(1 / min(max(down, 0.05), 1.0))))


def kept_light(
    tracer: Tracer,
    found: Region,
    empty: Empty,
    camera: ViewCamera,
    samples: int,
    seed: int,
    *,
    clean: bool = True,
) -> FloatArray:
    """Return the fraction of the empty stage's light that the ground keeps (H, W, 3), per color.

    It is 1 where nobody changes the light. The ground's light is smooth and its pattern is known.
    So it is traced in cells of several pixels of a row (also behind the person), denoised as a
    separate picture if `clean`, and smoothly enlarged. Near contacts with the ground the cells are
    smaller.
    """
    size = len(empty.ground)
    kept = np.ones((size, size, 3), np.float32)
    wide, many = cell_width(camera), 2 if size >= _FINE else 1
    parts = [
        _Cells.of(weight, (tall, each))
        for weight, tall, each in ((found.weight, many, wide), (found.contact, 1, many))
        if weight.any()
    ]
    if not parts:
        return kept
    first = np.concatenate(
        [part.rows * part.tall * size + part.columns * part.wide for part in parts]
    )
    sides = np.repeat(
        [(part.wide, part.tall) for part in parts], [len(part.rows) for part in parts], axis=0
    )
    light, at = (
        tracer.on_ground(first, sides, samples, camera, size, seed),
        0,
    )
    for part in parts:
        part.lay(light[at : at + len(part.rows)], empty, kept, clean)
        at += len(part.rows)
    return kept


@dataclass(frozen=True, kw_only=True)
class _Cells:
    """Cells of `tall` rows and `wide` columns of pixels where `weight` (H, W) is above 0.

    `rows` and `columns` (N,) are counted in cells.
    """

    weight: FloatArray
    tall: int
    wide: int
    rows: IntArray
    columns: IntArray

    @classmethod
    def of(cls, weight: FloatArray, sides: tuple[int, int]) -> _Cells:
        most = weight
        for axis, side in enumerate(sides):
            if side > 1:
                most = np.maximum.reduceat(most, np.arange(0, len(weight), side), axis=axis)
        rows, columns = np.nonzero(most)
        return cls(weight=weight, tall=sides[0], wide=sides[1], rows=rows, columns=columns)

    def lay(self, light: FloatArray, empty: Empty, kept: FloatArray, clean: bool) -> None:
        """Blend the kept fraction of the empty stage's light into `kept` (H, W, 3), by weight.

        `light` (N, 3) is the traced irradiance over pi of the cells.
        """
        import cv2

        size = len(kept)
        sides = self.tall, self.wide
        middle = [
            np.minimum(at * side + side // 2, size - 1)
            for at, side in zip((self.rows, self.columns), sides, strict=True)
        ]
        share = light / np.maximum(empty.light[middle[0], middle[1]], 1e-6)
        spans = []
        for at, side in zip((self.rows, self.columns), sides, strict=True):
            low = max(0, (int(at.min()) - _BORDER) // _GRAIN * _GRAIN)
            high = -(-(int(at.max()) + 1 + _BORDER) // _GRAIN) * _GRAIN
            spans.append((low, min(-(-size // side), high)))
        (top, bottom), (left, right) = spans
        window = (
            slice(top * self.tall, bottom * self.tall),
            slice(left * self.wide, right * self.wide),
        )
        cells = np.ascontiguousarray(kept[window][:: self.tall, :: self.wide])
        cells[self.rows - top, self.columns - left] = np.where(np.isfinite(share), share, 1)
        if clean:
            cells = denoise_plain(cells)
        part = kept[window]
        whole = cells
        if sides != (1, 1):
            shape = (right - left) * self.wide, (bottom - top) * self.tall
            whole = cv2.resize(cells, shape, interpolation=cv2.INTER_LINEAR)
        part += self.weight[window][..., None] * (whole[: len(part), : part.shape[1]] - part)
