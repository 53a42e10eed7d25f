"""A file of jobs, CSV or YAML, as rows of checked options.

A row names a photo and what to do; every column is an option of ``a2v video`` by the same name, and an empty cell leaves it as the command
line has it. Relative paths are relative to the jobs file.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import os
import re
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from a2v.errors import InputError
from a2v.io import read_bytes, shorten
from pipelines.inputs import LookOptions
from pipelines.motion_options import MotionOptions

MAX_FILE_BYTES = 64 << 20
MAX_ROWS = 100_000
MAX_CELL = 4096
"""Characters of a cell."""
_FILES = ("photo", "mask", "keypoints", "motion", "camera", "keyframes")
_MAYBE_FILES = ("model", "background", "look", "path")
_YES_NO = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


@dataclass(frozen=True, kw_only=True)
class Row:
    """One job as it was asked for.

    Attributes
    ----------
    number : int
        Its place in the file, from 1.
    name : str
        What the user calls it.
    photo, mask, keypoints : str or None
        Paths.
    motion, look : options of ``a2v video``
    problem : str
        Why it cannot be done; empty where it may be.
    """

    number: int
    name: str = ""
    photo: str = ""
    mask: str | None = None
    keypoints: str | None = None
    motion: MotionOptions
    look: LookOptions
    problem: str = ""


def read_rows(path: str | os.PathLike[str], motion: MotionOptions, look: LookOptions) -> list[Row]:
    """The rows of a jobs file; `motion` and `look` hold what a row leaves open.

    Raises
    ------
    InputError
        The file cannot be read, is neither CSV nor YAML, or has unknown columns or too many rows. A single bad cell is its row's `problem`.
    """
    source = Path(path)
    data = read_bytes(source, limit=MAX_FILE_BYTES)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{source} is no UTF-8 text ({error.reason}); save it as UTF-8") from None
    if source.suffix.lower() not in (".csv", ".yaml", ".yml"):
        raise InputError(f"cannot read jobs from {source}; expected a .csv or .yaml file")
    found = list(_csv_rows(text, source) if source.suffix.lower() == ".csv" else _yaml_rows(text, source))
    if not found:
        raise InputError(f"{source} names no jobs; expected a row for every video, with at least the columns photo and action")
    known = {"name", "photo", "mask", "keypoints", *(item.name for kind in (MotionOptions, LookOptions) for item in dataclasses.fields(kind))}
    if unknown := sorted({name for given in found for name in given} - known):
        raise InputError(f"{source} has the unknown column '{shorten(unknown[0], 60)}'; the columns are {', '.join(sorted(known))}")
    return [_row(number, given, source.parent, motion, look) for number, given in enumerate(found, 1)]


def _csv_rows(text: str, source: Path) -> Iterator[dict[str, object]]:
    try:
        reader = csv.DictReader(io.StringIO(text, newline=""), skipinitialspace=True, strict=True)
        names = [_plain(name) for name in reader.fieldnames or ()]
        if len(set(names)) < len(names):
            raise InputError(f"{source} names a column twice; expected every name once in its first line")
        reader.fieldnames = names
        for number, row in enumerate(reader, 1):
            _check_count(number, source)
            if None in row:
                raise InputError(f"line {reader.line_num} of {source} has more cells than the first line; put quotes around text with commas")
            given = {name: value.strip() for name, value in row.items() if value is not None and value.strip()}
            if given:
                yield dict(given)
    except csv.Error as error:
        raise InputError(f"{source} is no readable CSV ({shorten(error, 80)})") from None


def _yaml_rows(text: str, source: Path) -> Iterator[dict[str, object]]:
    try:
        content = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{source} is no readable YAML ({shorten(error, 120)})") from None
    if not isinstance(content, list):
        raise InputError(f"{source} holds {shorten(content, 60)}; expected a list of jobs, each with photo and action")
    for number, given in enumerate(content, 1):
        _check_count(number, source)
        if not isinstance(given, dict):
            raise InputError(f"job {number} of {source} is {shorten(given, 60)}; expected names and values, such as photo: me.jpg")
        yield {_plain(name): value for name, value in given.items() if value is not None}


def _check_count(number: int, source: Path) -> None:
    if number > MAX_ROWS:
        raise InputError(f"{source} has more than {MAX_ROWS} jobs; split it into several files")


def _plain(name: object) -> str:
    return str(name or "").strip().lower().replace("-", "_")[:MAX_CELL]


def _row(number: int, given: Mapping[str, object], base: Path, motion: MotionOptions, look: LookOptions) -> Row:
    try:
        values = {name: _text(name, value) for name, value in given.items()}
        for name in set(values) & {*_FILES, *_MAYBE_FILES}:
            beside = base / values[name]
            if name in _FILES or beside.is_file():
                values[name] = str(beside)
        own = {name: values[name] for name in ("name", "photo", "mask", "keypoints") if name in values}
        row = Row(number=number, **own, motion=_changed(motion, values), look=_changed(look, values))
    except (InputError, OSError, ValueError) as error:
        return Row(number=number, name=shorten(given.get("name", ""), 60), motion=motion, look=look, problem=shorten(error, 300))
    return row if row.photo else dataclasses.replace(row, problem="no photo given; name one in the column photo")


def _text(name: str, value: object) -> str:
    """A cell of CSV or YAML as text; a YAML list is text with commas."""
    if isinstance(value, list) and len(value) <= 100 and all(isinstance(item, str) for item in value):
        value = ",".join(value)
    if not isinstance(value, str | int | float):
        raise InputError(f"{name} is {shorten(value, 60)}; expected text or a number")
    text = value if isinstance(value, str) else str(value)
    if len(text) > MAX_CELL or "\0" in text:
        raise InputError(f"{name} is {shorten(text, 60)}; expected at most {MAX_CELL} characters, none of them zero")
    return text


def _changed(options: Any, values: Mapping[str, str]) -> Any:
    """`options` with the `values` that are theirs."""
    hints = typing.get_type_hints(type(options))
    return dataclasses.replace(options, **{name: _value(name, text, hints[name]) for name, text in values.items() if name in hints})


def _value(name: str, text: str, hint: Any) -> object:
    kinds = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    kind = next(kind for kind in kinds if kind is not type(None))
    if kind is str:
        return text
    if kind is bool and text.lower() in _YES_NO:
        return _YES_NO[text.lower()]
    if kind is int and re.fullmatch(r"[+-]?\d{1,18}", text, re.ASCII):
        return int(text)
    if kind is float and re.fullmatch(r"[+-]?\d{1,18}(\.\d{0,18})?", text, re.ASCII):
        return float(text)
    raise InputError(f"{name} is '{shorten(text, 60)}'; expected {dict.fromkeys([int], 'a whole number').get(kind, 'yes or no' if kind is bool else 'a number')}")
