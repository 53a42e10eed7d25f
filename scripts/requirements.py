"""Print the requirements in pyproject.toml, one per line: pip checks hashes of these, but not of a
folder (``-e .``).

    python scripts/requirements.py dev dask           # and what these extras need
    python scripts/requirements.py --locked dev dask  # the same as versions with hashes, for uv

Needs nothing but pip.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    from pip._vendor import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent


def requirements(project: Mapping[str, Any], extras: Sequence[str]) -> list[str]:
    """Return the requirements of a project and of some of its extras, in the order of the file.
    Extras that refer to other extras of the project are followed."""
    found, left, seen = list(project["dependencies"]), list(extras), set[str]()
    while left:
        extra = left.pop(0)
        if extra in seen:
            continue
        seen.add(extra)
        for requirement in project["optional-dependencies"][extra]:
            if own := re.fullmatch(rf"{re.escape(project['name'])}\[([\w, -]+)\]", requirement):
                left += [name.strip() for name in own[1].split(",")]
            else:
                found.append(requirement)
    return found


def plain(name: str) -> str:
    """The name of a package as indexes write it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def locked(wanted: Sequence[str], lock: str) -> list[str]:
    """Return the entries of ``constraints.lock`` (versions and hashes) of the wanted packages."""
    names = {plain(re.split(r"[^\w.-]", line)[0]) for line in wanted}
    entries = re.findall(r"^[\w.-]+==.*\\\n(?:    .*\n)+", lock, flags=re.MULTILINE)
    return [entry for entry in entries if plain(entry.split("==")[0]) in names]


def main() -> None:
    """Print the requirements."""
    extras = [word for word in sys.argv[1:] if word != "--locked"]
    known = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    found = requirements(known["project"], extras)
    if "--locked" in sys.argv[1:]:
        lock = (ROOT / "constraints.lock").read_text(encoding="utf-8")
        print("".join(locked(found, lock)), end="")
    else:
        print("\n".join(found))


if __name__ == "__main__":
    main()
