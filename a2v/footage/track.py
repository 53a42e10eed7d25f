"""Observations of a person in a piece of film as arrays over time, and the motion of the camera."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from a2v.body.evidence import _TRUST
from a2v.footage.settings import FollowSettings
from a2v.footage.tracking import Sighting
from a2v.kinematics.names import BLAZEPOSE
from a2v.types import BoolArray, FloatArray, IntArray

FILM = 43.27
"""Diagonal of 35 mm film, millimeters."""
LENS = 28.0
"""Focal length of a filming phone, 35 mm equivalent, millimeters. A phone's video has a narrower
view than its photos (26)."""
BRIDGED = 1.0
"""Longest gap in seconds within one piece in which the person is not visible."""
LEAST_SEEN = 6
"""Smallest number of frames in a piece in which the person is visible."""
_STILL = 0.004
"""Shift of the background, relative to the width, below which the camera is still."""
_TRUSTED = np.array([_TRUST[name] for name in BLAZEPOSE])
_HEIGHT_FRAMES = 15


@dataclass(frozen=True, kw_only=True)
class Track:
    """A piece of a film.

    Attributes
    ----------
    times : (T,) seconds
    seen : (T,) bool
        Whether the person is seen.
    pixels : (T, 33, 2)
        Landmarks relative to the middle of the picture, without the camera's roll: u to the right,
        v down.
    weights : (T, 33)
        Weight of each landmark; 0 if it is not seen.
    confidence : (T, 33)
        Confidence of the detectors.
    points : (T, 33, 3)
        Meters of a person of typical height, upright, in the heading of the camera.
    heights : (T,)
        Standing height of the person, pixels.
    yaw, tilt : (T,)
        Turn of the camera since the first frame, to its left and down, radians.
    focal : float
        Focal length, pixels.
    """

    times: FloatArray
    seen: BoolArray
    pixels: FloatArray
    weights: FloatArray
    confidence: FloatArray
    points: FloatArray
    heights: FloatArray
    yaw: FloatArray
    tilt: FloatArray
    focal: float

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.times)

    def part(self, which: slice | IntArray) -> Track:
        """Select frames."""
        arrays = {
            item.name: getattr(self, item.name)[which]
            for item in dataclasses.fields(self)
            if item.name != "focal"
        }
        return dataclasses.replace(self, **arrays)


@dataclass(frozen=True)
class Piece:
    """Frames of one shot in which the person is seen without long gaps: sightings `first` to
    `end` - 1."""

    first: int
    end: int
    seen: int


def pieces_of(sightings: Sequence[Sighting]) -> list[Piece]:
    """Find the pieces in which the person is seen, in order. The person is seen in the first and
    the last frame of each piece."""
    found: list[Piece] = []
    begin, last, count = -1, -1, 0

    def close() -> None:
        if begin >= 0 and count >= LEAST_SEEN:
            found.append(Piece(begin, last + 1, count))

    for index, sighting in enumerate(sightings):
        if begin >= 0 and (sighting.cut or sighting.time - sightings[last].time > BRIDGED):
            close()
            begin, count = -1, 0
        if sighting.keypoints is not None:
            begin = index if begin < 0 else begin
            last, count = index, count + 1
    close()
    return found


def track_of(
    sightings: Sequence[Sighting], size: tuple[int, int], settings: FollowSettings
) -> Track:
    """Return the track of a piece.

    Parameters
    ----------
    sightings : of the piece
    size : width and height of the pictures, pixels
    """
    count = len(sightings)
    focal = float(np.hypot(*size)) * (settings.lens or LENS) / FILM
    middle = np.array(size, np.float64) / 2
    yaw, tilt, roll = (
        camera_turns(sightings, size, focal) if settings.camera == "auto" else np.zeros((3, count))
    )
    seen = np.array([one.keypoints is not None for one in sightings])
    pixels, points = np.zeros((count, 33, 2)), np.zeros((count, 33, 3))
    confidence, heights = np.zeros((count, 33)), np.full(count, np.nan)
    for index, one in enumerate(sightings):
        if one.keypoints is None or one.points is None:
            continue
        offset = one.keypoints[:, :2].astype(np.float64) - middle
        cosine, sine = np.cos(-roll[index]), np.sin(-roll[index])
        pixels[index] = offset @ np.array([[cosine, sine], [-sine, cosine]])
        confidence[index], points[index], heights[index] = (
            one.keypoints[:, 2],
            one.points,
            one.height,
        )
    at = np.arange(count)
    heights = np.interp(
        at,
        at[seen],
        median_filter(heights[seen], min(_HEIGHT_FRAMES, int(seen.sum())), mode="nearest"),
    )
    times = np.array([one.time for one in sightings])
    return Track(
        times=times,
        seen=seen,
        pixels=pixels,
        weights=confidence * _TRUSTED,
        confidence=confidence,
        points=points,
        heights=heights,
        yaw=yaw,
        tilt=tilt,
        focal=focal,
    )


def camera_turns(sightings: Sequence[Sighting], size: tuple[int, int], focal: float) -> FloatArray:
    """Return the turns of the camera since the first frame (3, T), radians: to its left, down, and
    roll. Zeros if it is still."""
    middle = np.array(size, np.float64) / 2
    turns = np.zeros((3, len(sightings)))
    for index, one in enumerate(sightings[1:], 1):
        shift = one.warp[:, :2] @ middle + one.warp[:, 2] - middle
        angle = float(np.arctan2(one.warp[1, 0], one.warp[0, 0]))
        turned = turns[2, index - 1]
        cosine, sine = np.cos(-turned), np.sin(-turned)
        across, down = cosine * shift[0] - sine * shift[1], sine * shift[0] + cosine * shift[1]
        turns[:, index] = turns[:, index - 1] + [across / focal, -down / focal, angle]
    if np.ptp(turns, axis=1).max() * focal < _STILL * max(size):
        return np.zeros_like(turns)
    return turns
