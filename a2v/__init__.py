"""a2v: from an action's name and one photograph to a video of that person doing the action, in 3D."""

from importlib.metadata import PackageNotFoundError, version

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.types import VIEWS, Body, Character, Motion, OrthographicCamera, RenderSettings, Subject, Surface

try:
    __version__ = version("a2v")
except PackageNotFoundError:  # running from a checkout that is not installed
    __version__ = "0.0.0"

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
]
