"""A child process that computes for the page: started when it is needed, stopped at any moment."""

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
"""Between asking a process to end and ending it."""
_LINE_BYTES = 4 << 20
LOST = "the process that computed this has ended, most likely because the memory was used up; what was finished is remembered: try again"
SLOW = "this takes too long; take a smaller photo"

Take = Callable[[Mapping[str, Any]], None]


class Child:
    """A child process that is started when it is needed and may be stopped at any moment, also
    while it starts.

    Parameters
    ----------
    code : Python that runs `pipelines.serve.worker.main`
    """

    def __init__(self, code: str) -> None:
        self._code = code
        self._process: asyncio.subprocess.Process | None = None
        self._used = time.monotonic()
        # of whoever starts or stops the process: what is being started cannot be stopped before it
        # is there
        self._life = asyncio.Lock()
        self._turn = asyncio.Lock()  # of whoever waits for an answer

    @property
    def alive(self) -> bool:
        """Whether there is a process."""
        return self._process is not None and self._process.returncode is None

    async def tell(self, task: Mapping[str, Any]) -> asyncio.subprocess.Process:
        """Hand over a task; starts the process.

        Raises
        ------
        OSError
            It cannot be started.
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
        ):  # it has just ended; whoever waits for an answer will see
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
        """Hand over a task and wait for its end, at most `limit` seconds; "done" or "problem". One
        task at a time."""
        async with self._turn:
            try:
                return await asyncio.wait_for(self._answer(task, progress), limit)
            except (TimeoutError, asyncio.TimeoutError):
                await self.stop()
                return {"problem": SLOW}
            except ValueError:  # a line that is too long, or none of ours
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
        """Whether it has lived for so long without a task."""
        return self.alive and not self._turn.locked() and time.monotonic() - self._used > seconds

    async def stop(self) -> None:
        """End the process and those that it has started; one that is being started is waited for
        and ended."""
        async with self._life:
            process, self._process = self._process, None
            if process is None:
                return
            for hard in (False, True):
                with contextlib.suppress(ProcessLookupError):
                    end_group(process.pid, hard=hard)
                with contextlib.suppress(TimeoutError, asyncio.TimeoutError):
                    await asyncio.wait_for(process.wait(), GRACE_SECONDS)
