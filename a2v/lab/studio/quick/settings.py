"""Settings of quick views."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.errors import InputError
from a2v.lab.studio.settings import PEOPLE

VERSION = 3
"""Version of the views that a seed gives. Raise it when quick views change, so that a folder never
mixes two kinds."""

SHARD = 64
"""Views per file."""
BLOCK = 16
"""Views per person in a file."""
OUTFIT = 4
"""Views per outfit of a person."""


@dataclass(frozen=True, kw_only=True)
class QuickSettings:
    """Settings of quick views.

    A share is a fraction of all views. Changes of the pose are drawn one after the other.

    Attributes
    ----------
    seed : int
        Seed of the data set.
    people : str
        "avatars", "makehuman", or "both" in turns.
    natural : float
        Share of people who stand naturally.
    open : float
        Share of people in T- and A-poses; all others are in the pose of a recorded frame.
    common : float
        Share of the recorded frames that are drawn uniformly. For the others, every kind of pose
        is equally likely.
    limbs : float
        Share of poses with an arm or a leg of another frame.
    free : float
        Share of poses whose limbs are drawn anywhere within the limits of their joints.
    bent : float
        Share of poses with the trunk bent over the legs.
    curled : float
        Share of poses with the spine bent.
    facing : float
        Share of people who roughly face the camera; the others face any direction.
    yaw : float
        Standard deviation of the turn of the people who face the camera, degrees.
    distance : tuple of 2 float
        Nearest and farthest camera, meters.
    height : tuple of 2 float
        Lowest and highest camera, meters over the floor.
    fill : tuple of 2 float
        Smallest and largest longer side of the person's box, as a fraction of the picture.
    shift : float
        Standard deviation of the shift of the person's box from the middle of the picture, relative
        to the box's longer side.
    cut : float
        Share of people who are cut off by the picture's border.
    things : float
        Share of people who hold an object in their hands.
    furniture : float
        Share of people with furniture that usually occludes a part of them.
    others : float
        Share of people with other people in front of or behind them. To get the views of version
        1, set `things`, `furniture`, `others` and `photographs` to 0.
    photographs : float
        Share of people in front of a photograph instead of a drawn background.
    backgrounds : str
        Folder of photographs beside those of scikit-image's wheel; "" for none.
    """

    seed: int = 0
    people: str = "both"
    natural: float = 0.12
    open: float = 0.04
    common: float = 0.25
    limbs: float = 0.2
    free: float = 0.25
    bent: float = 0.15
    curled: float = 0.15
    facing: float = 0.6
    yaw: float = 40.0
    distance: tuple[float, ...] = (1.6, 12.0)
    height: tuple[float, ...] = (0.4, 2.4)
    fill: tuple[float, ...] = (0.68, 0.9)
    shift: float = 0.04
    cut: float = 0.12
    things: float = 0.2
    furniture: float = 0.15
    others: float = 0.1
    photographs: float = 0.3
    backgrounds: str = ""

    def __post_init__(self) -> None:
        if self.people not in PEOPLE:
            raise InputError(f"people is '{self.people}'; choose from {', '.join(PEOPLE)}")
        shares = (
            "natural",
            "open",
            "common",
            "limbs",
            "free",
            "bent",
            "curled",
            "facing",
            "cut",
            "things",
            "furniture",
            "others",
            "photographs",
        )
        if bad := [name for name in shares if not 0 <= getattr(self, name) <= 1]:
            raise InputError(f"{bad[0]} is {getattr(self, bad[0])}; expected a share from 0 to 1")
        if self.natural + self.open > 1:
            raise InputError(
                f"natural and open are {self.natural + self.open:g} together; expected at most 1"
            )
        for name, least, most in (("distance", 1.5, 1e3), ("height", 0.0, 1e3), ("fill", 0.1, 1.0)):
            pair = getattr(self, name)
            if len(pair) != 2 or not least <= pair[0] <= pair[1] <= most:
                raise InputError(
                    f"{name} is {pair}; expected two numbers from {least:g} to {most:g}, the "
                    "smaller one first"
                )
        if min(self.shift, self.yaw) < 0:
            raise InputError("shift and yaw must be at least 0")
