"""The queue: photos are looked at in one child process, videos are made in another, one at a time, in the order in which they came.

What waits is what the records say, so a queue that was cut off goes on at the next start; frames that were finished are remembered.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import time
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from a2v.errors import InputError
from a2v.io import atomic_path, read_bytes
from a2v.processes import python_command
from pipelines.serve.records import ORIGINAL, Job, Library, Photo

IDLE_SECONDS = 900.0
"""A child process that had nothing to do for so long is ended, for its memory."""
GRACE_SECONDS = 5.0
_LINE_BYTES = 4 << 20
_LOST = "the process that computed this has ended, most likely because the memory was used up; what was finished is remembered: try again"
_TIMES = "times.json"

T = TypeVar("T")
Take = Callable[[Mapping[str, Any]], None]


class Child:
    """A child process that is started when it is needed and may be stopped at any moment.

    Parameters
    ----------
    code : Python that runs `pipelines.serve.worker.main`
    """

    def __init__(self, code: str) -> None:
        self._code = code
        self._process: asyncio.subprocess.Process | None = None
        self._used = time.monotonic()

    async def tell(self, task: Mapping[str, Any]) -> asyncio.subprocess.Process:
        """Hand over a task; starts the process."""
        if self._process is None or self._process.returncode is not None:
            self._process = await asyncio.create_subprocess_exec(
                *python_command(self._code),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                start_new_session=True,
                limit=_LINE_BYTES,
            )
        assert self._process.stdin is not None
        self._used = time.monotonic()
        with contextlib.suppress(ConnectionError):  # it has just ended; whoever waits for an answer will see
            self._process.stdin.write(json.dumps(task).encode() + b"\n")
            await self._process.stdin.drain()
        return self._process

    async def do(self, task: Mapping[str, Any], progress: Take) -> dict[str, Any]:
        """Hand over a task and wait for its end; "done" or "problem"."""
        process = await self.tell(task)
        assert process.stdout is not None
        while line := await process.stdout.readline():
            message: dict[str, Any] = json.loads(line)
            if "progress" in message:
                progress(message["progress"])
                continue
            self._used = time.monotonic()
            return message
        return {"problem": _LOST}

    def idle(self, seconds: float) -> bool:
        """Whether it has lived for so long without a task."""
        return self._process is not None and self._process.returncode is None and time.monotonic() - self._used > seconds

    async def stop(self) -> None:
        """End the process and those that it has started."""
        process, self._process = self._process, None
        if process is None:
            return
        for number in (signal.SIGTERM, signal.SIGKILL):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, number)
            with contextlib.suppress(TimeoutError, asyncio.TimeoutError):
                await asyncio.wait_for(process.wait(), GRACE_SECONDS)


class Desk:
    """Takes photos and jobs, has them done and keeps their records.

    Parameters
    ----------
    code : see `Child`
    cache : folder of the store, None for the default
    workers : processes that compute frames, None for one a core
    """

    def __init__(self, library: Library, code: str, *, cache: str | None = None, workers: int | None = None) -> None:
        self.library = library
        self.progress: dict[str, Mapping[str, Any]] = {}
        self._cache, self._workers = cache, workers
        self._looker, self._maker = Child(code), Child(code)
        self._more = (asyncio.Event(), asyncio.Event())
        self._current: Job | None = None
        self._tasks: list[asyncio.Task[None]] = []

    def start(self) -> None:
        """Begin to work, with what an earlier run has left."""
        for job in self.library.jobs.values():
            if job.status == "running":
                job.status = "waiting"
                self.library.keep(job)
        loops = (self._look_at_photos(), self._make_videos(), self._rest())
        self._tasks = [asyncio.create_task(loop) for loop in loops]

    async def close(self) -> None:
        """Stop at once; what was running goes on at the next start."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await asyncio.gather(self._looker.stop(), self._maker.stop())

    def wake(self) -> None:
        """Say that there is something new to do."""
        for more in self._more:
            more.set()

    async def warm(self) -> None:
        """Load what a video will need, while somebody still chooses."""
        if self._current is None:
            await self._maker.tell({"task": "warm", "workers": self._workers})

    async def cancel(self, job: Job) -> None:
        """Take a job from the queue, or stop it in the middle."""
        if job.over:
            raise InputError("this video is not in the queue any more")
        job.status = "cancelled"
        self.library.keep(job)
        if self._current is job:
            await self._maker.stop()
            while self._current is job:
                await asyncio.sleep(0.01)

    def again(self, job: Job) -> None:
        """Queue a job that failed or was cancelled anew."""
        if job.status not in ("failed", "cancelled"):
            raise InputError("this video is made, or is being made")
        job.status, job.problem, job.created = "waiting", "", time.time()
        self.library.keep(job)
        self.wake()

    async def remove(self, item: Photo | Job) -> None:
        """Remove a photo with its jobs, or a job; what is being computed is stopped."""
        jobs = [item] if isinstance(item, Job) else list(self.library.jobs_of(item))
        for job in jobs:
            if not job.over:
                await self.cancel(job)
        self.library.remove(item)

    # --- the loops

    async def _next(self, more: asyncio.Event, find: Callable[[], T | None]) -> T:
        while True:
            more.clear()
            if (found := find()) is not None:
                return found
            await more.wait()

    async def _look_at_photos(self) -> None:
        while True:
            photo: Photo = await self._next(
                self._more[0], lambda: next((one for one in self.library.photos.values() if one.status == "looking"), None)
            )
            task = {"task": "look", "folder": str(self.library.place(photo)), "cache": self._cache}
            answer = await self._looker.do(task, lambda _: None)
            if photo.id not in self.library.photos:  # it was removed meanwhile
                continue
            if "problem" in answer:
                photo.status, photo.problem = "unusable", answer["problem"]
            else:
                photo.status = "ready"
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

    async def _make_videos(self) -> None:
        while True:
            job: Job = await self._next(self._more[1], self._waiting)
            await self._make(job)

    async def _make(self, job: Job) -> None:
        photo, begun = self.library.photos[job.photo], time.monotonic()
        self._current, job.status = job, "running"
        self.library.keep(job)
        task = {
            "task": "video", "folder": str(self.library.place(job)), "photo": str(self.library.place(photo) / ORIGINAL), "cache": self._cache,
            "wish": job.wish.said(), "known": photo.known, "times": self._times(), "workers": self._workers,
        }  # fmt: skip
        try:
            answer = await self._maker.do(task, lambda update: self.progress.__setitem__(job.id, update))
        finally:
            self._current = None
            self.progress.pop(job.id, None)
        if "problem" in answer:
            await self._maker.stop()  # its workers may still be at it
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
            self._learn(done["times"])
        self.library.keep(job)

    async def _rest(self) -> None:
        while True:
            await asyncio.sleep(30)
            if self._maker.idle(IDLE_SECONDS) and self._current is None:
                await self._maker.stop()
            if self._looker.idle(IDLE_SECONDS / 10) and all(photo.status != "looking" for photo in self.library.photos.values()):
                await self._looker.stop()

    # --- how long things take here

    def _times(self) -> dict[str, float]:
        with contextlib.suppress(Exception):  # no file, or none of ours: the priors do
            found = json.loads(read_bytes(self.library.folder / _TIMES, limit=1 << 16))
            return {str(name): float(value) for name, value in found.items()}
        return {}

    def _learn(self, seconds: Mapping[str, float]) -> None:
        known = self._times()
        mixed = known | {name: (value + known.get(name, value)) / 2 for name, value in seconds.items()}
        with atomic_path(self.library.folder / _TIMES) as temporary:
            temporary.write_text(json.dumps({name: round(value, 4) for name, value in mixed.items()}))
