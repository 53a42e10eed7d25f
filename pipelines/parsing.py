"""What a2v changes of jsonargparse: which files and YAML it reads, and how it finds options."""

from __future__ import annotations

import argparse
from types import SimpleNamespace
from typing import Any
from weakref import WeakKeyDictionary

from jsonargparse import _core, _loaders_dumpers, _paths, _subcommands

from a2v.errors import InputError
from a2v.io import read_bytes
from a2v.plain_yaml import PlainLoader

_MAX_SETTINGS_BYTES = 1 << 20


def adapt() -> None:
    """Change jsonargparse.

    It waits for pipes, reads devices to their end and expands merge keys, so every file and text
    that it reads passes here. It compares every name with every option, several times for each
    command line, which took two thirds of the time of reading the options of ``a2v video``.
    """
    _paths.Path.read_text = _settings_text  # type: ignore[method-assign, assignment]
    _loaders_dumpers.yaml_default_loader = PlainLoader  # type: ignore[assignment]
    for name in ("find_action", "find_action_and_subcommand"):
        setattr(_core, name, globals()[f"_{name}"])


def _settings_text(path: _paths.Path) -> str:
    """Return the text of a settings file: a regular, short file in UTF-8."""
    if path.absolute in ("-", "/dev/stdin"):
        raise InputError("settings cannot be read from standard input (-); give a YAML file")
    data = read_bytes(path.absolute, limit=_MAX_SETTINGS_BYTES, empty=True)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path.absolute} is not UTF-8 text ({error.reason}); expected YAML"
        ) from None


_tables = WeakKeyDictionary[Any, tuple[int, dict[str, list[argparse.Action]]]]()


def _named(parser: Any) -> dict[str, list[argparse.Action]]:
    """Return the actions of a parser by the names that mean them, in their order."""
    count, table = _tables.get(parser, (-1, {}))
    if count != len(parser._actions):
        table = {}
        for action in parser._actions:
            for name in {action.dest, *(text[2:] for text in action.option_strings)}:
                table.setdefault(name, []).append(action)
        _tables[parser] = len(parser._actions), table
    return table


def _find_action_and_subcommand(parser: Any, dest: str, exclude: Any = None) -> tuple[Any, Any]:
    """Do the same as jsonargparse's function, for parsers without commands of their own."""
    few = SimpleNamespace(_actions=_named(parser).get(dest, []))
    found: tuple[Any, Any] = _subcommands.find_action_and_subcommand(few, dest, exclude=exclude)  # type: ignore[arg-type]
    return found


def _find_action(parser: Any, dest: str, exclude: Any = None) -> Any:
    """Do the same as jsonargparse's function, for parsers without commands of their own."""
    return _find_action_and_subcommand(parser, dest, exclude)[0]
