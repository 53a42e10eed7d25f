"""A bar for one long call of the library (the graph's nodes have theirs in
`pipelines.engine.progress`)."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from a2v.types import Progress


@contextmanager
def bar(name: str, unit: str, *, hidden: bool = False) -> Iterator[Progress]:
    """A bar on standard error with the time left, as a context whose value is the library's
    ``progress(done, total)``."""
    from tqdm import tqdm

    with tqdm(desc=name, unit=unit, file=sys.stderr, disable=hidden, mininterval=0.5) as shown:

        def progress(done: int, total: int) -> None:
            shown.total = total
            shown.update(done - shown.n)

        yield progress
