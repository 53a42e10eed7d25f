"""Common base of the requests: named fields whose values are checked.

A field has the same name on the command line, in a table, in YAML and in Python.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import os
import re
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from typing_extensions import Self

from a2v.errors import InputError
from a2v.io import brief, shorten

SEEDS = 2**32
"""Upper bound of seeds: numpy and the renderer accept no larger ones."""
_YES_NO = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
_MADE_OF = {int: "a whole number", float: "a number", bool: "yes or no", str: "text"}


@dataclass(frozen=True, kw_only=True)
class Request:
    """Base of the requests. Values have the types of their fields; choices and seeds are valid."""

    def __post_init__(self) -> None:
        own: Any = type(self)
        for name, rule in _rules(own).items():
            value = getattr(self, name)
            checked = rule.check(name, value)
            if checked is not value:
                object.__setattr__(self, name, checked)

    @classmethod
    def of(cls, **values: object) -> Self:
        """Make a request from values by name.

        Text is converted to the field's type. A list of names may replace text with commas.

        Raises
        ------
        InputError
            An unknown name (the nearest are named), a missing one, or a value that the field cannot
            have.
        """
        given = _converted(cls, values)
        if missing := [
            item.name
            for item in dataclasses.fields(cls)
            if _is_required(item) and item.name not in given
        ]:
            raise InputError(f"no {missing[0]} given; name one")
        return cls(**given)

    def changed(self, **values: object) -> Self:
        """Return the request with some values replaced; see `of`."""
        return dataclasses.replace(self, **_converted(type(self), values, self)) if values else self


def names_of(kind: type, prefix: str = "") -> Iterator[str]:
    """Return the names of all values of a request; settings of a stage look like ``fit.steps``."""
    hints = hints_of(kind)
    for item in dataclasses.fields(kind):
        if dataclasses.is_dataclass(hints[item.name]):
            inner = "" if "group" in item.metadata else f"{prefix}{item.name}."
            yield from names_of(typing.cast(type, hints[item.name]), inner)
        else:
            yield prefix + item.name


@functools.cache
def hints_of(kind: Any) -> Mapping[str, Any]:
    """Return the types of the fields of a dataclass."""
    return typing.get_type_hints(kind)


def check_known(names: typing.Collection[str], known: typing.Collection[str]) -> None:
    """Refuse names that no request has.

    Raises
    ------
    InputError
        A name is unknown; the message lists the nearest ones.
    """
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=2, cutoff=0.5)
            hint = (
                f"did you mean {' or '.join(near)}?"
                if near
                else f"the names are {', '.join(sorted(known))}"
            )
            raise InputError(f"unknown setting '{shorten(name, 60)}'; {hint}")


# --- one value


@dataclass(frozen=True)
class _Rule:
    """The allowed values of a field.

    Attributes
    ----------
    kind : type
        Type of the value if it is not None.
    optional : bool
        Whether None is allowed.
    choices : sequence of str
        Allowed values; if empty, any value is allowed.
    """

    kind: type
    optional: bool
    choices: typing.Sequence[str] = ()

    @classmethod
    def of(cls, hint: Any, choices: typing.Sequence[str] = ()) -> _Rule:
        """Make the rule of a type hint."""
        if typing.get_origin(hint) is Literal:
            return cls(str, False, typing.get_args(hint))
        kinds = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
        return cls(
            next(kind for kind in kinds if kind is not type(None)),
            type(None) in kinds,
            choices or (),
        )

    def check(self, name: str, value: object) -> object:
        """Return the value; a whole number becomes a float if the field is one.

        Raises
        ------
        InputError
            The value does not fit the field.
        """
        if value is None and self.optional:
            return value
        if self.kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not isinstance(value, self.kind) or (isinstance(value, bool) and self.kind is not bool):
            raise InputError(
                f"{name} is {brief(value)}; expected {_MADE_OF.get(self.kind, self.kind.__name__)}"
            )
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{name} is {value}; expected a finite number")
        if self.choices and value not in self.choices:
            raise InputError(f"{name} is {brief(value)}; choose from {', '.join(self.choices)}")
        if name.endswith("seed") and isinstance(value, int) and not 0 <= value < SEEDS:
            raise InputError(
                f"{name} is {brief(value)}; expected a whole number from 0 to {SEEDS - 1}"
            )
        return value

    def read(self, name: str, value: object) -> object:
        """Convert a text, a path or a list of names to the field's type, then `check` it."""
        if self.kind is str:
            if isinstance(value, os.PathLike):
                value = os.fspath(value)
            if (
                isinstance(value, list | tuple)
                and value
                and all(isinstance(one, str) for one in value)
            ):
                value = ",".join(value)
        elif isinstance(value, str):
            value = self._of_text(name, value)
        return self.check(name, value)

    def _of_text(self, name: str, text: str) -> object:
        if self.kind is bool and text.lower() in _YES_NO:
            return _YES_NO[text.lower()]
        if self.kind is int and re.fullmatch(r"[+-]?\d{1,18}", text, re.ASCII):
            return int(text)
        if self.kind is float and re.fullmatch(r"[+-]?\d{1,18}(\.\d{0,18})?", text, re.ASCII):
            return float(text)
        raise InputError(
            f"{name} is '{shorten(text, 60)}'; expected "
            f"{_MADE_OF.get(self.kind, self.kind.__name__)}"
        )


@functools.cache
def _rules(kind: Any) -> Mapping[str, _Rule]:
    hints = hints_of(kind)
    return {
        item.name: _Rule.of(
            hints[item.name], (item.metadata.get("option") or {}).get("choices") or ()
        )
        for item in dataclasses.fields(kind)
    }


def _is_required(item: dataclasses.Field[Any]) -> bool:
    return item.default is dataclasses.MISSING and item.default_factory is dataclasses.MISSING


def _converted(kind: type, values: Mapping[str, object], now: object = None) -> dict[str, Any]:
    """Convert values to the types of the fields of a dataclass.

    Settings may be an object, a mapping, or single values such as ``fit.steps``.
    """
    rules, hints, found = _rules(kind), hints_of(kind), dict[str, Any]()
    for name, value in values.items():
        own, _, inner = name.partition(".")
        if own not in rules or (inner and not dataclasses.is_dataclass(hints[own])):
            check_known([name], set(names_of(kind)) | set(rules))
        if inner or (dataclasses.is_dataclass(hints[own]) and isinstance(value, Mapping)):
            before = found.get(own, getattr(now, own, None))
            known = hints[own]() if before is None else before
            parts: Mapping[str, object] = (
                {inner: value} if inner else typing.cast(Mapping[str, object], value)
            )
            found[own] = dataclasses.replace(known, **_converted(hints[own], parts, known))
        else:
            found[own] = rules[own].read(name, value)
    return found
