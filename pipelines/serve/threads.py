"""Threads for what would keep the page from answering; the end of the server does not wait for
them.

`asyncio.to_thread` would: a thread that loads a model on a busy machine keeps the process for as
long as that takes.
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
    """Runs functions elsewhere; what they do has to survive that the process ends in the middle.

    Parameters
    ----------
    most : functions that run at once; others wait
    """

    def __init__(self, most: int) -> None:
        self._free = asyncio.Semaphore(most)

    async def do(self, function: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> T:
        """What the function returns or raises."""
        async with self._free:
            loop = asyncio.get_running_loop()
            answer: asyncio.Future[T] = loop.create_future()

            def settle(put: Callable[[], None]) -> None:
                if not answer.done():  # nobody waits any more
                    put()

            def tell(put: Callable[[], None]) -> None:
                with contextlib.suppress(RuntimeError):  # the server has ended
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
