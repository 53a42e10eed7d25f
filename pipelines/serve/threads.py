"""Threads for blocking functions; the server does not wait for them when it stops.

`asyncio.to_thread` would wait: a thread that loads a model on a busy machine would delay the end of
the process.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


class Threads:
    """Runs functions in threads; they must tolerate the end of the process at any time.

    Parameters
    ----------
    most : largest number of functions that run at the same time; others wait
    """

    def __init__(self, most: int) -> None:
        self._free = asyncio.Semaphore(most)

    async def do(self, function: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> T:
        """Run a function in a thread, and return or raise its result."""
        async with self._free:
            loop = asyncio.get_running_loop()
            answer: asyncio.Future[T] = loop.create_future()

            def settle(put: Callable[[], None]) -> None:
                if not answer.done():  # the caller was cancelled
                    put()

            def tell(put: Callable[[], None]) -> None:
                with contextlib.suppress(RuntimeError):  # the server has stopped
                    loop.call_soon_threadsafe(settle, put)

            def work() -> None:
                try:
                    result = function(*args, **kwargs)
                except BaseException as error:
                    failed = error
                    tell(lambda: answer.set_exception(failed))
                else:
                    tell(lambda: answer.set_result(result))

            threading.Thread(target=work, daemon=True).start()
            return await answer
