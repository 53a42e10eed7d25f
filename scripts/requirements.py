"""Print the requirements in pyproject.toml, one per line: pip checks hashes of these, but not of a
folder (``-e .``).

    python scripts/requirements.py dev dask         # and what these extras need

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


if __name__ == "__main__":
    known = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    print("\n".join(requirements(known["project"], sys.argv[1:])))
