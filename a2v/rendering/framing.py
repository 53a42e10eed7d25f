"""Aim and distance, frame by frame, of the cameras that follow a character."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.record import Record
from a2v.types import FloatArray


@dataclass(frozen=True, kw_only=True)
class Framing(Record):
    """Size of the character in the picture, and smoothness of the following camera.

    Attributes
    ----------
    fov : float
        Field of view of the built-in views, degrees.
    margin : float
        Border on each side that stays free in every frame, a fraction of the picture.
    share : float
        Standing height over the picture's height. It is less only in frames that need more room
        (stretched arms, leaps).
    smoothing : float
        Standard deviation of the Gaussian low-pass on the character's path, seconds.
    ease : float
        Time over which the camera moves back ahead of a frame that needs more room, seconds.
    height : float or None
        The character's height, meters; None: the median over the clip of the vertical extent, at
        least half of the largest.
    """

    fov: float = 28.0
    margin: float = 0.06
    share: float = 0.68
    smoothing: float = 0.27
    ease: float = 0.8
    height: float | None = None

    def __post_init__(self) -> None:
        if not 0 < self.fov < 180 or not 0 <= self.margin < 0.5 or not 0 < self.share <= 1:
            raise InputError(
                f"fov {self.fov}, margin {self.margin}, share {self.share}; expected 0 to 180 "
                "degrees, 0 to 0.5, and 0 to 1"
            )
        if self.smoothing < 0 or self.ease < 0 or (self.height is not None and self.height <= 0):
            raise InputError(
                f"smoothing {self.smoothing}, ease {self.ease}, height {self.height}; expected "
                "at least 0, and a height above 0"
            )


RISE = 0.1
"""Height of the lowest point above the ground from which the camera rises with the character,
meters. The steps of a walk stay below it."""


_DIRECTIONS = 128
"""Number of directions in which `extreme_points` looks, besides the six axes."""


def extreme_points(vertices: FloatArray) -> FloatArray:
    """Return the vertices that reach farthest in many directions.

    Cameras that keep these points in the picture keep all vertices in it, up to about 1 % of the
    height. A bounding box needs up to 1.4 times the room if the person stands diagonally in it.

    Parameters
    ----------
    vertices : (V, 3) float
        Meters.

    Returns
    -------
    (134, 3) float
        Vertices, of which some appear several times.
    """
    number = np.arange(_DIRECTIONS) + 0.5
    turn, rise = np.pi * (1 + np.sqrt(5)) * number, 1 - 2 * number / _DIRECTIONS
    wide = np.sqrt(1 - rise**2)  # a spiral from pole to pole, even on the sphere
    spiral = np.stack([wide * np.cos(turn), rise, wide * np.sin(turn)], axis=1)
    directions = np.concatenate([spiral, np.eye(3), -np.eye(3)]).astype(vertices.dtype)
    return np.asarray(vertices[(vertices @ directions.T).argmax(axis=0)])


@dataclass(frozen=True, kw_only=True)
class Subject:
    """The filmed character, in the form that the cameras need.

    Attributes
    ----------
    points : (T, N, 3) float64
        The character, or the corners of each frame's bounding box, meters, world.
    path : (T, 3)
        Smooth path of the point that cameras aim at: half the character's height above the ground,
        higher while the character is in the air or climbs.
    still : (T, 3)
        The middle of the whole clip, repeated in every row, at half the character's height or
        higher.
    height : float
        Meters.
    sides : (float, float)
        Width and height of the picture over its longer side.
    fps : float
    framing : Framing
    """

    points: FloatArray
    path: FloatArray
    still: FloatArray
    height: float
    sides: tuple[float, float]
    fps: float
    framing: Framing

    @classmethod
    def of(
        cls, track: FloatArray, framing: Framing, *, shape: tuple[int, int], fps: float
    ) -> Subject:
        """Build the subject of a track (T, N, 3) in pictures of `shape` (width, height).

        Raises
        ------
        InputError
            The track has another shape, no frames, or holds NaN.
        """
        points = np.asarray(track, np.float64)
        if points.ndim != 3 or points.shape[-1] != 3 or points.shape[0] < 1 or points.shape[1] < 1:
            raise InputError(
                f"the character's track has shape {points.shape}; expected (frames, vertices, 3), "
                "or (frames, 2, 3) for bounds"
            )
        if not np.isfinite(points).all():
            raise InputError(
                "the character's track holds NaN or infinite numbers; check the motion that moved "
                "it"
            )
        low, high = points.min(axis=1), points.max(axis=1)
        if points.shape[1] == 2:
            points = np.stack(
                [np.where([i & 1, i & 2, i & 4], high, low) for i in range(8)], axis=1
            )
        height = framing.height
        if height is None:
            extent = high[:, 1] - low[:, 1]
            height = float(max(np.median(extent), 0.5 * extent.max()))
        sides = shape[0] / max(shape), shape[1] / max(shape)
        center = (low + high) / 2
        center[:, 1] = _aim(
            low[:, 1], high[:, 1], height, reach=(0.5 - framing.margin) * height / framing.share
        )
        still = np.tile((low.min(axis=0) + high.max(axis=0)) / 2, (len(center), 1))
        still[:, 1] = np.maximum(still[:, 1], height / 2)
        return cls(
            points=points,
            path=_smooth_path(center, framing.smoothing * fps),
            still=still,
            height=height,
            sides=sides,
            fps=fps,
            framing=framing,
        )

    def least_distances(self, targets: FloatArray, toward: FloatArray, fov: float) -> FloatArray:
        """Return the least distance (T,) at which the whole character is inside the margin, meters,
        per frame.

        The camera is at this distance from `targets` (T, 3) along `toward` (T, 3).
        """
        reach = (1 - 2 * self.framing.margin) * np.tan(np.radians(fov) / 2)
        right = np.cross((0.0, 1.0, 0.0), toward)
        right /= np.linalg.norm(right, axis=-1, keepdims=True)
        up = np.cross(toward, right)
        offsets = self.points - targets[:, None]
        across, along, depth = (
            np.einsum("tnc,tc->tn", offsets, axis) for axis in (right, up, toward)
        )
        needed = (
            np.maximum(np.abs(across) / self.sides[0], np.abs(along) / self.sides[1]) / reach
            + depth
        )
        return np.asarray(np.maximum(needed.max(axis=1), 0.5))

    def usual_distance(self, fov: float) -> float:
        """Return the distance at which the standing character takes `Framing.share` of the
        picture's height, meters."""
        return float(
            self.height / (2 * self.framing.share * self.sides[1] * np.tan(np.radians(fov) / 2))
        )

    def eased_distances(self, needed: FloatArray, fov: float) -> FloatArray:
        """Return smooth distances (T,) that are nowhere less than `needed` (T,) and the usual
        distance.

        They are a running maximum smoothed by a Gaussian that is cut off where the window of the
        maximum ends. So the weighted means cannot fall below `needed`.
        """
        from scipy.ndimage import gaussian_filter1d, maximum_filter1d

        least = np.maximum(needed, self.usual_distance(fov))
        reach = round(self.framing.ease * self.fps)
        if reach < 1:
            return np.asarray(least)
        widest = maximum_filter1d(least, 2 * reach + 1, mode="nearest")
        return np.asarray(gaussian_filter1d(widest, reach / 2.5, mode="nearest", radius=reach))


