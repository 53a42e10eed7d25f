"""Options of commands as dataclasses: one field is one option on the command line and in YAML.

It has the same name in Python. A command's ``Options`` is a frozen, keyword-only dataclass of
`option`, `flag`, `group` and `settings` fields; `parse` makes one from the command line. Names have
hyphens for users; underscores are accepted too.
"""

from __future__ import annotations

import argparse
import copy
import dataclasses
import functools
import shutil
import typing
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

import jsonargparse
import yaml

from a2v.errors import A2VError, InputError
from a2v.io import brief, shorten
from pipelines.arguments import (
    check_found,
    check_typed,
    explained,
    gather_repeated,
    with_hyphens,
    with_words_set,
)
from pipelines.field_docs import field_docs, summary
from pipelines.parsing import adapt

T = TypeVar("T")

_WIDTH = 124
_MODE = "a2v"

adapt()


def option(
    help: str,
    *,
    default: object = dataclasses.MISSING,
    names: Sequence[str] = (),
    metavar: str | None = None,
    choices: Sequence[str] | None = None,
    many: str = "",
    more: str = "",
    rare: bool = False,
    sets: Mapping[str, str] | None = None,
) -> Any:
    """Make a field that is an option; it is required if it has no default.

    Parameters
    ----------
    names : what users call it, if not the field's name; without hyphens before it, a positional
    argument
    metavar : name of its value in the help
    many : "repeated" (``--x 1 --x 2``) or "listed" (``--x 1 2``) for a tuple
    more : text field that gets all values after the first one, separated by commas
    rare : shown by ``--help-all`` only
    sets : values of other options that a given flag stands for; those that are given are kept
    """
    facts = {
        "help": help,
        "names": tuple(names),
        "metavar": metavar,
        "choices": choices,
        "many": many,
        "more": more,
        "rare": rare,
        "sets": sets or {},
    }
    return dataclasses.field(default=default, metadata={"option": facts})


def flag(help: str, *, rare: bool = False, sets: Mapping[str, str] | None = None) -> Any:
    """Make a field that is True if the option is given; `sets` as in `option`."""
    return option(help, default=False, many="flag", rare=rare, sets=sets)


def group(kind: type[T], title: str = "") -> T:
    """Make a field for a dataclass of options, such as those that several commands share.

    They appear below `title` in the help.
    """
    return dataclasses.field(
        default_factory=lambda: kind(), metadata={"group": True, "title": title}
    )


def settings(kind: type[T], users: Sequence[str] | None = None) -> T:
    """Make a field for the library's settings: options ``--field.name``, shown by ``--help-all``.

    With `users` only these names are: the others are internal settings of a stage and are shown by
    ``--help-lab``.
    """
    return dataclasses.field(default_factory=kind, metadata={"settings": True, "users": users})


class _Formatter(jsonargparse.DefaultHelpFormatter, argparse.RawDescriptionHelpFormatter):
    """Help with hyphens in names, with defaults, and with the examples unchanged."""

    def __init__(self, prog: str, **given: Any) -> None:
        width = min(shutil.get_terminal_size((_WIDTH, 50)).columns - 2, _WIDTH)
        super().__init__(prog, **(given | {"max_help_position": 30, "width": width}))  # type: ignore[no-untyped-call]  # of jsonargparse

    def _format_action_invocation(self, action: argparse.Action) -> str:
        return with_hyphens(super()._format_action_invocation(action)).replace(" \b", "")

    def _get_help_string(self, action: argparse.Action) -> str:
        text = action.help or ""
        nothing = action.default is False or action.default in (None, "", (), [], argparse.SUPPRESS)
        return (
            text
            if nothing or action.required or not action.option_strings
            else f"{text} (default: %(default)s)".lstrip()
        )


