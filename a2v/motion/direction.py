"""Constraints of a motion besides its action: a path, keyframes, held joints."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.errors import InputError
from a2v.motion.ways import GroundPath
from a2v.types import FloatArray


@dataclass(frozen=True, kw_only=True)
class Keyframe:
    """A pose, place or heading at a given time.

    Attributes
    ----------
    time : float
        Seconds from the beginning of the result, or to its end.
    to_end : bool
        Whether `time` is counted from the last frame back.
    joints : (J, 3) float or None
        A pose of the model's skeleton at its position in the world, meters, y up, the ground at 0.
    at : (x, z) or None
        Place of the root, meters, if there is no pose.
    heading : float or None
        Heading of the person, radians about +y from +z, if there is no pose.
    """

    time: float
    to_end: bool = False
    joints: FloatArray | None = None
    at: tuple[float, float] | None = None
    heading: float | None = None


@dataclass(frozen=True, kw_only=True)
class Hold:
    """A joint that is held at a place.

    Attributes
    ----------
    joint : str
    start, end : float
        Seconds from the beginning of the result.
    at : (x, y, z)
        Meters; the ground is at 0.
    body : bool
        `at` is relative to the person: to the left of the root, above it, in front of it.
    """

    joint: str
    start: float
    end: float
    at: tuple[float, float, float]
    body: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.end:
            raise InputError(
                f"'{self.joint}' is held from {self.start:g} to {self.end:g} s; expected a start "
                "of at least 0 and a later end"
            )


@dataclass(frozen=True, kw_only=True)
class Direction:
    """Path, headings, keyframes and holds that a motion must follow.

    Attributes
    ----------
    path : GroundPath or None
    pace : float or None
        Meters per second along the path; None takes the natural speed of the action.
    heading : float or None
        Heading throughout, radians about +y from +z; None follows the path.
    keyframes : tuple of Keyframe
    holds : tuple of Hold
    """

    path: GroundPath | None = None
    pace: float | None = None
    heading: float | None = None
    keyframes: tuple[Keyframe, ...] = ()
    holds: tuple[Hold, ...] = ()
