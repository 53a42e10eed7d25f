"""Check the video settings that a browser sends, and convert them to a video request."""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from a2v.errors import InputError
from a2v.io import brief
from a2v.kinematics.resample import SHOWN_FPS
from a2v.motion.catalog import SOURCES, catalog
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.plan import AUTO, plan_motion
from a2v.motion.prompts import Match, Step
from a2v.rendering.looks import LOOKS
from a2v.types import VIEWS
from pipelines.requests.film import FOLLOW, STILL, FilmRequest
from pipelines.requests.motion import length_of
from pipelines.requests.video import VideoRequest
from pipelines.sprites import DIRECTIONS, MAX_SIDE
from pipelines.stages import title_of

ALL_VIEWS = (*VIEWS, "turntable")
SIZES = (64, 1080)
SAMPLES = (1, 64)
SECONDS = (0.1, 60.0)
RATES = (5.0, 60.0)
SPEEDS = (0.25, 4.0)
MAX_ACTION = 300
MAX_PATH = 40
"""Largest number of points of a path."""
_PATH = re.compile(
    r"|-?\d{1,2}(\.\d{1,2})?,-?\d{1,2}(\.\d{1,2})?( "
    r"-?\d{1,2}(\.\d{1,2})?,-?\d{1,2}(\.\d{1,2})?){1,39}",
    re.ASCII,
)
_IDENTITY = re.compile("|[0-9a-f]{16}")
ASPECTS = ("1:1", "9:16", "16:9", "4:5")
"""Aspect ratios of a view that the page offers."""
CHOICES: Mapping[str, tuple[object, ...]] = {
    "look": LOOKS,
    "aspect": ASPECTS,
    "camera": (FOLLOW, STILL),
    "animation": ("", "gif", "webp"),
    "sprites": (0, *DIRECTIONS),
}
"""Values of settings that have few."""
MODELS = (AUTO, "cmu-fine", "cmu", CLIPS, "humanact12-fine", "humanact12")
"""Motion models that the page offers: all sources together, and each source alone."""
_PLAIN = FilmRequest()
IDLE = "Idle"
"""Action of a person who waits."""
FIRST = (
    "Walk",
    "Salsa",
    "Wave",
    "Run",
    "Jump",
    "Kick",
    "Bow",
    "Sit",
    "Dance",
    "Disco dance",
    "Clap",
    "Idle",
    "Talk",
    "Jab",
    "Backflip",
    "Victory",
    "Sneak",
    "Zombie walk",
    "Jumping jacks",
    "Ballet",
    "Point",
    "Cheer",
    "Laugh",
    "YMCA",
)
"""Actions that the gallery shows first."""


