"""Records of the page: one folder per photo and one per job, each with a JSON record.

A record is written after each change. The server chooses all names in the folder: identities are 16
hex digits, and text from a browser is only looked up, never joined to a path. A photo arrives in
``incoming/`` and is then moved to its place. A removed folder is first moved to ``removed/``, so
that it is no longer listed; after that no process can write below it (`a2v.io.make_folder`). Both
are emptied at the next start. Records that cannot be read are
counted, and stay until the user removes them.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import re
import secrets
import shutil
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from a2v.errors import A2VError, InputError
from a2v.folders import owner_mark
from a2v.io import atomic_path, clear_leftovers, parse_json, read_bytes
from pipelines.serve.edge import clean
from pipelines.serve.wishes import Wish

MAX_PHOTOS = 200
"""Largest number of photos that are kept."""
MAX_WAITING = 50
"""Largest number of jobs that wait or run."""
MAX_JOBS = 1000
"""Largest number of jobs that are kept."""
MAX_TITLE = 80
MAX_ROW = 4
"""Largest length of a row of numbers in a record."""
SHOWN = "photo.jpg"
"""File name of the photo that the page shows."""
MASK = "mask.png"
"""File name of the overlay that darkens the photo outside the person."""
PERSON = "person.glb"
"""File name of the person that the stage shows, with an idle motion."""
_MAX_RECORD_BYTES = 1 << 20
_ID = re.compile("[0-9a-f]{16}")

Kept = TypeVar("Kept", "Photo", "Job")


@dataclass
class Photo:
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


@dataclass
class Job:
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
    for entry in dataclasses.fields(item):
        if not _CHECKS[str(entry.type)](getattr(item, entry.name)):
            raise InputError(f"the record of {folder.name} has no usable {entry.name}")
    if item.id != folder.name or not _ID.fullmatch(item.id) or item.status not in kind.STATES:
        raise InputError(f"the record of {folder.name} belongs to another photo or video")
    if isinstance(item, Photo) and any(len(point) != 3 for point in item.landmarks):
        raise InputError(f"the record of {folder.name} has no usable landmarks")
    return item


class Library:
    """The photos and jobs of a folder, in memory and on disk, written by one process.

    Attributes
    ----------
    damaged : list of Path
        Folders of photos and jobs whose record cannot be read.
    problem : str
        Reason why the last record could not be written; empty once all are written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.damaged: list[Path] = []
        self.problem = ""
        for room in ("photos", "jobs"):
            with contextlib.suppress(OSError):  # of an older version
                owner_mark(folder / room).touch()
        self._unwritten: dict[str, Photo | Job] = {}
        for rest in ("incoming", "removed"):
            shutil.rmtree(folder / rest, ignore_errors=True)
        self.photos: dict[str, Photo] = {item.id: item for item in self._read(Photo)}
        for photo in self.photos.values():
            photo.known = photo.known and (self.place(photo) / PERSON).is_file()
        self.jobs: dict[str, Job] = {item.id: item for item in self._read(Job)}
        for job in [job for job in self.jobs.values() if job.photo not in self.photos]:
            self.damaged.append(self.place(self.jobs.pop(job.id)))

    def _read(self, kind: type[Kept]) -> list[Kept]:
        found = []
        for folder in (one for one in (self.folder / kind.FOLDER).glob("*") if one.is_dir()):
            try:
                found.append(read_record(kind, folder))
                clear_leftovers(folder)
            except (A2VError, OSError):
                self.damaged.append(folder)
        return sorted(found, key=lambda item: item.created)

    def place(self, item: Photo | Job) -> Path:
        """Return the folder of a photo or job."""
        return self.folder / item.FOLDER / item.id

    def write(self, item: Photo | Job, folder: Path | None = None) -> None:
        """Write the record of a photo or job, into `folder` if given, else into its own folder.

        Raises
        ------
        InputError
            The disk is full, or the folder cannot be written.
        """
        with atomic_path((folder or self.place(item)) / item.FILE) as temporary:
            temporary.write_text(
                json.dumps(dataclasses.asdict(item), indent=1) + "\n", encoding="utf-8"
            )

    def keep(self, item: Photo | Job) -> None:
        """Write the record now, or on a full disk when `settle` is called and there is space."""
        if item.id in (self.photos if isinstance(item, Photo) else self.jobs):
            self._unwritten[item.id] = item
            self.settle()

    def settle(self) -> None:
        """Write the records that could not be written earlier."""
        for item in list(self._unwritten.values()):
            try:
                self.write(item)
            except (InputError, OSError) as error:
                self.problem = f"changes cannot be saved: {error}"
                return
            del self._unwritten[item.id]
        self.problem = ""

    def arriving(self) -> Path:
        """Make a folder for an upload; its name becomes the identity of the photo.

        Raises
        ------
        InputError
            There are too many photos, or the folder cannot be made.
        """
        if len(self.photos) >= MAX_PHOTOS:
            raise InputError(f"{MAX_PHOTOS} photos are kept here already; remove some first")
        return self._make("incoming", secrets.token_hex(8))

    def add_photo(self, folder: Path, title: str, facts: Mapping[str, Any]) -> Photo:
        """Move an uploaded photo from `folder` to its place.

        Parameters
        ----------
        facts : "width", "height" and "digest" of `Photo`

        Raises
        ------
        InputError
            There are too many photos, or the disk is full.
        """
        if len(self.photos) >= MAX_PHOTOS:
            raise InputError(f"{MAX_PHOTOS} photos are kept here already; remove some first")
        photo = Photo(
            id=folder.name, title=title[:MAX_TITLE] or "photo", created=time.time(), **facts
        )
        self.write(photo, folder)
        try:
            self._make(photo.FOLDER)
            folder.rename(self.place(photo))
        except OSError as error:
            raise InputError(
                f"the photo cannot be kept: {error.strerror}; free some space and send it again"
            ) from error
        self.photos[photo.id] = photo
        return photo

    def add_job(self, photo: Photo, wish: Wish) -> Job:
        """Queue a video.

        Raises
        ------
        InputError
            The photo cannot be used, or the queue or the disk is full.
        """
        if photo.id not in self.photos:
            raise InputError("this photo was removed; choose another")
        if photo.status == "unusable":
            raise InputError(f"this photo cannot be used: {photo.problem}")
        if sum(not job.over for job in self.jobs.values()) >= MAX_WAITING:
            raise InputError(
                f"{MAX_WAITING} videos are waiting already; try again when some are done"
            )
        if len(self.jobs) >= MAX_JOBS:
            raise InputError(f"{MAX_JOBS} videos are kept here already; remove some first")
        job = Job(id=secrets.token_hex(8), photo=photo.id, wish=wish, created=time.time())
        try:
            self._make(job.FOLDER, job.id)
            self.write(job)
        except InputError:
            shutil.rmtree(self.place(job), ignore_errors=True)
            raise
        self.jobs[job.id] = job
        return job

    def jobs_of(self, photo: Photo) -> Iterator[Job]:
        """Iterate over the jobs of a photo."""
        return (job for job in list(self.jobs.values()) if job.photo == photo.id)

    def remove(self, item: Photo | Job) -> list[Path]:
        """Remove a photo with its jobs, or a job, from the lists; return the folders to delete."""
        left = (
            [path for job in self.jobs_of(item) for path in self.remove(job)]
            if isinstance(item, Photo)
            else []
        )
        self._unwritten.pop(item.id, None)
        (self.photos if isinstance(item, Photo) else self.jobs).pop(item.id, None)
        return [*left, self._move_to_removed(self.place(item))]

    def _make(self, room: str, name: str = "") -> Path:
        """Make a room and mark it as ours, or make the folder `name` inside it.

        Raises
        ------
        InputError
            It cannot be made.
        """
        folder = self.folder / room / name
        try:
            (self.folder / room).mkdir(parents=True, exist_ok=True)
            owner_mark(self.folder / room).touch()
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(
                f"this cannot be kept: {error.strerror}; free some space and send it again"
            ) from error
        return folder

    def remove_damaged(self) -> list[Path]:
        """Remove all records that cannot be read; return the folders to delete."""
        damaged, self.damaged = self.damaged, []
        return [self._move_to_removed(folder) for folder in damaged]

    def _move_to_removed(self, folder: Path) -> Path:
        """Move a folder to ``removed/`` and return its path; on failure return the old path."""
        target = self.folder / "removed" / secrets.token_hex(8)
        with contextlib.suppress(OSError):
            target.parent.mkdir(parents=True, exist_ok=True)
            folder.rename(target)
            return target
        return folder
