"""The queue of photos and videos, processed one at a time in order of arrival.

One child process finds people in photos, another makes videos. A third opens uploads, so that the
server process decodes no untrusted bytes. The records define the queue, so an interrupted queue
continues at the next start, and finished frames are cached.
"""

from __future__ import annotations

import asyncio
import contextlib
import shutil
import sys
import time
import traceback
from collections.abc import Awaitable, Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from a2v.digest import Digest
from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.perception import Corrections
from pipelines.engine.forget import Forgotten, forget
from pipelines.engine.refs import Ref
from pipelines.engine.store import Store
from pipelines.serve.arrivals import Arrivals
from pipelines.serve.child import Child
from pipelines.serve.owed import Owed
from pipelines.serve.records import Job, Library, Photo
from pipelines.serve.talk import CLIP, CORRECTIONS, ORIGINAL
from pipelines.serve.threads import Threads
from pipelines.serve.times import Times

IDLE_SECONDS = 900.0
"""Seconds without a task after which a child process is ended to free its memory."""
SETTLED_SECONDS = 120.0
"""Seconds after which a value of the store that no call refers to is removed."""
MAX_THREADS = 8
"""Number of threads in addition to the main thread."""
_TICK_SECONDS = 5.0
_OPENER = "from pipelines.serve.opener import main; main()"
_OWED = "forgetting"
"""File that exists while removals from the store are pending."""

T = TypeVar("T")
Leave = Callable[[Collection[str]], Awaitable[None]]


