"""A progress bar for one long call of the library.

The bars of the graph's nodes are in `pipelines.engine.progress`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from a2v.types import Progress


@contextmanager
def bar(name: str, unit: str, *, hidden: bool = False) -> Iterator[Progress]:
    """Show a progress bar with the remaining time on standard error.

    The value of the context is the ``progress(done, total)`` that the library calls.
    """
    from tqdm import tqdm

    with tqdm(desc=name, unit=unit, file=sys.stderr, disable=hidden, mininterval=0.5) as shown:

        def progress(done: int, total: int) -> None:
            shown.total = total
            shown.update(done - shown.n)

        yield progress
