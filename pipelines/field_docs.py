"""Read the help of settings from the docstring of their class."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

_SECTION = "Attributes"
_REFERENCE = re.compile(r" \((?:Eq\. [^)]*|a2v\.[\w.]+|[a-z]+_[a-z_]+|\w+\.csv)\)")


def field_docs(kind: type) -> dict[str, str]:
    """Return one line of text per field, from the section ``Attributes`` of the class.

    Base classes are included. An entry is ``name : type`` with its text indented below it
    (numpydoc). Backquotes, the final period and references in parentheses to equations and modules
    are left out.
    """
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        found |= dict(_entries(one.__dict__.get("__doc__") or ""))
    return found


def summary(kind: type) -> str:
    """Return the first paragraph of a class's docstring as one line without its period."""
    return " ".join(inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0].split()).removesuffix(
        "."
    )


def _entries(text: str) -> Iterator[tuple[str, str]]:
    lines = inspect.cleandoc(text).splitlines()
    if _SECTION not in lines:
        return
    name, words = "", list[str]()
    for line in lines[lines.index(_SECTION) + 2 :]:
        if line and not line[0].isspace():
            yield from _entry(name, words)
            name, words = line.partition(" : ")[0].strip(), []
        else:
            words += line.replace("`", "").split()
    yield from _entry(name, words)


def _entry(name: str, words: list[str]) -> Iterator[tuple[str, str]]:
    if name and words:
        yield name, _REFERENCE.sub("", " ".join(words)).removesuffix(".")
