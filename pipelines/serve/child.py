"""A child process that computes for the page, started on demand and stopped at any time."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import Callable, Mapping
from typing import Any

from a2v.processes import python_command
from a2v.system import end_group

GRACE_SECONDS = 5.0
"""Seconds between asking a process to end and killing it."""
_LINE_BYTES = 4 << 20
LOST = (
    "the process that computed this has ended, most likely because it ran out of memory; "
    "finished results are kept: try again"
)
SLOW = "this takes too long; use a smaller photo"

Take = Callable[[Mapping[str, Any]], None]


class Child:
    """A child process that is started on demand and may be stopped at any time.

    It may also be stopped during its start.

    Parameters
    ----------
    code : Python that runs `pipelines.serve.worker.main`
    """

    def __init__(self, code: str) -> None:
        self._code = code
        self._process: asyncio.subprocess.Process | None = None
        self._used = time.monotonic()
        # held while the process is started or stopped, so that a stop waits for a start to finish
        self._life = asyncio.Lock()
        self._turn = asyncio.Lock()  # held while a task is answered

    @property
    def alive(self) -> bool:
        """Return whether the process is running."""
        return self._process is not None and self._process.returncode is None

    async def tell(self, task: Mapping[str, Any]) -> asyncio.subprocess.Process:
        """Send a task to the process, which is started if necessary.

        Raises
        ------
        OSError
            The process cannot be started.
        """
        async with self._life:
            if self._process is None or self._process.returncode is not None:
                self._process = await asyncio.create_subprocess_exec(
                    *python_command(self._code),
                    stdin=asyncio.subprocess.PIPE,
                    stdout=asyncio.subprocess.PIPE,
                    start_new_session=True,
                    limit=_LINE_BYTES,
                )
            process = self._process
        assert process.stdin is not None
        self._used = time.monotonic()
        with contextlib.suppress(
            ConnectionError
        ):  # the process has just ended; `_answer` reports it
            process.stdin.write(json.dumps(task).encode() + b"\n")
            await process.stdin.drain()
        return process

    async def do(
        self,
        task: Mapping[str, Any],
        progress: Take = lambda _: None,
        *,
        limit: float | None = None,
    ) -> dict[str, Any]:
        """Send a task and wait at most `limit` seconds for its "done" or "problem".

        One task runs at a time.
        """
        async with self._turn:
            try:
                return await asyncio.wait_for(self._answer(task, progress), limit)
            except (TimeoutError, asyncio.TimeoutError):
                await self.stop()
                return {"problem": SLOW}
            except ValueError:  # a line that is too long or invalid
                await self.stop()
                return {"problem": LOST}
            except OSError as error:
                return {"problem": f"no process can be started ({error.strerror}); try again later"}

    async def _answer(self, task: Mapping[str, Any], progress: Take) -> dict[str, Any]:
        process = await self.tell(task)
        assert process.stdout is not None
        while line := await process.stdout.readline():
            message: dict[str, Any] = json.loads(line)
            if "progress" in message:
                progress(message["progress"])
                continue
            self._used = time.monotonic()
            return message
        return {"problem": LOST}

    def idle(self, seconds: float) -> bool:
        """Return whether the process has had no task for `seconds`."""
        return self.alive and not self._turn.locked() and time.monotonic() - self._used > seconds

    async def stop(self) -> None:
        """End the process and its own child processes; a starting process is ended once started."""
        async with self._life:
            process, self._process = self._process, None
            if process is None:
                return
            for hard in (False, True):
                with contextlib.suppress(ProcessLookupError):
                    end_group(process.pid, hard=hard)
                with contextlib.suppress(TimeoutError, asyncio.TimeoutError):
                    await asyncio.wait_for(process.wait(), GRACE_SECONDS)
