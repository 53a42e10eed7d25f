"""a2v: from an action's name and one photograph to a video of that person doing the action, in 3D."""

from __future__ import annotations

from typing import TYPE_CHECKING

from a2v import telemetry as telemetry
from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.types import VIEWS, Body, Character, Motion, OrthographicCamera, RenderSettings, Subject, Surface
from a2v.version import __version__

__all__ = [
    "VIEWS",
    "A2VError",
    "Body",
    "Character",
    "InputError",
    "MissingDependencyError",
    "Motion",
    "OrthographicCamera",
    "RenderSettings",
    "Subject",
    "Surface",
    "__version__",
    "show",
]

if TYPE_CHECKING:
    from a2v.rendering.show import show


def __getattr__(name: str) -> object:
    """What is only imported where it is used: `show`."""
    if name != "show":
        raise AttributeError(f"module 'a2v' has no attribute '{name}'")
    from importlib import import_module

    return import_module("a2v.rendering.show").show