def parse(kind: type[T], arguments: Sequence[str], *, command: str, about: str, examples: str) -> T:
    """Parse `arguments`; ``--help``, ``--help-all`` and ``--help-lab`` print and end the program.

    Parameters
    ----------
    command : its name, such as ``video``
    about : one line that describes the command
    examples : shown below the options

    Raises
    ------
    InputError
        Unknown, missing or malformed options.
    """
    words = gather_repeated(kind, [_with_underscores(argument) for argument in arguments])
    given = with_words_set(kind, words)
    level = 2 if "--help_lab" in given else 1 if "--help_all" in given else 0
    known: type = kind
    parser = _parser(known, f"a2v {command}", about, examples, level)
    check_typed(kind, given)
    try:
        found = parser.instantiate(parser.parse_args(["--help"] if level else given))
    except argparse.ArgumentError as error:
        text = explained(str(error), parser)
        raise InputError(f"{text}; see a2v {command} --help") from None
    except (A2VError, OSError):
        raise
    except (
        Exception
    ) as error:  # a --config that is not text, is nested too deeply, or has another type
        raise InputError(
            f"the options cannot be read ({type(error).__name__}: {shorten(error)}); see a2v "
            f"{command} --help"
        ) from None
    finally:  # jsonargparse keeps the request of --print-config here if the parsing fails
        vars(parser).pop("print_config", None)
    check_found(kind, found, given)
    return _made(kind, found)


def actions_of(kind: type) -> list[argparse.Action]:
    """Yield every option of a command for argparse, with hyphens, for completion and help."""
    actions = [copy.copy(action) for action in _parser(kind, "a2v", "", "", level=2)._actions]
    for action in actions:
        action.option_strings = [with_hyphens(name) for name in action.option_strings]
    return [
        action
        for action in actions
        if "--print-config" not in action.option_strings and action.dest != "help"
    ]


@functools.cache
def _parser(
    kind: type, prog: str, about: str, examples: str, level: int
) -> jsonargparse.ArgumentParser:
    """Build the parser. Its help shows the most common options (`level` 0), all options for users
    (1), or the settings of the laboratory too (2).
    """
    jsonargparse.set_loader(_MODE, _load, (yaml.YAMLError,))
    parser = jsonargparse.ArgumentParser(
        prog=prog,
        description=about,
        epilog=examples,
        formatter_class=_Formatter,
        exit_on_error=False,
        parser_mode=_MODE,
    )
    levels = {"print_config": 1, "json": 1} | dict(_add(parser, kind, None, headings=level > 0))
    parser.add_argument(
        "--config",
        action="config",
        metavar="FILE",
        help="YAML file with values of these options, by their names",
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="print one JSON object with files, facts and errors",
    )
    hidden = {action.dest: _level(action.dest, levels) for action in parser._actions}
    if any(hidden[name] for name in hidden if name not in ("print_config", "json")):
        parser.add_argument(
            "--help_all",
            action="store_true",
            help="show every option, including the settings of the stages",
        )
    within = sum(found == 2 for found in hidden.values())
    if within:
        parser.add_argument(
            "--help_lab",
            action="store_true",
            help=f"show {within} internal settings of the stages as well, for research",
        )
    for action in parser._actions:
        if action.dest == "print_config":
            action.help = "print all options with their values as YAML, for --config, and exit"
        if hidden.get(action.dest, int(action.dest == "help_lab")) > level:
            action.help = argparse.SUPPRESS
    needed = [action for action in parser._actions if action.required]
    shown = [
        f"{action.option_strings[0]} {action.metavar or action.dest.upper()}"
        if action.option_strings
        else str(action.metavar or action.dest)
        for action in needed
    ]
    parser.usage = " ".join([prog, *map(with_hyphens, shown), "[options]"]).replace("%", "%%")
    return parser


def _level(name: str, levels: Mapping[str, int]) -> int:
    """Return the help level of an option: that of the longest name in `levels` that contains it."""
    while name and name not in levels:
        name = name.rpartition(".")[0]
    return levels.get(name, 0)


def _add(
    parser: jsonargparse.ArgumentParser, kind: type, section: Any, *, headings: bool
) -> Iterator[tuple[str, int]]:
    """Add the fields of a dataclass to `parser`, plain options to the `section` of its help.

    Return the names that ``--help`` does not show, and their levels.
    """
    hints = typing.get_type_hints(kind)
    for item in dataclasses.fields(kind):
        if "option" in item.metadata:
            _add_option(section or parser, item, hints[item.name])
            if item.metadata["option"]["rare"]:
                yield item.name, 1
        elif "group" in item.metadata:
            title = item.metadata["title"]
            yield from _add(
                parser,
                hints[item.name],
                _section(parser, title) if title and headings else section,
                headings=headings,
            )
        elif "settings" in item.metadata:
            parser.add_class_arguments(hints[item.name], item.name)
            _describe(parser, hints[item.name], f"{item.name}.")
            users = item.metadata["users"]
            yield item.name, 2 if users == () else 1
            yield from (
                (f"{item.name}.{one.name}", 2)
                for one in dataclasses.fields(hints[item.name])
                if users is not None and one.name not in users
            )
        else:  # the library's settings as a group
            parser.add_class_arguments(kind, None)
            _describe(parser, kind, "")
            yield from (
                (one.name, 1)
                for one in dataclasses.fields(kind)
                if dataclasses.is_dataclass(hints[one.name])
            )
            return


