"""Run a graph, in the same way for the command line, notebooks and tests."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from a2v.errors import A2VError, InputError, printable
from a2v.system import WINDOWS, lock
from pipelines.engine.executors import ExecutorName, SerialExecutor, open_executor
from pipelines.engine.graph import (
    Graph,
    build,
    check_names,
    downstream_of,
    inputs_of,
    needed_for,
    outputs_of,
)
from pipelines.engine.memo import events_in
from pipelines.engine.progress import Listener, Monitor, NodeStats, peak_family_memory, watching
from pipelines.engine.refs import Ref
from pipelines.engine.store import LostObjectError, R, Store

ATTEMPTS = 3
"""Number of attempts of a run if a worker dies or a stored value is lost.

Finished results are kept.
"""


@dataclass(frozen=True)
class Outcome:
    """The outcome of a run.

    Attributes
    ----------
    values : dict
        Ref, or list or object array of refs, of every output that was computed or recalled.
    nodes : dict
        `NodeStats` of every requested node.
    seconds : float
    peak_memory : int
        Highest resident memory of all processes together, bytes.
    store : Store
    """

    values: Mapping[str, Any]
    nodes: Mapping[str, NodeStats]
    seconds: float
    peak_memory: int
    store: Store

    def get(self, name: str, kind: type[R]) -> R:
        """Load the value of output `name`."""
        ref: Ref[R] = self.values[name]
        return self.store.get(ref, kind)

    @property
    def notes(self) -> tuple[str, ...]:
        """Return the notes of the nodes for the user."""
        return tuple(
            dict.fromkeys(printable(text) for stats in self.nodes.values() for text in stats.notes)
        )


def run(
    target: str | Sequence[str],
    *,
    graph: Graph,
    executor: ExecutorName | Executor = "local",
    workers: int | None = None,
    address: str | None = None,
    store: Store | None = None,
    overrides: Mapping[str, Any] | None = None,
    fresh: Collection[str] = (),
    start: str | None = None,
    progress: Listener | None = None,
    early: Early | None = None,
    **params: Any,
) -> Outcome:
    """Compute `target` and only what it needs; stored results are not computed again.

    Parameters
    ----------
    target : name of an output, or several
    graph : the steps
    executor : where fanned-out nodes run; "local", "dask", "ray", "serial" or a custom
    executor
    workers, address : see `open_executor`
    store : store of the values; the default folder if None
    overrides : outputs given from outside, by name; the steps that make them are dropped
    fresh : outputs that are computed even when they are remembered
    start : output that is computed again with everything that depends on it
    progress : called with an `Update` while nodes run
    early : outputs that are computed first, in this order, each with a function. It is called with
    the outcome so far when the output is computed
    params : the graph's inputs

    Raises
    ------
    InputError
        An unknown target, parameter or override (it names the nearest), or a missing parameter; and
        what nodes raise.
    """
    store, overrides = store or Store(), dict(overrides or {})
    targets = (target,) if isinstance(target, str) else tuple(target)
    known = outputs_of(graph)
    check_names(
        graph,
        [*targets, *(early or {}), *overrides, *fresh, *([start] if start else [])],
        known,
        "node",
    )
    check_names(graph, params, inputs_of(graph), "parameter")
    early = early or {}
    steps = needed_for(graph, [*targets, *early], overrides)
    if missing := [
        name for name in inputs_of(steps) if name not in params and name not in overrides
    ]:
        raise InputError(
            f"{', '.join(targets)} needs the parameter{'s' * (len(missing) > 1)} "
            f"{', '.join(missing)}; give a value"
        )
    anew = set(fresh) | (downstream_of(graph, start) if start else set())
    inputs = {
        name: value for name, value in {**params, **overrides}.items() if name in inputs_of(steps)
    }
    values: dict[str, Any] = {name: value for name, value in overrides.items() if name in targets}

    clock = time.perf_counter()
    with _event_folder(store) as events, peak_family_memory() as peak:
        monitor = Monitor(graph, events, progress)
        with watching(monitor):
            for last in (*[False] * (ATTEMPTS - 1), True):
                with (
                    _tolerate_loss(last),
                    open_executor(executor, workers=workers, address=address) as pool,
                ):
                    done = dict[str, Any]()  # no later part of the run computes these again
                    for name, tell in early.items():
                        leg = needed_for(graph, [name], {**overrides, **done})
                        done |= _map(leg, {**inputs, **done}, pool, store, events, anew)
                        monitor.poll()
                        tell(
                            Outcome(
                                {**overrides, **done},
                                monitor.stats,
                                time.perf_counter() - clock,
                                0,
                                store,
                            )
                        )
                    done |= _map(
                        needed_for(graph, targets, {**overrides, **done}),
                        {**inputs, **done},
                        pool,
                        store,
                        events,
                        anew,
                    )
                    values |= done
                    break
        return Outcome(values, monitor.stats, time.perf_counter() - clock, peak(), store)


Early = Mapping[str, Callable[[Outcome], None]]
"""Outputs by name, and the functions to call as soon as they are computed."""


@contextlib.contextmanager
def _tolerate_loss(last: bool) -> Iterator[None]:
    """Ignore a dead worker or a lost value, unless this is the `last` attempt."""
    try:
        yield
    except LostObjectError:
        if last:
            raise
    except BrokenProcessPool:
        if last:
            raise A2VError(
                f"a worker process was killed in each of {ATTEMPTS} attempts, most likely because "
                "it ran out of memory; finished results are kept: run again with fewer "
                "--workers or a smaller --size"
            ) from None


def _map(
    steps: Graph,
    known: Mapping[str, Any],
    pool: Executor,
    store: Store,
    events: Path,
    anew: Collection[str],
) -> dict[str, Any]:
    if not steps:
        return {}
    inputs = {name: known[name] for name in inputs_of(steps)}
    pipeline = build(steps, store=store, events=str(events), fresh=anew)
    here = SerialExecutor()  # single nodes run in this process with all its threads
    executors: dict[Any, Executor] = {"": here}
    for step in steps:
        if step.fans_out:
            executors[step.output] = pool
    sizes = {"": 1} | {
        step.output: step.together(inputs) for step in steps if step.fans_out and step.together
    }
    said = (
        io.StringIO()
    )  # pipefunc prints debugging advice before a node's error if rich is installed
    with contextlib.redirect_stdout(said):
        results = pipeline.map(
            dict(inputs),
            executor=executors,
            storage="dict",
            chunksizes=sizes,
            show_progress=False,
            return_results=True,
        )
    print(printable(said.getvalue()), end="")
    return {name: results[name].output for name in results if name not in inputs}


_NEW_SECONDS = 60.0
"""Age in seconds up to which the folder of a run is left alone; it may not be locked yet."""


@contextlib.contextmanager
def _event_folder(store: Store) -> Iterator[Path]:
    """Make a folder for the events of one run; remove the folders of killed runs."""
    parent = store.folder / "runs"
    store.prepare()
    try:
        parent.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(dir=parent))
    except OSError as error:
        raise InputError(
            f"cannot write the store {store.folder}: {error.strerror}; choose another with --cache "
            "or A2V_CACHE"
        ) from error
    handle = os.open(folder, os.O_RDONLY) if not WINDOWS else None
    try:
        if handle is not None:
            lock(handle)
        for old in parent.iterdir():
            _clear(old)
        with events_in(str(folder)):
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if handle is not None:
            os.close(handle)


def _clear(old: Path) -> None:
    """Remove the folder of a run that was killed: nobody holds its lock.

    A run locks its folder just after it has made it, so new ones are left. Where folders cannot be
    locked (Windows), day-old ones are removed.
    """
    with contextlib.suppress(OSError):
        if time.time() - old.stat().st_mtime < (86400.0 if WINDOWS else _NEW_SECONDS):
            return
        if WINDOWS:
            shutil.rmtree(old)
            return
        handle = os.open(old, os.O_RDONLY)
        try:
            if lock(handle):
                shutil.rmtree(old)
        finally:
            os.close(handle)
