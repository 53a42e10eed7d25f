"""What the docstring of a settings class says of each field, for the help of its options."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

_SECTION = "Attributes"


def field_docs(kind: type) -> dict[str, str]:
    """One line of text per field, out of the section ``Attributes`` of the class and of the classes
    that it extends.

    An entry is ``name : type`` with its text indented below it (numpydoc). Backquotes and the full
    stop at the end are left out.
    """
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        found |= dict(_entries(one.__dict__.get("__doc__") or ""))
    return found


def summary(kind: type) -> str:
    """The first paragraph of a class's docstring as one line without its full stop."""
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
        yield name, " ".join(words).removesuffix(".")
