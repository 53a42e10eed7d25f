"""The folder of the page: one folder per photo, job and motion, each with a JSON record.

A record is written after each change. The server chooses all names in the folder: identities are 16
hex digits, and text from a browser is only looked up, never joined to a path. A file arrives in
``incoming/`` and is then moved to its place. A removed folder is first moved to ``removed/``, so
that it is no longer listed; after that no process can write below it (`a2v.io.make_folder`). Both
are emptied at the next start. Records that cannot be read are counted, and stay until the user
removes them.
"""

from __future__ import annotations

import contextlib
import secrets
import shutil
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from a2v.errors import A2VError, InputError
from a2v.folders import owner_mark
from a2v.io import clear_leftovers
from pipelines.serve.records import (
    MAX_TITLE,
    MOTION,
    PERSON,
    Job,
    Kept,
    KeptMotion,
    Photo,
    Record,
    read_record,
    write_record,
)
from pipelines.serve.wishes import Wish

MAX_PHOTOS = 200
"""Largest number of photos that are kept."""
MAX_WAITING = 50
"""Largest number of jobs that wait or run."""
MAX_JOBS = 1000
"""Largest number of jobs that are kept."""


class Library:
    """The photos, jobs and motions of a folder, in memory and on disk, written by one process.

    Attributes
    ----------
    damaged : list of Path
        Folders of photos, jobs and motions whose record cannot be read.
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
        self.motions: dict[str, KeptMotion] = {item.id: item for item in self._read(KeptMotion)}
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

    def place(self, item: Record) -> Path:
        """Return the folder of a photo, job or motion."""
        return self.folder / item.FOLDER / item.id

    def keep(self, item: Photo | Job) -> None:
        """Write the record now, or on a full disk when `settle` is called and there is space."""
        if item.id in (self.photos if isinstance(item, Photo) else self.jobs):
            self._unwritten[item.id] = item
            self.settle()

    def settle(self) -> None:
        """Write the records that could not be written earlier."""
        for item in list(self._unwritten.values()):
            try:
                write_record(item, self.place(item))
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
        self.take_in(photo, folder)
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
            write_record(job, self.place(job))
        except InputError:
            shutil.rmtree(self.place(job), ignore_errors=True)
            raise
        self.jobs[job.id] = job
        return job

    def motion_file(self, wish: Wish) -> Path:
        """Return the file of the motion that a wish names.

        Raises
        ------
        InputError
            The motion was removed.
        """
        if (motion := self.motions.get(wish.motion)) is None:
            raise InputError("this motion was removed; add its file again")
        return self.place(motion) / MOTION

    def take_in(self, item: Record, folder: Path) -> None:
        """Write the record of what arrived in `folder`, and move it to its place.

        Raises
        ------
        InputError
            The disk is full.
        """
        write_record(item, folder)
        try:
            self._make(item.FOLDER)
            folder.rename(self.place(item))
        except OSError as error:
            raise InputError(
                f"this cannot be kept: {error.strerror}; free some space and send it again"
            ) from error

    def jobs_of(self, photo: Photo) -> Iterator[Job]:
        """Iterate over the jobs of a photo."""
        return (job for job in list(self.jobs.values()) if job.photo == photo.id)

    def remove(self, item: Record) -> list[Path]:
        """Remove a photo with its jobs, a job, or a motion; return the folders to delete."""
        left = (
            [path for job in self.jobs_of(item) for path in self.remove(job)]
            if isinstance(item, Photo)
            else []
        )
        self._unwritten.pop(item.id, None)
        for room in (self.photos, self.jobs, self.motions):
            room.pop(item.id, None)
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
