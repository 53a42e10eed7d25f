"""Import mediapipe without what is not needed of it."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

_PLOTTING = ("matplotlib", "matplotlib.pyplot")
"""Modules that mediapipe needs for a function that plots landmarks, which nothing here calls."""


def load_mediapipe() -> Any:
    """Return the module `mediapipe`, imported without Matplotlib: a tenth of the processor time.

    Another module that imports Matplotlib at the same moment in another thread may get an empty
    one. Afterwards imports are as usual, and mediapipe's function finds Matplotlib when it is
    called.
    """
    if "mediapipe" not in sys.modules:
        empty = {name: _later(name) for name in _PLOTTING if name not in sys.modules}
        if set(empty) == set(_PLOTTING):
            empty["matplotlib"].pyplot = empty["matplotlib.pyplot"]
        sys.modules.update(empty)
        try:
            import mediapipe  # noqa: F401
        finally:
            for name, module in empty.items():
                if sys.modules.get(name) is module:
                    del sys.modules[name]
    return sys.modules["mediapipe"]


def _later(name: str) -> Any:
    """Return a module whose attributes are those of the module `name`, imported at their first
    use."""

    def found(attribute: str) -> Any:
        if attribute.startswith("__"):  # what Python asks of a module while it imports
            raise AttributeError(attribute)
        return getattr(importlib.import_module(name), attribute)

    module: Any = ModuleType(name)
    module.__getattr__ = found
    return module
