"""Draw docstrings, help lines and messages for a second reader.

    python scripts/draw_sentences.py --seed 38                     20 docstrings, 20 help lines, 10 messages
    python scripts/draw_sentences.py --seed 38 --docstrings 50 --help-lines 0 --messages 0
    python scripts/draw_sentences.py --seed 38 --below a2v/body    one package only
    python scripts/draw_sentences.py --seed 38 --below tests       docstrings of another folder

Docstrings are those of the modules, classes and functions of `a2v`, `pipelines` and `export`. Help
lines are those that the commands print for `--help-all`. Messages are those of
`scripts/list_refusals.py`. Each kind is sorted by file and name before the draw,
and has its own random generator. A rewritten docstring or message does not change which others are
drawn. Help lines with the same text count once, so a rewritten one can change the draw.
"""

from __future__ import annotations

import argparse
import ast
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from pipelines.cli import every_command, load_command  # noqa: E402
from pipelines.options import _parser  # noqa: E402
from scripts.list_refusals import placed_refusals  # noqa: E402

FOLDERS = ("a2v", "pipelines", "export")
"""Folders whose sentences are drawn."""
HELP_ALL = 1
"""Level of the help that `--help-all` prints."""


class Sentence(NamedTuple):
    """A text with its place: file and line (0 if the text is built at run time)."""

    file: str
    name: str
    line: int
    text: str


def sources(below: str = "") -> Iterator[tuple[str, ast.Module]]:
    """Yield the relative path and the syntax tree of each source file.

    They are those of `FOLDERS`, or of the folder of `below` if it is another one.
    """
    top = below.split("/")[0]
    for folder in (top,) if top and top not in FOLDERS else FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield (
                path.relative_to(ROOT).as_posix(),
                ast.parse(path.read_text(encoding="utf-8")),
            )


def docstrings(below: str = "") -> list[Sentence]:
    """The docstrings of all modules, classes and functions; see `sources`."""
    found = []
    for file, tree in sources(below):
        for node in ast.walk(tree):
            kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
            if isinstance(node, kinds) and (text := ast.get_docstring(node)):
                line = getattr(node, "lineno", 1)
                found.append(Sentence(file, getattr(node, "name", ""), line, text))
    return found


def strings() -> list[Sentence]:
    """Every constant string of the sources with its spaces made single."""
    return [
        Sentence(file, "", node.lineno, " ".join(node.value.split()))
        for file, tree in sources()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]


def help_lines() -> list[Sentence]:
    """The help of each option that `--help-all` shows, once per text."""
    every, found = strings(), {}
    for command in every_command():
        module = load_command(command)
        if not hasattr(module, "Options"):
            continue
        for action in _parser(module.Options, "a2v", "", "", level=HELP_ALL)._actions:
            text = " ".join(str(action.help or "").split())
            if text and text != argparse.SUPPRESS and text not in found:
                place = next((one for one in every if text in one.text), Sentence("", "", 0, ""))
                name = f"a2v {command} {(action.option_strings or [action.dest])[-1]}"
                found[text] = Sentence(place.file, name, place.line, text)
    return list(found.values())


def messages() -> list[Sentence]:
    """The messages of `scripts/list_refusals.py` with the lines of their calls."""
    return [
        Sentence(file, "", line, text)
        for file, _ in sources()
        for line, text in placed_refusals(ROOT / file)
    ]


def main() -> None:
    """Print the drawn sentences."""
    parser = argparse.ArgumentParser(description="Draw sentences for a second reader.")
    parser.add_argument("--seed", type=int, required=True, help="seed of the draw")
    parser.add_argument("--docstrings", type=int, default=20, help="number of docstrings")
    parser.add_argument("--help-lines", type=int, default=20, help="number of help lines")
    parser.add_argument("--messages", type=int, default=10, help="number of messages")
    parser.add_argument("--below", default="", help="folder or file whose sentences are drawn")
    given = parser.parse_args()
    kinds = (
        ("docstring", given.docstrings, lambda: docstrings(given.below)),
        ("help line", given.help_lines, help_lines),
        ("message", given.messages, messages),
    )
    for kind, number, gather in kinds:
        if not number:
            continue
        every = sorted(one for one in gather() if one.file.startswith(given.below))
        drawn = random.Random(f"{kind} {given.seed}").sample(every, min(number, len(every)))
        print(f"== {len(drawn)} of {len(every)} {kind}s, seed {given.seed}\n")
        for position, one in enumerate(drawn, 1):
            print(f"{position}. {one.file}:{one.line} {one.name}\n{one.text}\n")


if __name__ == "__main__":
    main()