def _section(parser: jsonargparse.ArgumentParser, title: str) -> Any:
    """Return the section of the help with this heading; groups with one heading share it."""
    found = [one for one in parser._action_groups if one.title == title]
    return found[0] if found else parser.add_argument_group(title)


def _add_option(parser: Any, item: dataclasses.Field[Any], kind: Any) -> None:
    facts = item.metadata["option"]
    names = facts["names"] or (f"--{item.name}",)
    how: dict[str, Any] = {"help": facts["help"]}
    if names[0].startswith("-"):
        how |= {"dest": item.name, "required": item.default is dataclasses.MISSING}
    if item.default is not dataclasses.MISSING:
        how["default"] = item.default
    if facts["metavar"]:
        how["metavar"] = facts["metavar"]
    if facts["many"]:
        how |= {
            "flag": {"action": "store_true"},
            "repeated": {"action": "append"},
            "listed": {"nargs": "+"},
        }[facts["many"]]
        how["default"] = False if facts["many"] == "flag" else []
    elif facts["choices"]:
        how["choices"] = tuple(facts["choices"])
    elif kind is not str:
        how["type"] = kind
    parser.add_argument(*names, **how)


def _describe(parser: jsonargparse.ArgumentParser, kind: type, prefix: str) -> None:
    """Give the options of the library's settings the text of their docstrings."""
    about, hints = field_docs(kind), typing.get_type_hints(kind)
    for action in parser._actions:
        name = action.dest.removeprefix(prefix)
        if action.dest == prefix + name and name in about:
            action.help = about[name]
        elif action.dest == prefix.removesuffix("."):
            action.help = "YAML file of these settings"
    for section in parser._action_groups:
        if section.title == str(kind):
            section.title = " ".join([*([f"--{prefix}*"] if prefix else []), summary(kind)])
    for item in dataclasses.fields(kind):
        if dataclasses.is_dataclass(hints[item.name]):
            _describe(parser, typing.cast(type, hints[item.name]), f"{prefix}{item.name}.")


def _made(kind: type[T], found: jsonargparse.Namespace) -> T:
    """Return the dataclass with the values of the parsed options."""
    hints = typing.get_type_hints(kind)
    values: dict[str, object] = {}
    for item in dataclasses.fields(typing.cast(Any, kind)):
        if "group" in item.metadata:
            values[item.name] = _made(hints[item.name], found)
        else:
            value = found[item.name]
            if isinstance(value, list) and not item.metadata.get("option", {}).get(
                "many"
            ):  # argparse's result for --x=--
                raise InputError(f"{with_hyphens(f'--{item.name}')} has no value; give one")
            if (
                value is None
                and item.default is not None
                and type(None) not in typing.get_args(hints[item.name])
            ):  # "name:" in a file
                raise InputError(
                    f"{with_hyphens(f'--{item.name}')} has no value; give one, or leave it out"
                )
            if hints[item.name] is str and not isinstance(value, str):  # "name: 1" in a file
                raise InputError(
                    f"{with_hyphens(f'--{item.name}')} is {brief(value)}; expected text, in "
                    "quotation marks"
                )
            values[item.name] = (
                tuple(value) if isinstance(value, list) and "option" in item.metadata else value
            )
    return kind(**values)


def _with_underscores(argument: str) -> str:
    """Return an argument in the parser's form: hyphens in its name become underscores, its value is
    unchanged."""
    if not argument.startswith("--"):
        return argument
    name, given, value = argument[2:].partition("=")
    return f"--{name.replace('-', '_')}{given}{value}"


def _load(text: str) -> object:
    """Read a YAML value for jsonargparse; ``{a, b}`` and ``a:`` stay text, as in its own loader."""
    return _keys_with_underscores(jsonargparse.get_loader("yaml")(text))


def _keys_with_underscores(value: object) -> object:
    if isinstance(value, dict):
        return {
            str(key).replace("-", "_"): _keys_with_underscores(item) for key, item in value.items()
        }
    return value