def _aim(low: FloatArray, high: FloatArray, height: float, *, reach: float) -> FloatArray:
    """Return the height (T,) that cameras aim at, meters.

    It is half the character's `height` above its support. If `low` or `high` (T,) would be farther
    than `reach` from it, it moves just as far as needed; if both cannot be within `reach`, it is
    their middle.
    """
    aim = height / 2 + np.maximum(low - RISE, 0)
    lowest, highest = high - reach, low + reach
    return np.asarray(np.where(lowest > highest, (low + high) / 2, np.clip(aim, lowest, highest)))


def _smooth_path(center: FloatArray, smoothing: float) -> FloatArray:
    """Smooth a path (T, 3) with a Gaussian of `smoothing` frames."""
    from scipy.ndimage import gaussian_filter1d

    if smoothing <= 0 or len(center) < 2:
        return center
    # The path is extended at both ends by point reflection. Otherwise the camera would lag behind a
    # character that walks at the start of the clip.
    beyond = min(len(center) - 1, int(4 * smoothing))
    padded = np.pad(center, ((beyond, beyond), (0, 0)), mode="reflect", reflect_type="odd")
    path: FloatArray = gaussian_filter1d(padded, smoothing, axis=0, mode="nearest")[
        beyond : beyond + len(center)
    ]
    return path
