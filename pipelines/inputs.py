"""Input files, output folders, and how a graph runs."""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError
from a2v.io import clear_leftovers, read_bytes, say
from a2v.types import RenderSettings
from pipelines.engine.executors import EXECUTORS, ExecutorName
from pipelines.engine.graph import Parameters
from pipelines.engine.refs import Ref
from pipelines.engine.store import Store
from pipelines.options import flag, option

if TYPE_CHECKING:
    from pipelines.engine.graph import Graph
    from pipelines.engine.progress import Listener
    from pipelines.engine.run import Early, Outcome
    from pipelines.nodes.values import Blob

MAX_PHOTO_BYTES = 256 << 20

_LOOK = RenderSettings()


def check_writable(folder: str | os.PathLike[str]) -> Path:
    """Make `folder` and check that files can be written to it, before a long computation.

    Raises
    ------
    InputError
        They cannot.
    """
    path = Path(folder)
    try:
        if path.exists() and not path.is_dir():
            raise InputError(f"cannot write to {path}: it is a file; give a folder as --out")
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path) as probe:
            probe.write(b"\0" * 4096)
        clear_leftovers(path)
    except OSError as error:
        what = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else error.strerror
        raise InputError(f"cannot write to {path}: {what}; choose another --out") from error
    return path


def put_file(store: Store, path: str | os.PathLike[str] | None) -> Ref[Blob] | None:
    """Copy a user's file into the store; None stays None.

    Raises
    ------
    InputError
        It cannot be read.
    """
    from pipelines.nodes.values import Blob

    if path is None:
        return None
    ref = store.put(Blob.of(read_bytes(path, limit=MAX_PHOTO_BYTES)))
    store.share([ref])
    return dataclasses.replace(ref, source=os.fspath(path))


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Where and how a graph runs."""

    executor: ExecutorName = option(
        "program that distributes the computation of frames",
        default="local",
        choices=EXECUTORS,
        rare=True,
    )
    workers: int | None = option("number of processes (default: one per core)", default=None)
    address: str | None = option(
        "address of a Dask scheduler or a Ray cluster (default: start one on this machine)",
        default=None,
        rare=True,
    )
    cache: str | None = option(
        "folder of cached results (default: $A2V_CACHE, else ~/.cache/a2v)",
        default=None,
        metavar="FOLDER",
        rare=True,
    )
    quiet: bool = flag("show no progress and no summary")
    verbose: bool = flag("print calls, seconds and memory of each node at the end", rare=True)

    def run(
        self,
        targets: str | Sequence[str],
        parameters: Mapping[str, object],
        *,
        graph: Graph | None = None,
        start: str | None = None,
        overrides: Mapping[str, Any] | None = None,
        early: Early | None = None,
    ) -> Outcome:
        """Compute `targets` with a line of progress, as `pipelines.engine.run.run` does."""
        from pipelines.bar import Bars
        from pipelines.clock import Clock
        from pipelines.engine.graph import needed_for
        from pipelines.graph import video_graph
        from pipelines.run import run

        given = Parameters(parameters)
        with self.listening() as listener:
            if isinstance(listener, Bars):
                names = [targets] if isinstance(targets, str) else [*targets]
                steps = video_graph(several="other" in given) if graph is None else graph
                needed = needed_for(steps, [*names, *(early or {})], overrides or {})
                listener.expect(Clock.of([step.node.name for step in needed], given))
            return run(
                targets,
                graph=graph,
                executor=self.executor,
                workers=self.workers,
                address=self.address,
                store=Store(self.cache),
                start=start,
                overrides=overrides,
                progress=listener,
                early=early,
                **given,
            )

    @contextlib.contextmanager
    def listening(self) -> Iterator[Listener]:
        """Return the progress function: a line on standard error."""
        from pipelines.bar import Bars

        bars = Bars(quiet=self.quiet)
        try:
            yield bars
        finally:
            bars.close()

    def tell_times(self, outcome: Outcome) -> None:
        """Print the times of the nodes on standard error if ``--verbose`` asks for them."""
        from pipelines.report import table

        if self.verbose and not self.quiet:
            say(table(outcome))

    def tell_made(self, written: Sequence[Path], seconds: float) -> None:
        """Print what was made, where, and in which time, on standard error, unless quiet."""
        from pipelines.engine.progress import duration

        if not self.quiet and written:
            names = ", ".join(path.name for path in written)
            say(f"made in {duration(seconds)}: {names}")
            say(f"in {written[0].parent}")
