"""What the measuring commands write: a table as Markdown and, beside it, the numbers as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from a2v.errors import InputError
from a2v.io import atomic_path
from pipelines.answer import Answer
from pipelines.inputs import check_writable


def table_path(out: str) -> Path:
    """The .md to write, in a folder that can be written.

    Raises
    ------
    InputError
        Another suffix, or the folder cannot be written.
    """
    path = Path(out)
    if path.suffix != ".md":
        raise InputError(f"cannot write {path}; expected a name that ends in .md")
    check_writable(path.parent)
    return path


def write_table(path: Path, parts: Iterable[str], content: Mapping[str, object]) -> str:
    """Write `parts`, an empty line between each two, to `path` and `content` beside it; returns the
    text."""
    joined = "\n\n".join(parts) + "\n"
    with atomic_path(path) as temporary:
        temporary.write_text(joined, encoding="utf-8")
    write_numbers(path, content)
    return joined


def table_result(path: Path, text: str, content: Mapping[str, object]) -> Answer:
    """What a measuring command gives back of what `write_table` wrote."""
    return Answer(
        files=[path, path.with_suffix(".json")], text=f"{text}\n{path}", facts={"numbers": content}
    )


def write_numbers(path: Path, content: Mapping[str, object]) -> None:
    """Write `content` as JSON beside the table at `path`."""
    with atomic_path(path.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(content, indent=1), encoding="utf-8")
