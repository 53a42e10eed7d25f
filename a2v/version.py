"""The installed version of a2v, for files and reports."""

from __future__ import annotations

from importlib import metadata


def _installed() -> str:
    try:
        return metadata.version("a2v")
    except metadata.PackageNotFoundError:  # a checkout that is not installed
        return "0.0.0"


__version__ = _installed()
"""Version of the installed package, such as "0.1.0"; "0.0.0" in a checkout that is not
installed."""
