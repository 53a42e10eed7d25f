"""Write the output of the measuring commands: a table as Markdown and the numbers as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from a2v.errors import InputError
from a2v.io import atomic_path
from pipelines.answer import Answer
from pipelines.inputs import check_writable


def table_path(out: str) -> Path:
    """Check the path of the .md to write.

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
    """Write `parts`, separated by empty lines, to `path`, and `content` beside it.

    Return the text.
    """
    joined = "\n\n".join(parts) + "\n"
    with atomic_path(path) as temporary:
        temporary.write_text(joined, encoding="utf-8")
    write_numbers(path, content)
    return joined


def table_result(path: Path, text: str, content: Mapping[str, object]) -> Answer:
    """Return the answer of a measuring command after `write_table`."""
    return Answer(
        files=[path, path.with_suffix(".json")], text=f"{text}\n{path}", facts={"numbers": content}
    )


def write_numbers(path: Path, content: Mapping[str, object]) -> None:
    """Write `content` as JSON beside the table at `path`."""
    with atomic_path(path.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(content, indent=1), encoding="utf-8")
