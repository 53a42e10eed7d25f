"""Read a CSV or YAML file of jobs as rows of checked options.

A row names a photo and an action. Every column is an option of ``a2v video`` with the same name. An
empty cell keeps the option of the command line. Relative paths are relative to the jobs file.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from a2v.io import read_bytes, shorten
from a2v.plain_yaml import parse_yaml
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import PersonStages, listed
from pipelines.requests.video import FILES, MAYBE_FILES, VideoRequest, names

MAX_FILE_BYTES = 64 << 20
MAX_ROWS = 100_000
MAX_CELL = 4096
"""Maximum number of characters of a cell."""
_POSES = ("start_pose", "end_pose")
"""Columns whose cells name a file and frames, as ``FILE#12``."""
_CHECKPOINTS = (
    "pifuhd",
    "pifu_geometry",
    "pifu_color",
    "pamir_geometry",
    "pamir_texture",
    "fit.model",
    "implicit.weights",
)
_MAYBE_FILES = (*MAYBE_FILES, *_POSES, *_CHECKPOINTS)
"""Columns whose cells may name a file or a folder."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One requested job.

    Attributes
    ----------
    number : int
        Its place in the file, from 1.
    name : str
        The user's name for it.
    request : VideoRequest
    problem : str
        Why the job cannot run; empty if it can.
    """

    number: int
    name: str = ""
    request: VideoRequest
    problem: str = ""


def defaults(stages: PersonStages, motion: MotionRequest, film: FilmRequest) -> VideoRequest:
    """Return the options for what rows do not set. Every row must name a photo."""
    return VideoRequest(person=stages.with_photo(""), motion=motion, film=film)


def read_rows(path: str | os.PathLike[str], given: VideoRequest) -> list[Row]:
    """Read the rows of a jobs file; `given` holds the options that a row does not set.

    Raises
    ------
    InputError
        The file cannot be read, is neither CSV nor YAML, or has unknown columns or too many rows. A
        single bad cell is its row's `problem`.
    """
    source = Path(path)
    data = read_bytes(source, limit=MAX_FILE_BYTES)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{source} is not UTF-8 text ({error.reason}); save it as UTF-8") from None
    if source.suffix.lower() not in (".csv", ".yaml", ".yml"):
        raise InputError(f"cannot read jobs from {source}; expected a .csv or .yaml file")
    rows = list(
        _csv_rows(text, source) if source.suffix.lower() == ".csv" else _yaml_rows(data, source)
    )
    if not rows:
        raise InputError(
            f"{source} lists no jobs; expected one row per video, with at least the columns "
            "photo and action"
        )
    known = {"name", *names()}
    if unknown := sorted({name for row in rows for name in row} - known):
        shown = sorted(name for name in known if "." not in name)
        raise InputError(
            f"{source} has the unknown column '{shorten(unknown[0], 60)}'; the columns are "
            f"{', '.join(shown)}, and settings such as fit.height"
        )
    return [_row(number, row, source.parent, given) for number, row in enumerate(rows, 1)]


def _csv_rows(text: str, source: Path) -> Iterator[dict[str, object]]:
    try:
        reader = csv.DictReader(io.StringIO(text, newline=""), skipinitialspace=True, strict=True)
        names = [_plain(name) for name in reader.fieldnames or ()]
        if len(set(names)) < len(names):
            raise InputError(
                f"{source} names a column twice; expected each column name once in the first line"
            )
        reader.fieldnames = names
        for number, row in enumerate(reader, 1):
            _check_count(number, source)
            if None in row:
                raise InputError(
                    f"line {reader.line_num} of {source} has more cells than the first line; put "
                    "quotes around text with commas"
                )
            given = {
                name: value.strip()
                for name, value in row.items()
                if value is not None and value.strip()
            }
            if given:
                yield dict(given)
    except csv.Error as error:
        raise InputError(f"{source} is no readable CSV ({shorten(error, 80)})") from None


def _yaml_rows(data: bytes, source: Path) -> Iterator[dict[str, object]]:
    content = parse_yaml(
        data, source, "readable YAML", "a list of jobs, or the same as .csv where they are many"
    )
    if not isinstance(content, list):
        raise InputError(
            f"{source} holds {shorten(content, 60)}; expected a list of jobs, each with photo and "
            "action"
        )
    for number, given in enumerate(content, 1):
        _check_count(number, source)
        if not isinstance(given, dict):
            raise InputError(
                f"job {number} of {source} is {shorten(given, 60)}; expected names and values, "
                "such as photo: me.jpg"
            )
        yield dict(_flat(given))


def _check_count(number: int, source: Path) -> None:
    if number > MAX_ROWS:
        raise InputError(f"{source} has more than {MAX_ROWS} jobs; split it into several files")


def _plain(name: object) -> str:
    return str(name or "").strip().lower().replace("-", "_")[:MAX_CELL]


def _flat(given: Mapping[object, object]) -> Iterator[tuple[str, object]]:
    """Return names and values.

    Settings of a stage, which may be a mapping in YAML, become names such as ``fit.height``.
    """
    for name, value in given.items():
        if isinstance(value, dict):
            yield from (
                (f"{_plain(name)}.{_plain(own)}", one)
                for own, one in value.items()
                if one is not None
            )
        elif value is not None:
            yield _plain(name), value


def _row(number: int, cells: Mapping[str, object], base: Path, given: VideoRequest) -> Row:
    try:
        values = {name: _text(name, value) for name, value in cells.items()}
        for name in set(values) & {*FILES, *_MAYBE_FILES}:
            file, frame, which = (
                values[name].partition("#") if name in _POSES else (values[name], "", "")
            )
            beside = base / file
            if name in FILES or beside.exists():
                values[name] = f"{beside}{frame}{which}"
        if "more" in values:
            values["more"] = ",".join(str(base / path) for path in listed(values["more"]))
        called = values.pop("name", "")
        row = Row(number=number, name=called, request=given.changed(**values))
    except (InputError, OSError, ValueError) as error:
        return Row(
            number=number,
            name=shorten(cells.get("name", ""), 60),
            request=given,
            problem=shorten(error, 300),
        )
    return (
        row
        if row.request.person.photo
        else dataclasses.replace(row, problem="no photo given; name one in the column photo")
    )


def _text(name: str, value: object) -> str:
    """Return a cell of CSV or YAML as text; a YAML list becomes text separated by commas."""
    if (
        isinstance(value, list)
        and len(value) <= 100
        and all(isinstance(item, str) for item in value)
    ):
        value = ",".join(value)
    if not isinstance(value, str | int | float):
        raise InputError(f"{name} is {shorten(value, 60)}; expected text or a number")
    text = value if isinstance(value, str) else str(value)
    if len(text) > MAX_CELL or "\0" in text:
        raise InputError(
            f"{name} is {shorten(text, 60)}; expected at most {MAX_CELL} characters, without "
            "null characters"
        )
    return text
