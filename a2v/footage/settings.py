"""Settings of tracking a person through a video."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.errors import InputError
from a2v.kinematics.stature import TYPICAL_HEIGHT

CAMERAS = ("auto", "still")
"""Camera motion: estimated from the background, or none."""
LONGEST = 600.0
"""Longest part of a video that is used, seconds."""


@dataclass(frozen=True, kw_only=True)
class FollowSettings:
    """Settings of tracking a person through a video.

    Attributes
    ----------
    person : int
        Number of the tracked person by size when people first appear: 1 is the largest. 0 chooses
        by size and distance from the center.
    start : float
        Start time, seconds.
    turn : int
        Degrees by which the pictures are turned counterclockwise in addition to the file's own
        rotation: 0, 90, 180 or 270, for a film that lies on its side.
    side : int
        Longer side in pixels of the frames that the detectors see. Larger videos are reduced while
        they are decoded.
    height : float
        Standing height of the person, meters. It cannot be seen in a video.
    lens : float
        Focal length, 35 mm equivalent, millimeters; 0 for that of a phone.
    camera : str
        "auto": turns are estimated from the background; "still": the camera is on a tripod.
    face : bool
        Search the face, if it is large enough, and fit the 52 expressions to it.
    hands : bool
        Search the hands, if they are large enough, and add their fingers to the motion.
    acceleration : float
        Usual acceleration of a joint, meters per square second. Smaller values are smoother. Larger
        accelerations cost linearly, so that hits are kept.
    window : int
        Number of frames that are fitted together.
    steps : int
        L-BFGS iterations per window.
    """

    person: int = 0
    start: float = 0.0
    turn: int = 0
    side: int = 960
    height: float = TYPICAL_HEIGHT
    lens: float = 0.0
    camera: str = "auto"
    face: bool = True
    hands: bool = True
    acceleration: float = 8.0
    window: int = 72
    steps: int = 60

    def __post_init__(self) -> None:
        if not 0 <= self.person <= 20:
            raise InputError(
                f"person is {self.person}; expected 1 for the largest person, 2 for the second "
                "largest, and so on up to 20, or 0 for the largest in the middle"
            )
        if not 0 <= self.start <= 86_400:
            raise InputError(f"start is {self.start}; expected 0 to 86400 seconds")
        if self.turn not in (0, 90, 180, 270):
            raise InputError(f"turn is {self.turn}; choose from 0, 90, 180, 270 degrees")
        if not 256 <= self.side <= 1920:
            raise InputError(f"side is {self.side}; expected 256 to 1920 pixels")
        if not 0.5 <= self.height <= 2.5:
            raise InputError(f"height is {self.height}; expected 0.5 to 2.5 meters")
        if self.lens and not 8 <= self.lens <= 400:
            raise InputError(
                f"lens is {self.lens}; expected 8 to 400 millimeters, or 0 for that of a phone"
            )
        if self.camera not in CAMERAS:
            raise InputError(f"camera is '{self.camera}'; choose from {', '.join(CAMERAS)}")
        if not 0.1 <= self.acceleration <= 1000:
            raise InputError(
                f"acceleration is {self.acceleration}; expected 0.1 to 1000 meters per square "
                "second"
            )
        if not 32 <= self.window <= 400 or not 1 <= self.steps <= 1000:
            raise InputError(
                f"window is {self.window}, steps is {self.steps}; expected 32 to 400 frames and "
                "1 to 1000 steps"
            )