@dataclass(frozen=True, kw_only=True)
class Wish:
    """The settings of a requested video; none of them names a file.

    Attributes
    ----------
    action : str
        Names or free text; parts are separated by commas or "then".
    seconds : float
        Length of the motion.
    fps : float
        Frames per second of the video.
    background : "stage", "transparent", "photo" or "#rrggbb"
    look : str
        One of `LOOKS`.
    aspect : str
        One of `ASPECTS`.
    camera : "follow" or "still"
    path : str
        Points ``x,z x,z ...`` of a path on the ground, in meters; empty for none.
    clip : bool
        Whether the motion comes from the video uploaded for the person; `action` is then its title.
    motion : str
        Identity of a motion from a file, which replaces the action; `action` is then its title.
    speed : float
        Tempo factor.
    mirror : bool
        Whether left and right are exchanged.
    animation : str
        "gif" or "webp" for such a file beside the video; "" for none.
    sprites : int
        Number of directions of a sprite sheet, whose views and background replace those given; 0
        for none.
    """

    action: str
    model: str = MODELS[0]
    seconds: float = 4.0
    fps: float = SHOWN_FPS
    seed: int = 0
    views: tuple[str, ...] = VIEWS
    size: int = 384
    spp: int = 8
    background: str = "stage"
    look: str = LOOKS[0]
    aspect: str = ASPECTS[0]
    camera: str = FOLLOW
    path: str = ""
    clip: bool = False
    motion: str = ""
    speed: float = 1.0
    mirror: bool = False
    animation: str = ""
    sprites: int = 0

    def __post_init__(self) -> None:
        if (
            not isinstance(self.action, str)
            or not self.action.strip()
            or len(self.action) > MAX_ACTION
        ):
            raise InputError(
                f"the action cannot be read; expected names or words, at most {MAX_ACTION} letters"
            )
        if self.model not in MODELS:
            raise InputError(
                f"unknown motion model {brief(self.model)}; choose from {', '.join(MODELS)}"
            )
        _check("seconds", self.seconds, SECONDS, float)
        _check("fps", self.fps, RATES, float)
        _check("seed", self.seed, (0, 2**32 - 1), int)
        _check("size", self.size, SIZES, int)
        _check("speed", self.speed, SPEEDS, float)
        _check("spp", self.spp, SAMPLES, int)
        if self.size % 2:
            raise InputError(f"size is {self.size}; expected an even number of pixels")
        if (
            not self.views
            or len(set(self.views)) != len(self.views)
            or not set(self.views) <= set(ALL_VIEWS)
        ):
            raise InputError(
                f"views are {brief(self.views)}; choose some of {', '.join(ALL_VIEWS)}, each once"
            )
        if not isinstance(self.background, str) or not re.fullmatch(
            r"stage|transparent|photo|#[0-9a-f]{6}", self.background
        ):
            raise InputError(
                f"background is {brief(self.background)}; expected stage, transparent, photo or "
                f"a color such as #30506f"
            )
        for name in ("clip", "mirror"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(f"{name} is {brief(getattr(self, name))}; expected true or false")
        if not isinstance(self.motion, str) or not _IDENTITY.fullmatch(self.motion):
            raise InputError(f"motion is {brief(self.motion)}; expected an identity of 16 digits")
        if self.clip and self.motion:
            raise InputError("a video and a motion are given; choose one")
        if self.recorded and self.path:
            raise InputError(
                "a path is given, but a recorded motion has its own path; clear the path"
            )
        if not isinstance(self.path, str) or not _PATH.fullmatch(self.path):
            raise InputError(
                f"path is {brief(self.path)}; expected 2 to {MAX_PATH} points 'x,z x,z ...' in "
                f"meters, each at most 99.99"
            )
        for name, known in CHOICES.items():
            if getattr(self, name) not in known:
                raise InputError(
                    f"{name} is {brief(getattr(self, name))}; choose from "
                    f"{', '.join(map(str, known))}"
                )
        if self.sprites and self.size * self.frames > MAX_SIDE:
            raise InputError(
                f"a sheet of {self.frames} pictures of {self.size} pixels is too wide; choose "
                "smaller sprites, fewer a second, or a shorter motion"
            )

    @classmethod
    def of(cls, said: object) -> Wish:
        """Make the settings from JSON.

        Raises
        ------
        InputError
            An unknown name, or a value out of range.
        """
        if not isinstance(said, Mapping):
            raise InputError(f"the request is {brief(said)}; expected an object of settings")
        known = {item.name for item in dataclasses.fields(cls)}
        if unknown := [name for name in said if name not in known]:
            raise InputError(
                f"unknown setting {brief(unknown[0])}; expected {', '.join(sorted(known))}"
            )
        if "action" not in said:
            raise InputError("no action is given; pick one or write what to do")
        values = dict(said)
        if "views" in values:
            views = values["views"]
            if not isinstance(views, list | tuple) or not all(
                isinstance(view, str) for view in views
            ):
                raise InputError(f"views are {brief(views)}; expected a list of names")
            values["views"] = tuple(views)
        return cls(**values)

    def said(self) -> dict[str, Any]:
        """Return the settings as JSON, the input of `of`."""
        return dataclasses.asdict(self)

    @property
    def recorded(self) -> bool:
        """Whether the motion comes from a video or a file."""
        return self.clip or bool(self.motion)

    @property
    def pictures(self) -> int:
        """Number of rendered pictures of the video."""
        return self.frames * (self.sprites or len(self.views))

    @property
    def frames(self) -> int:
        """Number of frames of the video."""
        return length_of(frames=None, seconds=self.seconds, fps=self.fps)

    def request(
        self,
        photo: str,
        corrections: str | None = None,
        more: Sequence[str] = (),
        clip: str | None = None,
    ) -> VideoRequest:
        """Return the video request for a photo.

        The arguments are paths: the photo, its corrections, further photos of the person, and the
        video or file with the motion.
        """
        said = self.said() | {"path": self.path or None, "motion": None}
        for name in ("clip", "animation", "sprites"):
            del said[name]
        if self.sprites:
            said |= {name: getattr(_PLAIN, name) for name in ("views", "background", "camera")}
        if self.recorded:
            said = {**said, "motion": clip, "model": AUTO, "seed": 0}
        return VideoRequest.of(
            photo=photo, corrections=corrections, more=",".join(more) or None, **said
        )

    def check_path(self) -> None:
        """Refuse a path that the action cannot follow, before the video is queued.

        Raises
        ------
        InputError
            The action cannot follow the path.
        """
        if self.path:
            self.request("photo").motion.resolve()


def _check(name: str, value: object, limits: tuple[float, float], kind: type) -> None:
    good = isinstance(value, (int, float) if kind is float else int) and not isinstance(value, bool)
    if not good or not limits[0] <= value <= limits[1]:  # type: ignore[operator]  # numbers
        raise InputError(
            f"{name} is {brief(value)}; expected {'a whole' if kind is int else 'a'} number from "
            f"{limits[0]} to {limits[1]}"
        )


@functools.cache
def actions_of(name: str) -> tuple[str, ...]:
    """Return the actions of one of `MODELS`."""
    sources = SOURCES if name == AUTO else (name,)
    return tuple(entry.name for entry in catalog("any", sources).entries)


def understood(model: str, text: str) -> tuple[list[Step], list[Match]]:
    """Match a text to actions of a model.

    Raises
    ------
    InputError
        A part matches no action; the message names the nearest.
    """
    plan = plan_motion(text[:MAX_ACTION], model=model)
    return list(plan.steps), list(plan.matches)


def _gallery_place(name: str) -> int:
    """Return the place of an action in the gallery; the most common actions come first."""
    return FIRST.index(name) if name in FIRST else len(FIRST)


def choices() -> dict[str, Any]:
    """Return the choices of the page: actions, views, and limits of numbers."""
    entries = sorted(catalog("any", SOURCES).entries, key=lambda entry: _gallery_place(entry.name))
    actions = [
        {
            "name": entry.name,
            "title": title_of(entry.name),
            "theme": entry.theme[:1].upper() + entry.theme[1:],
            "note": entry.note,
        }
        for entry in entries
    ]
    limits = {"size": SIZES, "spp": SAMPLES, "seconds": SECONDS, "fps": RATES, "action": MAX_ACTION}
    return {"actions": actions, "views": ALL_VIEWS, "limits": limits}
