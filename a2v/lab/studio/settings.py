"""Settings of the fast studio."""

from __future__ import annotations

from dataclasses import dataclass, field

from a2v.errors import InputError
from a2v.lab.studio.guide_errors import GuideErrors

VERSION = 1
"""Version of the views that a seed gives. Raise it when views change, so that a folder never mixes
two kinds."""

PEOPLE = ("avatars", "makehuman", "both")
"""Sources of people."""


@dataclass(frozen=True, kw_only=True)
class StudioSettings:
    """Settings of the fast studio. Shares are fractions of all views.

    Attributes
    ----------
    seed : int
        Seed of the data set.
    actions : float
        Share of poses from recorded actions.
    open : float
        Share of T- and A-poses; all other people stand naturally.
    varied : float
        Share of people in poses of the quick views' bank (`a2v.lab.studio.quick.poses`): rare poses
        are as likely as common ones, and limbs point anywhere. The two shares above refer to all
        other people.
    facing : float
        Share of people who roughly face the camera; the others face any direction.
    yaw : float
        Standard deviation of the turn of people who face the camera, degrees.
    distance : tuple of 2 float
        Nearest and farthest camera, meters.
    height : tuple of 2 float
        Lowest and highest camera, meters over the floor.
    fill : float
        Longer side of the person's box as a fraction of the photo.
    points : int
        Number of samples in space.
    surface_points : int
        Number of samples on the surface.
    near : float
        Standard deviation of the samples near the surface, meters.
    far : float
        Standard deviation of the samples farther from the surface, meters.
    near_share : float
        Share of samples near the surface.
    far_share : float
        Share of samples farther from the surface; the rest is uniform in the person's box with a
        margin of 10 cm.
    same_avatar : int
        Number of successive views of one avatar. A larger number saves time, since the avatar is
        read once for them.
    things : float
        Share of people who hold something in their hands.
    furniture : float
        Share of people with furniture that usually occludes a part of them.
    cut : float
        Share of people who are cut off by the photo's border.
    photographs : float
        Share of people in front of a photograph instead of a drawn background. To get the views of
        version 1, set `things`, `furniture`, `cut` and `photographs` to 0.
    backgrounds : str
        Folder of photographs that are used in addition to those of scikit-image; "" for none.
    people : str
        Source of the people: "avatars", "makehuman" (people drawn and dressed by
        `a2v.lab.studio.makehuman`), or "both" in turns.
    guide : GuideErrors
    """

    seed: int = 0
    actions: float = 0.3
    open: float = 0.1
    varied: float = 0.0
    facing: float = 0.85
    yaw: float = 20.0
    distance: tuple[float, ...] = (2.5, 12.0)
    height: tuple[float, ...] = (0.8, 1.9)
    fill: float = 0.9
    points: int = 16384
    surface_points: int = 8192
    near: float = 0.015
    far: float = 0.05
    near_share: float = 0.5
    far_share: float = 0.35
    same_avatar: int = 4
    things: float = 0.0
    furniture: float = 0.0
    cut: float = 0.0
    photographs: float = 0.0
    backgrounds: str = ""
    people: str = "avatars"
    guide: GuideErrors = field(default_factory=GuideErrors)

    @property
    def surrounds(self) -> bool:
        """Whether anything may be around a person or cut it off."""
        return any((self.things, self.furniture, self.cut, self.photographs))

    def __post_init__(self) -> None:
        if (
            min(self.actions, self.open, self.varied, self.facing) < 0
            or max(self.actions + self.open, self.varied, self.facing) > 1
        ):
            raise InputError("varied, facing, and the sum of actions and open must be from 0 to 1")
        if bad := [
            name
            for name in ("things", "furniture", "cut", "photographs")
            if not 0 <= getattr(self, name) <= 1
        ]:
            raise InputError(f"{bad[0]} is {getattr(self, bad[0])}; expected a share from 0 to 1")
        if min(self.near_share, self.far_share) < 0 or self.near_share + self.far_share > 1:
            raise InputError("near_share, far_share and their sum must be from 0 to 1")
        for name, least in (("distance", 1.5), ("height", 0.0)):
            pair = getattr(self, name)
            if len(pair) != 2 or not least <= pair[0] <= pair[1]:
                raise InputError(
                    f"{name} is {pair}; expected two numbers in meters, the smaller one first "
                    f"and at least {least}"
                )
        if self.people not in PEOPLE:
            raise InputError(f"people is '{self.people}'; choose from {', '.join(PEOPLE)}")
        if not 0.1 <= self.fill <= 1 or min(self.points, self.surface_points, self.same_avatar) < 1:
            raise InputError(
                "fill must be from 0.1 to 1, and points, surface_points and same_avatar at least 1"
            )
