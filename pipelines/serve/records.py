"""The JSON records of the page: photos, films and motions, with a check of every field."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from a2v.errors import InputError
from a2v.io import atomic_path, parse_json, read_bytes
from pipelines.serve.edge import clean
from pipelines.serve.wishes import Wish

MAX_TITLE = 80
MAX_ROW = 4
"""Largest length of a row of numbers in a record."""
SHOWN = "photo.jpg"
"""File name of the photo that the page shows."""
MOTION = "motion.npz"
"""File name of a motion."""
MASK = "mask.png"
"""File name of the overlay that darkens the photo outside the person."""
PERSON = "person.glb"
"""File name of the person that the stage shows, with an idle motion."""
_MAX_RECORD_BYTES = 1 << 20
_ID = re.compile("[0-9a-f]{16}")

Kept = TypeVar("Kept", bound="Record")


class Record:
    """What a folder below `FOLDER` holds; `FILE` describes it, `STATES` are its states."""

    id: str
    status: str
    created: float
    FOLDER: ClassVar[str]
    FILE: ClassVar[str]
    STATES: ClassVar[tuple[str, ...]]


@dataclass
class Photo(Record):
    """An uploaded photo.

    Attributes
    ----------
    status : "looking", "ready" or "unusable"
    width, height : of ``photo.jpg``, pixels
    landmarks : u, v in pixels of ``photo.jpg`` and confidence, in BlazePose order
    digest : of the value that the store has of it
    people : left, top, right, bottom of all who were found, the largest first, fractions of the
    photo; empty if there is only one
    corrected : whether the user has corrected the detection
    looks : number of detections, by which a browser recognizes an outdated outline
    more : digests of further photos of the same person, ``more-1`` and so on in its folder
    notes : about the person that was made
    files : names and sizes in bytes of exported files and recordings
    clip : suffix of the video whose motion the person can take over, ``clip`` with it in its folder
    clip_title, clip_seconds, clip_digest : its name, its length and its digest in the store
    """

    id: str
    title: str
    created: float
    status: str = "looking"
    problem: str = ""
    warnings: list[str] = field(default_factory=list)
    width: int = 0
    height: int = 0
    landmarks: list[list[float]] = field(default_factory=list)
    known: bool = False  # whether its person is made
    notes: list[str] = field(default_factory=list)
    files: dict[str, int] = field(default_factory=dict)
    digest: str = ""
    people: list[list[float]] = field(default_factory=list)
    corrected: bool = False
    looks: int = 0
    more: list[str] = field(default_factory=list)
    clip: str = ""
    clip_title: str = ""
    clip_seconds: float = 0.0
    clip_digest: str = ""

    FOLDER, FILE = "photos", "photo.json"
    STATES = ("looking", "ready", "unusable")

    @property
    def digests(self) -> list[str]:
        """Digests of the person's files in the store."""
        return [digest for digest in (self.digest, *self.more, self.clip_digest) if digest]


@dataclass
class Job(Record):
    """A requested video.

    Attributes
    ----------
    status : "waiting", "running", "done", "failed" or "cancelled"
    files : names and sizes in bytes of the files for download
    views : names of the single views' videos, without suffix
    """

    id: str
    photo: str
    wish: Wish
    created: float
    status: str = "waiting"
    problem: str = ""
    seconds: float = 0.0
    notes: list[str] = field(default_factory=list)
    files: dict[str, int] = field(default_factory=dict)

    FOLDER, FILE = "jobs", "job.json"
    STATES = ("waiting", "running", "done", "failed", "cancelled")

    @property
    def over(self) -> bool:
        """Whether the job has ended."""
        return self.status in ("done", "failed", "cancelled")


@dataclass
class KeptMotion(Record):
    """A motion from a file, which every person can do: ``motion.npz`` in its folder.

    Attributes
    ----------
    seconds : its length
    notes : what was chosen or assumed when the file was read
    digest : of ``motion.npz`` in the store
    """

    id: str
    title: str
    created: float
    seconds: float
    digest: str
    notes: list[str] = field(default_factory=list)
    status: str = "ready"

    FOLDER, FILE = "motions", "motion.json"
    STATES = ("ready",)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _texts(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def _rows(value: object) -> bool:
    return isinstance(value, list) and all(
        isinstance(row, list) and len(row) <= MAX_ROW and all(map(_number, row)) for row in value
    )


def _sizes(value: object) -> bool:
    return isinstance(value, dict) and all(isinstance(size, int) for size in value.values())


_CHECKS: Mapping[str, Any] = {
    "str": lambda value: isinstance(value, str),
    "float": _number,
    "bool": lambda value: isinstance(value, bool),
    "int": lambda value: (
        isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 31
    ),
    "list[str]": _texts,
    "list[list[float]]": _rows,
    "dict[str, int]": _sizes,
    "Wish": lambda value: isinstance(value, Wish),
}
"""Check of a value against the type annotation of a record's field, by annotation."""


def write_record(item: Record, folder: Path) -> None:
    """Write a record into `folder`, atomically.

    Raises
    ------
    InputError
        The disk is full, or the folder cannot be written.
    """
    with atomic_path(folder / item.FILE) as temporary:
        facts = dataclasses.asdict(item)  # type: ignore[call-overload]  # every kind is a dataclass
        temporary.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


def read_record(kind: type[Kept], folder: Path) -> Kept:
    """Read the record in a folder and check every field.

    A record in memory can therefore always be sent to the page.


    Raises
    ------
    InputError
        The file is not a valid record of this kind.
    """
    facts = clean(
        parse_json(
            read_bytes(folder / kind.FILE, limit=_MAX_RECORD_BYTES), "the record", "an object"
        )
    )
    try:
        if kind is Job:
            facts["wish"] = Wish.of(facts["wish"])
        item = kind(**facts)
    except (TypeError, KeyError, AttributeError, RecursionError) as error:
        raise InputError(
            f"{folder.name} has no record that can be read ({type(error).__name__})"
        ) from error
    for entry in dataclasses.fields(item):  # type: ignore[arg-type]  # every kind is a dataclass
        if not _CHECKS[str(entry.type)](getattr(item, entry.name)):
            raise InputError(f"the record of {folder.name} has no usable {entry.name}")
    if item.id != folder.name or not _ID.fullmatch(item.id) or item.status not in kind.STATES:
        raise InputError(f"the record of {folder.name} belongs to another photo or video")
    if isinstance(item, Photo) and any(len(point) != 3 for point in item.landmarks):
        raise InputError(f"the record of {folder.name} has no usable landmarks")
    return item
