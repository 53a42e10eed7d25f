"""Write ``pipelines/keywords.py``: the keyword arguments of the functions in Python, as types.

The fields of the requests are the only list of options. This file repeats their names and types for
type checkers and editors; a test compares the two.

    python scripts/make_keywords.py
"""

from __future__ import annotations

import dataclasses
import typing
from pathlib import Path

from pipelines.requests.fields import hints_of
from pipelines.requests.file import FileRequest
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import PersonRequest

PAGE = Path(__file__).resolve().parents[1] / "pipelines" / "keywords.py"
HEAD = '''"""Keyword arguments of `pipelines.front`, by their names and types.

``scripts/make_keywords.py`` writes this file from the fields of the requests.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Literal

from typing_extensions import TypedDict

{imports}

Text = str | os.PathLike[str] | Sequence[str]
"""Text, a path, or names in place of text with commas."""
'''
CLASSES = {
    "PersonKeywords": ("make_character", PersonRequest, {"photo", "more"}),
    "MotionKeywords": ("make_motion", MotionRequest, {"action"}),
    "FilmKeywords": ("make_video", FilmRequest, set()),
    "FileKeywords": ("Person.save", FileRequest, set()),
}
"""By class: the function, the request, and the names that are arguments of their own."""


def page() -> str:
    """Return the text of the file before it is formatted."""
    imports, classes = set[tuple[str, str]](), list[str]()
    for name, (function, kind, own) in CLASSES.items():
        lines = [
            f"    {field}: {text}" for field, text in fields_of(kind, imports) if field not in own
        ]
        about = f'    """Options of `{function}`."""'
        classes.append("\n".join([f"class {name}(TypedDict, total=False):", about, "", *lines]))
    lines = [f"from {module} import {name}" for module, name in sorted(imports)]
    return HEAD.format(imports="\n".join(lines)) + "\n\n" + "\n\n\n".join(classes) + "\n"


def fields_of(kind: type, imports: set[tuple[str, str]]) -> typing.Iterator[tuple[str, str]]:
    """Yield the name and the type of each option of a dataclass; collect what to import."""
    hints = hints_of(kind)
    for item in dataclasses.fields(kind):
        hint = hints[item.name]
        if dataclasses.is_dataclass(hint):
            imports.add((hint.__module__, hint.__name__))
            yield item.name, f"{hint.__name__} | Mapping[str, object]"
        else:
            yield item.name, text_of(hint, item.metadata.get("option", {}).get("choices"))


def text_of(hint: typing.Any, choices: typing.Sequence[str] | None) -> str:
    """Return the type of an option as text."""
    if choices:
        named = ", ".join(f'"{one}"' for one in choices)
        return f"Literal[{named}]" + " | None" * (type(None) in typing.get_args(hint))
    kinds = typing.get_args(hint) or (hint,)
    names = {str: "Text", type(None): "None"}
    return " | ".join(names.get(one, one.__name__) for one in kinds)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
