"""Find the imports of a module in its source, without importing anything."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

PROJECT = ("a2v", "export", "pipelines")
"""The packages whose imports are followed."""

_TYPE_CHECKING = re.compile(
    r"^([ \t]*)if TYPE_CHECKING:.*\n(?:\1[ \t]+.*\n|[ \t]*\n)*", re.MULTILINE
)
_IMPORT = re.compile(
    rf"^[ \t]*((?:from|import)[ \t]+(?:(?:{'|'.join(PROJECT)})\b|\.)[^\n(]*(?:\([^)]*\))?)",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Import:
    """One imported name: ``from module import name as alias``.

    `name` is empty for ``import module as alias``.
    """

    module: str
    name: str
    alias: str


def imports_in(text: str, package: str) -> list[Import]:
    """Return the project's names that a module imports anywhere, except for type checkers only.

    Only lines that begin like imports of the project are parsed, which takes a thirtieth of the
    time of parsing the whole source.

    Parameters
    ----------
    package : what relative imports are relative to
    """
    seen = _TYPE_CHECKING.sub("", text) if "TYPE_CHECKING:" in text else text
    try:
        nodes: Iterable[ast.AST] = ast.parse(
            "\n".join(match[1] for match in _IMPORT.finditer(seen))
        ).body
    except SyntaxError:  # prose that begins like an import
        nodes = ast.walk(parse(text))
    return [one for one in imports_of(nodes, package) if one.module.partition(".")[0] in PROJECT]


def imports_of(nodes: Iterable[ast.AST], package: str) -> Iterator[Import]:
    """Return what the import statements among `nodes` import, relative to `package`."""
    for node in nodes:
        if isinstance(node, ast.Import):
            for name in node.names:
                whole = name.name.split(
                    "."
                )  # Without an alias it binds the first package, any part of which may be used.
                above = (
                    [] if name.asname else [".".join(whole[: i + 1]) for i in range(len(whole) - 1)]
                )
                yield from (
                    Import(module, "", name.asname or whole[0]) for module in (*above, name.name)
                )
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: package.count(".") + 2 - node.level] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield from (Import(module, name.name, name.asname or name.name) for name in node.names)


def parse(text: str) -> ast.Module:
    """Parse a module's source without the code under ``if TYPE_CHECKING:``."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.If)
            and isinstance(node.test, ast.Name)
            and node.test.id == "TYPE_CHECKING"
        ):
            node.body = []
    tree.body = [
        node for node in tree.body if not isinstance(node, ast.If) or node.body or node.orelse
    ]
    return tree
