"""Paths on the ground from points and drawings, and the position of a person along one over
time."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.errors import InputError
from a2v.io import brief, read_bytes, reading
from a2v.plain_yaml import parse_yaml
from a2v.types import FloatArray

MAX_POINTS = 10_000
MAX_BYTES = MAX_POINTS * 100

MIN_METRES = 0.1
"""Shortest path, meters: a shorter one is a place."""
MAX_METRES = 2000.0
"""Longest path, meters: a longer one needs more frames than a motion may have. The limit also keeps
coordinates small."""

SVG_METRES = 0.01
"""Meters per unit of a drawing."""

ROUNDING = 0.12
"""Standard deviation, meters along the path, of the smoothing of its corners: a right angle is cut
by 7 cm."""

SIDEWAYS = 1.8
"""Acceleration in turns, m/s²: the person slows down for a corner."""
ALONG = 2.0
"""Acceleration of speeding up and braking, m/s²."""
SLOWEST = 0.4

AHEAD = 0.3
"""Seconds before and after a moment over which the heading is measured."""

_GRID = 0.02


@dataclass(frozen=True)
class GroundPath:
    """A path over the ground.

    Attributes
    ----------
    points : (N, 2) float
        x and z, meters; at least two, each different from the previous one.
    """

    points: FloatArray

    def __post_init__(self) -> None:
        points = np.asarray(self.points, np.float64)
        if points.ndim != 2 or points.shape[1:] != (2,) or not 2 <= len(points) <= MAX_POINTS:
            raise InputError(
                f"a path has shape {points.shape}; expected 2 to {MAX_POINTS} points of x and z, "
                "meters"
            )
        if not np.isfinite(points).all():
            bad = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
            raise InputError(
                f"point {bad + 1} of the path is {points[bad, 0]:g},{points[bad, 1]:g}; expected "
                "finite numbers, meters"
            )
        if np.abs(points).max() > MAX_METRES:
            raise InputError(
                f"a point of the path is {np.abs(points).max():g} m away; expected at most "
                f"{MAX_METRES:g}"
            )
        if (np.linalg.norm(np.diff(points, axis=0), axis=1) < 1e-6).any():
            raise InputError("two consecutive points of the path are equal; leave one out")
        if not MIN_METRES <= self.lengths[-1] <= MAX_METRES:
            raise InputError(
                f"the path is {self.lengths[-1]:g} m long; expected {MIN_METRES:g} to "
                f"{MAX_METRES:g}"
            )

    @property
    def lengths(self) -> FloatArray:
        """Distance along the path from the first point to each (N,), meters."""
        return np.concatenate(
            [[0.0], np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))]
        )

    def at(self, way: FloatArray) -> FloatArray:
        """Return the points (..., 2) at distances `way` (...) along the path, meters; beyond the
        ends it is extended straight."""
        lengths, points = self.lengths, np.asarray(self.points, np.float64)
        way = np.asarray(way, np.float64)
        inside = np.stack([np.interp(way, lengths, points[:, axis]) for axis in (0, 1)], axis=-1)
        first, last = (
            step / np.linalg.norm(step) for step in (points[1] - points[0], points[-1] - points[-2])
        )
        placed: FloatArray = (
            inside
            + np.maximum(way - lengths[-1], 0)[..., None] * last
            + np.minimum(way, 0)[..., None] * first
        )
        return placed


@dataclass(frozen=True)
class Way:
    """Position and heading of a person along a path.

    Attributes
    ----------
    points : (T, 2) float
        x and z, meters, frame by frame.
    heading : (T,) float
        Direction of the way, radians about +y from +z, without jumps of a full turn.
    """

    points: FloatArray
    heading: FloatArray


def way_along(path: GroundPath, *, pace: float, fps: float) -> Way:
    """Return positions and headings along a path at `pace`, meters per second.

    Corners are rounded, and walked slowly. The way ends at the end of the path.
    """
    length = float(path.lengths[-1])
    grid = np.linspace(0.0, length, max(4, int(length / _GRID) + 1))
    step = grid[1]
    far = int(np.ceil(4 * ROUNDING / step))
    points = gaussian_filter1d(
        path.at(np.arange(-far, len(grid) + far) * step), ROUNDING / step, axis=0
    )[far:-far]
    turned = np.unwrap(np.arctan2(*np.gradient(points, axis=0).T))
    curved = np.abs(np.gradient(turned, step))
    speed = np.clip(np.sqrt(SIDEWAYS / np.maximum(curved, 1e-6)), SLOWEST * pace, pace)
    for order in (slice(None), slice(None, None, -1)):  # brake in time, and speed up again
        squares = speed[order] ** 2
        for at in range(1, len(squares)):
            squares[at] = min(squares[at], squares[at - 1] + 2 * ALONG * step)
        speed[order] = np.sqrt(squares)
    took = np.concatenate([[0.0], np.cumsum(step / (0.5 * (speed[1:] + speed[:-1])))])
    times = np.arange(int(took[-1] * fps) + 1) / fps
    reached = np.interp(times, took, grid)
    placed = np.stack([np.interp(reached, grid, points[:, axis]) for axis in (0, 1)], axis=-1)
    ahead = np.interp(times, took, turned)
    pad = int(4 * AHEAD * fps) + 1
    smooth = gaussian_filter1d(np.pad(ahead, pad, mode="edge"), AHEAD * fps, axis=0)[pad:-pad]
    return Way(placed, smooth)


def read_path(text: str) -> GroundPath:
    """Read a path from points "x,z x,z ...", meters, or from a file.

    ``.csv``: two columns, optionally with a header line. ``.yaml``: a list of [x, z]. ``.svg``: the
    first line, polygon, circle or path in the drawing, seen from above, with its first point at the
    origin; a unit is a centimeter.

    Raises
    ------
    InputError
        The text is none of these, the file is unreadable, or it has no path.
    """
    readers = {".csv": _read_csv, ".yaml": _read_yaml, ".yml": _read_yaml, ".svg": _read_svg}
    if reader := readers.get(File(text).suffix.lower()):
        return reader(text)
    return GroundPath(_points(text.split()))


def _points(rows: Sequence[str]) -> FloatArray:
    points = [_numbers(row) for row in rows]
    if odd := [row for row, point in zip(rows, points, strict=True) if len(point) != 2]:
        raise InputError(
            f"'{brief(odd[0])}' is not a point of a path; expected x,z in meters, such as \"0,0 "
            '0,3 3,3", or a .csv, .yaml or .svg file'
        )
    return np.array(points, np.float64).reshape(-1, 2)


def _numbers(row: str) -> list[float]:
    try:
        return [float(part) for part in row.replace(";", ",").split(",")]
    except ValueError:
        return []


def _read_csv(source: str) -> GroundPath:
    lines = read_bytes(source, limit=MAX_BYTES).decode("utf-8-sig", errors="replace").splitlines()
    rows = [line.strip() for line in lines if line.strip()]
    return GroundPath(_points(rows[1:] if rows and not _numbers(rows[0]) else rows))


def _read_yaml(source: str) -> GroundPath:
    data = read_bytes(source, limit=MAX_BYTES)
    expected = "a YAML list of points [x, z], meters"
    content = parse_yaml(data, source, "path", expected)
    with reading(source, "path", expected):
        points = np.array(content, np.float64)
    return GroundPath(points)


def _read_svg(source: str) -> GroundPath:
    from fontTools.svgLib.path import SVGPath

    data = read_bytes(source, limit=MAX_BYTES)
    if b"<!ENTITY" in data:
        raise InputError(f"{source} declares entities; save it as a plain SVG")
    pen = _outline(source)
    with (
        reading(source, "drawing", "an SVG with a line or a path"),
        contextlib.suppress(StopIteration),
    ):
        SVGPath.fromstring(data).draw(pen)
    points = np.array(pen.points, np.float64).reshape(-1, 2)
    if len(points) < 2:
        raise InputError(
            f"{source} draws no line; expected a path, polyline, line, polygon, circle or ellipse"
        )
    kept = points[
        np.concatenate(
            [[True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6 / SVG_METRES]
        )
    ]
    return GroundPath((kept - kept[0]) * SVG_METRES)


def _outline(source: str) -> Any:
    """Return a pen of fontTools that keeps the `points` of the first contour that is drawn; each
    curve becomes sixteen lines. It ends the drawing by `StopIteration` after the contour.

    Raises
    ------
    InputError
        From the pen: the contour has more than `MAX_POINTS` points.
    """
    from fontTools.pens.basePen import BasePen

    share = np.linspace(0, 1, 17)[1:, None]

    class Outline(BasePen):  # type: ignore[misc]  # fontTools has no types
        def __init__(self) -> None:
            super().__init__()
            self.points: list[tuple[float, float]] = []

        def _moveTo(self, start: tuple[float, float]) -> None:
            self.points = [start]

        def _lineTo(self, end: tuple[float, float]) -> None:
            self._add([end])

        def _curveToOne(self, *given: tuple[float, float]) -> None:
            whole = np.array([self.points[-1], *given], np.float64)
            bend: Any = np.tile(whole, (len(share), 1, 1))
            while bend.shape[1] > 1:  # de Casteljau, for all shares at the same time
                bend = bend[:, :-1] * (1 - share[..., None]) + bend[:, 1:] * share[..., None]
            self._add([(float(x), float(y)) for x, y in bend[:, 0]])

        def _closePath(self) -> None:
            self._add(self.points[:1])
            self._endPath()

        def _endPath(self) -> None:
            if len(self.points) > 1:
                raise StopIteration

        def _add(self, points: list[tuple[float, float]]) -> None:
            self.points += points
            if len(self.points) > MAX_POINTS:
                raise InputError(
                    f"{source} draws a line of more than {MAX_POINTS} points (a curve has 16); "
                    "simplify it"
                )

    return Outline()
