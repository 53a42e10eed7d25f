"""Patterns of objects."""

from __future__ import annotations

import colorsys

import cv2
import numpy as np

from a2v.lab.studio.things.solids import TILE
from a2v.types import ByteArray, FloatArray


def draw_patterns(generator: np.random.Generator, count: int) -> list[ByteArray]:
    """Draw `count` patterns (TILE, TILE, 3) uint8: plain, striped, checked, dotted, printed with
    lines, grained or blotched."""
    return [_pattern(generator) for _ in range(count)]


def _color(generator: np.random.Generator) -> FloatArray:
    """Draw an sRGB color (3,) in [0, 1]: any hue, also black and white."""
    value = generator.choice(
        [generator.uniform(0.02, 0.2), generator.uniform(0.2, 0.95), generator.uniform(0.85, 1.0)],
        p=[0.25, 0.5, 0.25],
    )
    return np.array(
        colorsys.hsv_to_rgb(generator.random(), generator.uniform(0, 0.95) ** 1.5, value),
        np.float32,
    )


def _pattern(generator: np.random.Generator) -> ByteArray:
    first, second = _color(generator), _color(generator)
    rows, columns = np.mgrid[:TILE, :TILE]
    kind, period, duty = generator.random(), generator.uniform(4, 40), generator.uniform(0.2, 0.7)
    across = columns if generator.random() < 0.5 else rows
    if kind < 0.45:
        amount = np.zeros((TILE, TILE))
    elif kind < 0.6:
        amount = (across % period < duty * period).astype(float)
    elif kind < 0.68:
        amount = 0.5 * (
            (rows % period < duty * period).astype(float) + (columns % period < duty * period)
        )
    elif kind < 0.74:
        amount = (
            ((rows % period) / period - 0.5) ** 2 + ((columns % period) / period - 0.5) ** 2
            < (0.5 * duty) ** 2
        ).astype(float)
    elif kind < 0.82:  # something printed
        amount = np.zeros((TILE, TILE))
        for _ in range(int(generator.integers(2, 9))):
            left, top = generator.integers(4, TILE - 12, 2)
            amount[
                top : top + int(generator.integers(2, 14)),
                left : left + int(generator.integers(6, 44)),
            ] = generator.uniform(0.3, 1)
    else:  # grain (narrow in one direction) or blots
        cells = (TILE // 2, 3) if kind < 0.92 else (6, 6)
        coarse = generator.random(cells).astype(np.float32)
        amount = np.clip(cv2.resize(coarse, (TILE, TILE), interpolation=cv2.INTER_CUBIC), 0, 1) * (
            0.4 if kind < 0.92 else 1.0
        )
    mixed = first + amount[..., None] * (second - first)
    noise = generator.normal(0, generator.uniform(0, 0.03), (TILE, TILE, 1))
    return np.asarray(np.rint(255 * np.clip(mixed + noise, 0, 1)), np.uint8)
