"""What the page remembers: a folder a photo and a folder a job, each with its record as JSON, written when something has changed.

All names in the folder are ours: identities are 16 hex digits, and what a browser says is only ever looked up, never joined to a path.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import secrets
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from a2v.errors import A2VError, InputError
from a2v.io import atomic_path, clear_leftovers, read_bytes
from pipelines.serve.wishes import Wish

MAX_PHOTOS, MAX_WAITING, MAX_JOBS = 200, 50, 1000
"""Photos that are kept, jobs that may wait, and jobs that are kept."""
MAX_TITLE = 80
ORIGINAL, SHOWN, MASK = "original", "photo.jpg", "mask.png"
"""A photo's files: as it came, and what the page shows."""
_MAX_RECORD_BYTES = 1 << 20

Kept = TypeVar("Kept", "Photo", "Job")


@dataclass
class Photo:
    """A photo that was taken in.

    Attributes
    ----------
    status : "looking", "ready" or "unusable"
    width, height : of ``photo.jpg``, pixels
    landmarks : u, v in pixels of ``photo.jpg`` and confidence, in BlazePose order
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
    known: bool = False  # whether its character was made here before

    FOLDER, FILE = "photos", "photo.json"


@dataclass
class Job:
    """A video that was asked for.

    Attributes
    ----------
    status : "waiting", "running", "done", "failed" or "cancelled"
    files : names and bytes of what may be downloaded
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

    @property
    def over(self) -> bool:
        """Whether nothing is left to do."""
        return self.status in ("done", "failed", "cancelled")


class Library:
    """The photos and jobs of a folder, in memory and on disk. One process writes them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.photos: dict[str, Photo] = {item.id: item for item in self._read(Photo)}
        self.jobs: dict[str, Job] = {item.id: item for item in self._read(Job) if item.photo in self.photos}
        self.version = 0

    def _read(self, kind: type[Kept]) -> list[Kept]:
        found = []
        for folder in (self.folder / kind.FOLDER).glob("*"):
            with contextlib.suppress(A2VError, ValueError, TypeError, KeyError, RecursionError, OSError):
                facts = json.loads(read_bytes(folder / kind.FILE, limit=_MAX_RECORD_BYTES))
                if facts["id"] != folder.name:
                    continue
                if kind is Job:
                    facts["wish"] = Wish.of(facts["wish"])
                found.append(kind(**facts))
                clear_leftovers(folder)
        return sorted(found, key=lambda item: item.created)

    def place(self, item: Photo | Job) -> Path:
        """Its folder."""
        return self.folder / item.FOLDER / item.id

    def keep(self, item: Photo | Job) -> None:
        """Write the record, and let browsers know."""
        with atomic_path(self.place(item) / item.FILE) as temporary:
            temporary.write_text(json.dumps(dataclasses.asdict(item), indent=1) + "\n", encoding="utf-8")
        self.version += 1

    def add_photo(self, data: bytes, title: str) -> Photo:
        """Keep the bytes of a photo that was decoded before.

        Raises
        ------
        InputError
            There are too many.
        """
        if len(self.photos) >= MAX_PHOTOS:
            raise InputError(f"{MAX_PHOTOS} photos are kept here already; remove some first")
        photo = Photo(id=secrets.token_hex(8), title=title[:MAX_TITLE] or "photo", created=time.time())
        with atomic_path(self.place(photo) / ORIGINAL) as temporary:
            temporary.write_bytes(data)
        self.keep(photo)
        self.photos[photo.id] = photo
        return photo

    def add_job(self, photo: Photo, wish: Wish) -> Job:
        """Queue a video.

        Raises
        ------
        InputError
            The photo cannot be used, or the queue is full.
        """
        if photo.status == "unusable":
            raise InputError(f"this photo cannot be used: {photo.problem}")
        if sum(not job.over for job in self.jobs.values()) >= MAX_WAITING:
            raise InputError(f"{MAX_WAITING} videos are waiting already; try again when some are done")
        if len(self.jobs) >= MAX_JOBS:
            raise InputError(f"{MAX_JOBS} videos are kept here already; remove some first")
        job = Job(id=secrets.token_hex(8), photo=photo.id, wish=wish, created=time.time())
        self.keep(job)
        self.jobs[job.id] = job
        return job

    def jobs_of(self, photo: Photo) -> Iterator[Job]:
        """The jobs of a photo."""
        return (job for job in list(self.jobs.values()) if job.photo == photo.id)

    def remove(self, item: Photo | Job) -> None:
        """Remove it and its files; a photo's jobs with it."""
        if isinstance(item, Photo):
            for job in self.jobs_of(item):
                self.remove(job)
        (self.photos if isinstance(item, Photo) else self.jobs).pop(item.id, None)
        shutil.rmtree(self.place(item), ignore_errors=True)
        self.version += 1
