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
from pipelines.serve.cast import Cast
from pipelines.serve.child import Child
from pipelines.serve.library import Library
from pipelines.serve.owed import Owed
from pipelines.serve.records import Job, Photo
from pipelines.serve.talk import CORRECTIONS
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
        self._opener, self._maker = Child(_OPENER), Child(code)
        self.cast = Cast(library, code, cache)
        self.arrivals = Arrivals(library, self._opener, forget=self._forget_owed)
        self.leaving: list[Leave] = []
        """Called with the identities of removed photos and jobs; they stop what works on these."""
        self._more = (asyncio.Event(), asyncio.Event(), asyncio.Event())
        self._current: Job | None = None
        self._looking: Photo | None = None
        self._waking: Photo | None = None
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
        rounds = (self._look_at_a_photo, self._wake_a_person, self._make_a_video, self._rest)
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
        await asyncio.gather(*(child.stop() for child in self._children))

    @property
    def _children(self) -> tuple[Child, ...]:
        return (self._opener, self.cast.looker, self._maker, self.cast.builder, self.cast.player)

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

    def task_of(self, job: Job) -> dict[str, Any]:
        """Return the entries of a task for a job: folder, store, wish, and the person's files."""
        photo = self.library.photos[job.photo]
        return {
            "folder": str(self.library.place(job)),
            **self.cast.files_of(photo, job.wish),
            "wish": job.wish.said(),
        }

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
            for digest in item.digests:
                self._owed.add(digest)
        removed = jobs()
        folders = self.library.remove(item)
        waited = [item, *removed]
        for leave in self.leaving:
            await leave({one.id for one in waited})
        while busy := self._working_on(waited):
            for child in busy:
                await child.stop()
            await asyncio.sleep(0.01)
        if isinstance(item, Photo):
            serving = {self._looking and self.cast.looker, self._waking and self.cast.builder}
            serving |= {child for _, child in self.cast.served}
            for child in (self.cast.looker, self.cast.builder, self.cast.player):
                if child not in serving:  # it may hold data of the photo in memory
                    await child.stop()
        await self.threads.do(_delete, [*folders, *map(self.library.place, [item, *removed])])
        return await self._forget(item.digests) if isinstance(item, Photo) else Forgotten()

    def _working_on(self, items: Collection[Photo | Job]) -> set[Child]:
        """Return the processes that compute something for these photos and jobs."""
        found = self.cast.working_on(items)
        for one, child in (
            (self._current, self._maker),
            (self._looking, self.cast.looker),
            (self._waking, self.cast.builder),
        ):
            if one is not None and one in items:
                found.add(child)
        return found

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
            stays = {digest for one in self.library.photos.values() for digest in one.digests}
            stays |= {one.digest for one in self.library.motions.values()}
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
        if self._waking is photo:  # it is corrected: what is being made is out of date
            await self.cast.builder.stop()
        size = {"width": photo.width, "height": photo.height}
        task = {
            "task": "look",
            "folder": str(self.library.place(photo)),
            "cache": self._cache,
            **size,
        }
        try:
            answer = await self.cast.looker.do(task)
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

    async def _wake_a_person(self) -> None:
        photo: Photo = await self._next(
            self._more[2],
            lambda: next(
                (
                    one
                    for one in self.library.photos.values()
                    if one.status == "ready" and not one.known
                ),
                None,
            ),
        )
        self._waking, looks, more = photo, photo.looks, photo.more
        task = {
            "task": "person",
            "folder": str(self.library.place(photo)),
            **self.cast.files_of(photo, None),
            "times": self._times.read(),
        }
        try:
            answer = await self.cast.builder.do(
                task, lambda update: self.progress.__setitem__(photo.id, update)
            )
        finally:
            self._waking = None
            self.progress.pop(photo.id, None)
        changed = (photo.status, photo.looks, photo.more) != ("ready", looks, more)
        if photo.id not in self.library.photos or changed:  # it is looked at or made again
            return
        if "problem" in answer:
            photo.status, photo.problem = "unusable", answer["problem"]
        else:
            photo.known, photo.notes = True, answer["done"].get("notes", [])
            self._times.learn(answer["done"].get("times", {}))
        self.library.keep(photo)
        self.wake()

    def _waiting(self) -> Job | None:
        waiting = [job for job in self.library.jobs.values() if job.status == "waiting"]
        for job in sorted(waiting, key=lambda one: one.created):
            photo = self.library.photos[job.photo]
            if photo.status == "unusable":
                job.status, job.problem = "failed", photo.problem
                self.library.keep(job)
            elif job.wish.motion and job.wish.motion not in self.library.motions:
                job.status, job.problem = "failed", "its motion was removed; add the file again"
                self.library.keep(job)
            elif photo.status == "ready" and photo.known:
                return job
        return None

    async def _make_a_video(self) -> None:
        job: Job = await self._next(self._more[1], self._waiting)
        begun = time.monotonic()
        self._current, job.status = job, "running"
        self.library.keep(job)
        task = {
            "task": "video",
            **self.task_of(job),
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
            self._times.learn(done["times"])
        self.library.keep(job)

    async def _rest(self) -> None:
        await asyncio.sleep(_TICK_SECONDS)
        self.library.settle()
        if self._maker.idle(IDLE_SECONDS) and self._current is None:
            await self._maker.stop()
        if self.cast.player.idle(4 * IDLE_SECONDS):
            await self.cast.player.stop()
        for child in (self.cast.looker, self._opener, self.cast.builder):
            if child.idle(IDLE_SECONDS / (4 if child is self.cast.builder else 10)):
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


def _delete(folders: Iterable[Path]) -> None:
    for folder in folders:
        shutil.rmtree(folder, ignore_errors=True)
