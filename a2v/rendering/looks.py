"""Looks: lights, sky and ground by name or from a custom file."""

from __future__ import annotations

import dataclasses
import difflib
import os
import types
import typing
from pathlib import Path
from typing import Any

from a2v.errors import InputError
from a2v.io import brief, read_bytes, shorten
from a2v.plain_yaml import parse_yaml
from a2v.rendering.scene import LookSettings, Triple

LOOKS = ("studio", "outdoor", "night")
"""The looks of the package; each is a YAML file in the folder `looks`."""

MAX_LOOK_FILE = 1 << 16

_KINDS = typing.get_type_hints(LookSettings)
_FIELDS = {
    field.name: _KINDS[field.name]
    for field in dataclasses.fields(LookSettings)
    if field.name != "provenance"
}


def read_look(name: str | os.PathLike[str]) -> LookSettings:
    """Read the settings of one of `LOOKS`, or of a YAML file with fields of `LookSettings`.

    Fields that the file leaves out have the values of the studio look.

    Raises
    ------
    InputError
        `name` is neither a look nor a readable file, the file is not a YAML mapping, or a field is
        unknown or has an unusable value. The message names the file.
    """
    path = Path(__file__).with_name("looks") / f"{name}.yaml" if name in LOOKS else Path(name)
    if name not in LOOKS and not path.is_file():
        raise InputError(
            f"look '{shorten(str(name), 60)}' is not a file; expected {', '.join(LOOKS)}, or a "
            "YAML file of lights"
        )
    data = read_bytes(path, limit=MAX_LOOK_FILE, empty=True)
    content = parse_yaml(data, path, "YAML", "a few lights")
    if not isinstance(content, dict | None):
        raise InputError(f"{path} is not a mapping; expected fields such as sun: [0.7, 0.7, 0.6]")
    values: dict[str, Any] = {}
    for key, value in (content or {}).items():
        if key not in _FIELDS:
            near = difflib.get_close_matches(shorten(str(key), 60), _FIELDS, n=1)
            hint = f"did you mean {near[0]}?" if near else f"choose from {', '.join(_FIELDS)}"
            raise InputError(f"{path}: unknown field '{shorten(str(key), 60)}'; {hint}")
        values[key] = _value(value, f"{path}: {key}", _FIELDS[key])
    try:
        return LookSettings(**values)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _value(given: object, what: str, kind: Any) -> Any:
    kinds = typing.get_args(kind) if isinstance(kind, types.UnionType) else (kind,)
    if given is None and type(None) in kinds:
        return None
    if Triple in kinds:
        if not isinstance(given, list) or len(given) != 3:
            raise InputError(f"{what} is {brief(given)}; expected three numbers")
        return tuple(_number(item, what) for item in given)
    if kind is bool:
        if not isinstance(given, bool):
            raise InputError(f"{what} is {brief(given)}; expected true or false")
        return given
    number = _number(given, what)
    if kind is int:
        if number != int(number):
            raise InputError(f"{what} is {brief(given)}; expected a whole number")
        return int(number)
    return number


def _number(given: object, what: str) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not abs(given) < 1e6:
        raise InputError(f"{what} has {brief(given)}; expected a number")
    return float(given)
