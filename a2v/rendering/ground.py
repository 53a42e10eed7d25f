"""The fraction of its light that the ground keeps around a person.

It is traced separately from the picture, in cells that are as wide as deep on the ground.
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

_BORDER = 8
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
    separate picture if `clean`, and smoothly enlarged. Near contacts with the ground it is traced
    pixel by pixel. At the largest cell width only half of `samples` are traced.
    """
    size = len(empty.ground)
    kept = np.ones((size, size, 3), np.float32)
    wide = cell_width(camera)
    parts = [
        _Cells.of(weight, each)
        for weight, each in ((found.weight, wide), (found.contact, 1))
        if weight.any()
    ]
    if not parts:
        return kept
    first = np.concatenate([part.rows * size + part.columns * part.wide for part in parts])
    steps = np.repeat([part.wide for part in parts], [len(part.rows) for part in parts])
    light, at = (
        tracer.on_ground(
            first, steps, samples if wide < _WIDEST else -(-samples // 2), camera, size, seed
        ),
        0,
    )
    for part in parts:
        part.lay(light[at : at + len(part.rows)], empty, kept, clean)
        at += len(part.rows)
    return kept


@dataclass(frozen=True, kw_only=True)
class _Cells:
    """Cells of `wide` pixels of a row where `weight` (H, W) is above 0, at `rows` and `columns`
    (N,)."""

    weight: FloatArray
    wide: int
    rows: IntArray
    columns: IntArray

    @classmethod
    def of(cls, weight: FloatArray, wide: int) -> _Cells:
        rows, columns = np.nonzero(
            np.maximum.reduceat(weight, np.arange(0, len(weight), wide), axis=1)
        )
        return cls(weight=weight, wide=wide, rows=rows, columns=columns)

    def lay(self, light: FloatArray, empty: Empty, kept: FloatArray, clean: bool) -> None:
        """Blend the kept fraction of the empty stage's light into `kept` (H, W, 3), by weight.

        `light` (N, 3) is the traced irradiance over pi of the cells.
        """
        import cv2

        size, wide = len(kept), self.wide
        middle = np.minimum(self.columns * wide + wide // 2, size - 1)
        share = light / np.maximum(empty.light[self.rows, middle], 1e-6)
        top, left = (
            max(0, (int(at.min()) - _BORDER) // _GRAIN * _GRAIN) for at in (self.rows, self.columns)
        )
        ends = ((self.rows, size), (self.columns, -(-size // wide)))
        bottom, right = (
            min(most, -(-(int(at.max()) + 1 + _BORDER) // _GRAIN) * _GRAIN) for at, most in ends
        )
        cells = np.ascontiguousarray(kept[top:bottom, left * wide : right * wide : wide])
        cells[self.rows - top, self.columns - left] = np.where(np.isfinite(share), share, 1)
        if clean:
            cells = denoise_plain(cells)
        part = kept[top:bottom, left * wide : right * wide]
        whole = (
            cells
            if wide == 1
            else cv2.resize(
                cells, ((right - left) * wide, bottom - top), interpolation=cv2.INTER_LINEAR
            )
        )
        part += self.weight[top:bottom, left * wide : right * wide, None] * (
            whole[:, : part.shape[1]] - part
        )
