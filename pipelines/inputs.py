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
    quiet: bool = flag("show no progress bars")

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
        """Compute `targets` with bars, as `pipelines.engine.run.run` does."""
        from pipelines.run import run

        given = Parameters(parameters)
        with self.listening() as listener:
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
        """Return the progress function: bars on standard error."""
        from pipelines.engine.progress import Bars

        bars = Bars(quiet=self.quiet)
        try:
            yield bars
        finally:
            bars.close()

    def tell_times(self, outcome: Outcome) -> None:
        """Print the times of the nodes on standard error, unless quiet."""
        from pipelines.report import table

        if not self.quiet:
            say(table(outcome))
