"""a2v: from an action's name and one photograph to a video of that person doing the action, in 3D."""

import os

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.types import VIEWS, Body, Character, Motion, OrthographicCamera, RenderSettings, Subject, Surface
from a2v.version import __version__

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # read when onnxruntime is imported; else it looks up a host and leaves an identity

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