class Desk:
    """Processes photos and jobs, and keeps their records.

    Parameters
    ----------
    code : see `Child`
    cache : folder of the store, None for the default
    workers : number of processes that compute frames, None for one per core
    """

    def __init__(
        self, library: Library, code: str, *, cache: str | None = None, workers: int | None = None
    ) -> None:
        self.library = library
        self.progress: dict[str, Mapping[str, Any]] = {}
        self.threads = Threads(MAX_THREADS)
        self._cache, self._workers = cache, workers
        self._opener, self._looker, self._maker = Child(_OPENER), Child(code), Child(code)
        self.arrivals = Arrivals(library, self._opener, forget=self._forget_owed)
        self.leaving: list[Leave] = []
        """Called with the identities of removed photos and jobs; they stop what works on these."""
        self._more = (asyncio.Event(), asyncio.Event())
        self._current: Job | None = None
        self._looking: Photo | None = None
        self._served: list[Photo | Job] = []  # for which a request waits for an outline or a file
        self._forgetting = asyncio.Lock()
        self._owed = Owed(library.folder / _OWED)
        self._times = Times(library.folder)
        self._closing = False
        self._tasks: list[asyncio.Task[None]] = []

    def start(self) -> None:
        """Start processing, beginning with unfinished jobs of an earlier run."""
        for job in self.library.jobs.values():
            if job.status == "running":
                job.status = "waiting"
                self.library.keep(job)
        rounds = (self._look_at_a_photo, self._make_a_video, self._rest)
        self._tasks = [asyncio.create_task(self._for_ever(one)) for one in rounds]

    async def close(self) -> None:
        """Stop at once; a running job continues at the next start.

        Until Python 3.12 `asyncio.wait_for` loses a cancellation that arrives just as the awaited
        task finishes, so the cancellation is repeated.
        """
        self._closing = True
        while alive := [task for task in self._tasks if not task.done()]:
            for task in alive:
                task.cancel()
            await asyncio.wait(alive, timeout=1.0)
        await asyncio.gather(self._opener.stop(), self._looker.stop(), self._maker.stop())

    def wake(self) -> None:
        """Signal that the queue has changed."""
        for more in self._more:
            more.set()

    def correct(self, photo: Photo, corrections: Corrections) -> None:
        """Save the user's corrections and process the photo again with them.

        Raises
        ------
        InputError
            The photo was removed or is being processed, or the disk is full.
        """
        if photo.id not in self.library.photos:  # while the corrections arrived
            raise InputError("this photo was removed; choose another")
        if photo.status == "looking":
            raise InputError(
                "the person in this photo is still being detected; try again in a moment"
            )
        path = self.library.place(photo) / CORRECTIONS
        if corrections:
            with atomic_path(path) as temporary:
                temporary.write_text(corrections.to_yaml(), encoding="utf-8")
        else:
            path.unlink(missing_ok=True)
        photo.corrected, photo.known, photo.status, photo.problem = (
            bool(corrections),
            False,
            "looking",
            "",
        )
        self.library.keep(photo)
        self.wake()

    async def outline(self, photo: Photo, corrections: Corrections) -> dict[str, Any]:
        """Return the outline of the body fitted with these corrections, without saving them.

        See `pipelines.serve.fitting.outline`.


        Raises
        ------
        InputError
            The outline cannot be computed.
        """
        task = {
            "task": "outline",
            "folder": str(self.library.place(photo)),
            "cache": self._cache,
            "corrections": corrections.said(),
        }
        return await self._serve(photo, task)

    async def _serve(self, item: Photo | Job, task: Mapping[str, Any]) -> dict[str, Any]:
        """Run a task for a waiting request in the process that looks at photos."""
        self._served.append(item)
        try:
            answer = await self._looker.do(task)
        finally:
            self._served.remove(item)
        if "problem" in answer:
            raise InputError(answer["problem"])
        done: dict[str, Any] = answer["done"]
        return done

    async def export(self, job: Job, rig: str, suffix: str) -> None:
        """Write a finished job's character for another tool, among its files.

        Raises
        ------
        InputError
            The job is not finished, or the file cannot be written.
        """
        if job.status != "done":
            raise InputError("this video is not made yet")
        task = {"task": "export", **self.task_of(job), "rig": rig, "format": suffix}
        done = await self._serve(job, task)
        job.files = job.files | done["files"]
        self.library.keep(job)

    def task_of(self, job: Job) -> dict[str, Any]:
        """Return the entries of a task for a job: folder, store, wish, and the person's files."""
        photo = self.library.photos[job.photo]
        own = self.library.place(photo)
        more = [str(own / f"more-{number + 1}") for number in range(len(photo.more))]
        corrections = str(own / CORRECTIONS) if photo.corrected else None
        clip = str(own / f"{CLIP}{photo.clip}") if job.wish.clip and photo.clip else None
        return {
            "folder": str(self.library.place(job)), "photo": str(own / ORIGINAL),
            "corrections": corrections, "more": more, "clip": clip,
            "cache": self._cache, "wish": job.wish.said(),
        }  # fmt: skip

    async def warm(self) -> None:
        """Load the modules for a video while the user still chooses."""
        if self._current is None and not self._maker.alive:
            with contextlib.suppress(OSError):  # a later request for a video reports it
                await self._maker.tell({"task": "warm", "workers": self._workers})

    async def cancel(self, job: Job) -> None:
        """Remove a job from the queue, or stop it if it is running."""
        if job.over:
            raise InputError("this video is not in the queue any more")
        job.status = "cancelled"
        self.library.keep(job)
        while self._current is job:
            await self._maker.stop()
            await asyncio.sleep(0.01)

    def again(self, item: Photo | Job) -> None:
        """Queue again a failed or cancelled job, or a photo that could not be used."""
        if isinstance(item, Photo):
            if item.status != "unusable":
                raise InputError("this photo is in use already")
            item.status, item.problem = "looking", ""
        else:
            if item.status not in ("failed", "cancelled"):
                raise InputError("this video is finished or in progress")
            item.status, item.problem, item.created = "waiting", "", time.time()
        self.library.keep(item)
        self.wake()

    async def remove(self, item: Photo | Job) -> Forgotten:
        """Remove a photo with its jobs and stored values, or a job; stop running computations."""

        def jobs() -> list[Job]:
            return [item] if isinstance(item, Job) else list(self.library.jobs_of(item))

        while job := next(
            (one for one in jobs() if not one.over), None
        ):  # another may be requested while one is stopped
            await self.cancel(job)
        if isinstance(item, Photo):
            for digest in _digests(item):
                self._owed.add(digest)
        removed = jobs()
        folders = self.library.remove(item)
        waited = [item, *removed]
        for leave in self.leaving:
            await leave({one.id for one in waited})
        while (
            self._current in removed
            or self._looking is item
            or any(one in waited for one in self._served)
        ):
            await (self._maker if self._current in removed else self._looker).stop()
            await asyncio.sleep(0.01)
        if isinstance(item, Photo) and self._looking is None and not self._served:
            await self._looker.stop()  # it may hold data of the photo in memory
        await self.threads.do(_delete, [*folders, *map(self.library.place, [item, *removed])])
        return await self._forget(_digests(item)) if isinstance(item, Photo) else Forgotten()

    async def remove_damaged(self) -> None:
        """Remove the photos and videos whose records cannot be read."""
        await self.threads.do(_delete, self.library.remove_damaged())

    async def _forget_owed(self, digests: Iterable[str]) -> Forgotten:
        """Remove stored values of files, now or after the next start."""
        owed = [digest for digest in digests if digest]
        for digest in owed:
            self._owed.add(digest)
        return await self._forget(owed)

    async def _forget(self, digests: Iterable[str]) -> Forgotten:
        """Remove stored values of photos that no other record uses, and unreferenced values."""
        async with self._forgetting:
            stays = {digest for one in self.library.photos.values() for digest in _digests(one)}
            gone, keep = (
                [Ref[Any](Digest(digest)) for digest in some if digest]
                for some in (set(digests) - stays, stays)
            )
            return await self.threads.do(
                forget, Store(self._cache), gone, keep=list(keep), idle=SETTLED_SECONDS
            )

    # --- the rounds

    async def _next(self, more: asyncio.Event, find: Callable[[], T | None]) -> T:
        while True:
            more.clear()
            if (found := find()) is not None:
                return found
            await more.wait()

    async def _look_at_a_photo(self) -> None:
        photo: Photo = await self._next(
            self._more[0],
            lambda: next(
                (one for one in self.library.photos.values() if one.status == "looking"), None
            ),
        )
        self._looking = photo
        size = {"width": photo.width, "height": photo.height}
        task = {
            "task": "look",
            "folder": str(self.library.place(photo)),
            "cache": self._cache,
            **size,
        }
        try:
            answer = await self._looker.do(task)
        finally:
            self._looking = None
        if photo.id not in self.library.photos:  # removed in the meantime
            return
        if "problem" in answer:
            photo.status, photo.problem = "unusable", answer["problem"]
        else:
            photo.status, photo.looks = "ready", photo.looks + 1
            for name, value in answer["done"].items():
                setattr(photo, name, value)
        self.library.keep(photo)
        self.wake()

    def _waiting(self) -> Job | None:
        waiting = [job for job in self.library.jobs.values() if job.status == "waiting"]
        for job in sorted(waiting, key=lambda one: one.created):
            photo = self.library.photos[job.photo]
            if photo.status == "unusable":
                job.status, job.problem = "failed", photo.problem
                self.library.keep(job)
            elif photo.status == "ready":
                return job
        return None

    async def _make_a_video(self) -> None:
        job: Job = await self._next(self._more[1], self._waiting)
        photo, begun = self.library.photos[job.photo], time.monotonic()
        self._current, job.status = job, "running"
        self.library.keep(job)
        task = {
            "task": "video",
            **self.task_of(job),
            "known": photo.known,
            "times": self._times.read(),
            "workers": self._workers,
        }
        try:
            answer = await self._maker.do(
                task, lambda update: self.progress.__setitem__(job.id, update)
            )
            if "problem" in answer:
                await self._maker.stop()  # its workers may still be running
        finally:
            self._current = None
            self.progress.pop(job.id, None)
        job.seconds = round(time.monotonic() - begun, 1)
        if job.status == "cancelled" or job.id not in self.library.jobs:
            return
        if "problem" in answer:
            job.status, job.problem = "failed", answer["problem"]
        else:
            done = answer["done"]
            job.status, job.files, job.notes = "done", done["files"], done["notes"]
            photo.known = True
            self.library.keep(photo)
            self._times.learn(done["times"])
        self.library.keep(job)

    async def _rest(self) -> None:
        await asyncio.sleep(_TICK_SECONDS)
        self.library.settle()
        if self._maker.idle(IDLE_SECONDS) and self._current is None:
            await self._maker.stop()
        for child in (self._looker, self._opener):
            if child.idle(IDLE_SECONDS / 10):
                await child.stop()
        if (owed := self._owed.due(SETTLED_SECONDS + _TICK_SECONDS)) is not None:
            await self._forget(owed)
            self._owed.paid(owed)

    async def _for_ever(self, one: Callable[[], Awaitable[None]]) -> None:
        """Repeat a round; the error of a failed round is printed, and the next round starts."""
        while not self._closing:
            try:
                await one()
            except Exception:
                traceback.print_exc(file=sys.stderr)
                await asyncio.sleep(1.0)


def _digests(photo: Photo) -> list[str]:
    """Return the digests of a person's files in the store."""
    return [digest for digest in (photo.digest, *photo.more, photo.clip_digest) if digest]


def _delete(folders: Iterable[Path]) -> None:
    for folder in folders:
        shutil.rmtree(folder, ignore_errors=True)
