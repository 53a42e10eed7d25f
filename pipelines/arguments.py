"""Check the arguments of the command line, and describe what is wrong with them."""

from __future__ import annotations

import argparse
import dataclasses
import difflib
import math
import re
import typing
from collections.abc import Iterator, Sequence

import jsonargparse

from a2v.errors import InputError
from a2v.io import brief, shorten

_NO_LIST = r"expected a list in brackets, such as [1,2], instead of \1"


def explained(error: str, parser: argparse.ArgumentParser) -> str:
    """Return the message about arguments that the parser refuses with `error`, in one line."""
    lines = [line.strip() for line in error.splitlines() if line.strip()]
    if lines and (unknown := _unknown(lines[0], parser)):
        return unknown
    if "of the Union subtypes" in error:
        lines = [f"{lines[0].partition(':')[0]}: {_of_no_kind(error)}"]
    text = re.sub(r'Parser key "([\w.]+)"', r"--\1", " ".join(lines[:3]) or "bad arguments")
    text = re.sub(r"Expected a <class 'tuple'>\. Got value: (.*)", _NO_LIST, text)
    return with_hyphens(shorten(text, 600))


def _of_no_kind(text: str) -> str:
    """Return the message for a value that has none of the types of its option."""
    given = re.search(r"Given value: (.*)", text)
    kind = next(
        (
            words
            for name, words in (("int", "a whole number"), ("float", "a number"))
            if f"<class '{name}'>" in text
        ),
        "another value",
    )
    return f"'{shorten(given[1], 60) if given else ''}'; expected {kind}"


def _unknown(error: str, parser: argparse.ArgumentParser) -> str:
    """Return the message about arguments that no option takes, with the nearest options; "" for
    another error."""
    found = re.match(r"unrecognized arguments: (\S+)|Option '([\w.]+)' is not accepted", error)
    if found is None:
        return ""
    given = with_hyphens(found[1].partition("=")[0] if found[1] else f"--{found[2]}")
    if not given.startswith("-"):
        return f"unexpected argument '{shorten(given, 60)}'; values follow the name of an option"
    known = [with_hyphens(name) for action in parser._actions for name in action.option_strings]
    near = difflib.get_close_matches(given, known, n=2, cutoff=0.7)
    hint = f"; did you mean {' or '.join(near)}?" if near else ""
    return f"unknown option {shorten(given, 60)}{hint}"


def gather_repeated(kind: type, given: Sequence[str]) -> list[str]:
    """Return the arguments with repeated options merged.

    Further values of a repeated option go to the option that its ``more`` names.
    """
    result = list(given)
    for name, field in _with_more(kind):
        places = [
            place
            for place, argument in enumerate(result)
            if argument == f"--{name}" or argument.startswith(f"--{name}=")
        ]
        extra = list[str]()
        for place in reversed(places[1:]):
            together = "=" in result[place]
            extra[:0] = (
                [result[place].partition("=")[2]] if together else result[place + 1 : place + 2]
            )
            del result[place : place + (1 if together else 2)]
        if extra:
            result += [f"--{field}", ",".join(extra)]
    return result


def flags_that_set(kind: type) -> list[dataclasses.Field[typing.Any]]:
    """Return the flags of a command that stand for values of other options."""
    return [
        item for item in dataclasses.fields(kind) if (item.metadata.get("option") or {}).get("sets")
    ]


def with_words_set(kind: type, given: Sequence[str]) -> list[str]:
    """Return the arguments with those that given flags stand for, which come first: so options that
    are given stay in force."""
    words = [
        f"--{name}={value}"
        for item in flags_that_set(kind)
        if f"--{item.name}" in given
        for name, value in item.metadata["option"]["sets"].items()
    ]
    return [*words, *given]


def _with_more(kind: type) -> Iterator[tuple[str, str]]:
    """Return the options that may be repeated, and the fields that take their further values."""
    for item in dataclasses.fields(kind):
        if "group" in item.metadata:
            yield from _with_more(typing.get_type_hints(kind)[item.name])
        elif more := (item.metadata.get("option") or {}).get("more"):
            yield item.name, more


def check_typed(kind: type, given: Sequence[str]) -> None:
    """Refuse standard input as a file of settings."""
    names = {"--config", *_settings_of(kind)}
    for place, argument in enumerate(given):
        name, together, value = argument.partition("=")
        if name in names and (value if together else given[place + 1 : place + 2]) in ("-", ["-"]):
            raise InputError(f"{name} cannot read standard input (-); give a YAML file")


def _settings_of(kind: type) -> Iterator[str]:
    """Return the options of a dataclass that take a file of settings."""
    for item in dataclasses.fields(kind):
        if "settings" in item.metadata:
            yield f"--{item.name}"
        elif "group" in item.metadata:
            yield from _settings_of(typing.get_type_hints(kind)[item.name])


def check_found(kind: type, found: jsonargparse.Namespace, given: Sequence[str]) -> None:
    """Check the parsed values (`_check_numbers`). Refuse, in a file of settings, what is read from
    the command line alone: --json, for which `pipelines.cli` looks there, and flags that set other
    options."""
    _check_numbers(found)
    for name in ("json", *(item.name for item in flags_that_set(kind))):
        if found[name] and f"--{name}" not in given:
            raise InputError(f"{name} cannot be set in a file; give --{name} on the command line")


def _check_numbers(found: jsonargparse.Namespace) -> None:
    """Require finite numbers, and seeds in the range of numpy and the renderer."""
    for name, value in found.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{with_hyphens(f'--{name}')} is {value}; expected a finite number")
        if name.endswith("seed") and isinstance(value, int) and not 0 <= value < 2**32:
            raise InputError(
                f"{with_hyphens(f'--{name}')} is {brief(value)}; expected a whole number from 0 to "
                f"{2**32 - 1}"
            )


def with_hyphens(text: str) -> str:
    """Return a text with hyphens in the names of options."""
    return re.sub(r"--[\w.]+", lambda name: name[0].replace("_", "-"), text)
