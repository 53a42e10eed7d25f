"""a2v: from the name of an action and one photograph to a 3D video of that person doing the
action."""

from __future__ import annotations

from typing import TYPE_CHECKING

from a2v import telemetry as telemetry
from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.types import (
    VIEWS,
    Body,
    Character,
    Motion,
    OrthographicCamera,
    PhotoCamera,
    RenderSettings,
    Subject,
    Surface,
)
from a2v.version import __version__

__all__ = [
    "VIEWS",
    "A2VError",
    "Body",
    "Character",
    "InputError",
    "MissingDependencyError",
    "Motion",
    "MotionClip",
    "OrthographicCamera",
    "Person",
    "PhotoCamera",
    "RenderSettings",
    "Subject",
    "Surface",
    "__version__",
    "make_character",
    "make_motion",
    "make_video",
    "show",
]

if TYPE_CHECKING:
    from a2v.rendering.show import show
    from pipelines.front import MotionClip, Person, make_character, make_motion, make_video

FRONT = ("MotionClip", "Person", "make_character", "make_motion", "make_video")
"""Names of the pipeline that the package exports; the only dependency on a higher layer
(docs/python.md)."""


def __getattr__(name: str) -> object:
    """Import `show` and the pipeline's names at their first use."""
    if name == "show":
        from importlib import import_module

        return import_module("a2v.rendering.show").show
    if name in FRONT:
        from a2v.command import load_pipelines

        return getattr(load_pipelines("front"), name)
    raise AttributeError(f"module 'a2v' has no attribute '{name}'")
