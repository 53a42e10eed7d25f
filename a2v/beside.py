"""Load libraries and tables in a thread, while this one waits for native code."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def loading_beside(*loaders: Callable[[], object]) -> Iterator[None]:
    """Call the `loaders`, each of which imports a library or keeps a table, one after the other
    beside the block.

    A block that mostly runs native code hardly becomes slower by them. When the block ends, the
    current loader is waited for, and the next ones are not called. A loader that fails is ignored:
    who needs what it loads, loads it again, and reports why that fails.
    """
    ended = threading.Event()

    def load() -> None:
        for loader in loaders:
            if ended.is_set():
                return
            with contextlib.suppress(Exception):
                loader()

    beside = threading.Thread(target=load, name="loading")
    beside.start()
    try:
        yield
    finally:
        ended.set()
        beside.join()
