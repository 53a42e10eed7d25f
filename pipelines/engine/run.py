"""Run a graph, in the same way for the command line, notebooks and tests."""

from __future__ import annotations

import contextlib
import dataclasses
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
from pipelines.engine.executors import (
    ExecutorName,
    LocalExecutor,
    SerialExecutor,
    open_executor,
)
from pipelines.engine.graph import (
    Graph,
    build,
    check_names,
    downstream_of,
    inputs_of,
    needed_for,
    outputs_of,
)
from pipelines.engine.memo import events_in, stopped_by
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
    progress : called with an `Update` while nodes run; an exception that it raises stops the run,
    at the next report of the running node, and is raised again
    early : outputs that are computed first, in this order, each with a function. It is called with
    the outcome so far when the output is computed
    params : the graph's inputs

    Raises
    ------
    InputError
        An unknown target, parameter or override (it names the nearest), or a missing parameter; and
        what nodes raise.
    """
    store = store or Store()
    asked = _Asked(
        graph=graph,
        targets=(target,) if isinstance(target, str) else tuple(target),
        params=params,
        overrides=overrides or {},
        early=early or {},
        anew=set(fresh) | ({start} if start else set()),
    ).checked(start)
    clock = time.perf_counter()
    with _event_folder(store) as events, peak_family_memory() as peak:
        monitor = Monitor(graph, events, progress)
        with watching(monitor), stopped_by(monitor.check):
            for last in (*[False] * (ATTEMPTS - 1), True):
                with (
                    _tolerate_loss(last, monitor),
                    open_executor(executor, workers=workers, address=address) as pool,
                ):
                    if isinstance(pool, LocalExecutor):
                        monitor.stop = pool.stop
                    values = _compute(asked, pool, store, monitor, clock)
                    break
        monitor.check()
        return Outcome(values, monitor.stats, time.perf_counter() - clock, peak(), store)


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """The arguments of `run` that say what to compute."""

    graph: Graph
    targets: Sequence[str]
    params: Mapping[str, Any]
    overrides: Mapping[str, Any]
    early: Early
    anew: set[str]

    def checked(self, start: str | None) -> _Asked:
        """Return the same with what depends on `start` in `anew`.

        Raises
        ------
        InputError
            An unknown name, or a missing parameter.
        """
        named = [*self.targets, *self.early, *self.overrides, *self.anew]
        check_names(self.graph, named, outputs_of(self.graph), "node")
        check_names(self.graph, self.params, inputs_of(self.graph), "parameter")
        steps = needed_for(self.graph, [*self.targets, *self.early], self.overrides)
        given = {**self.params, **self.overrides}
        if missing := [name for name in inputs_of(steps) if name not in given]:
            raise InputError(
                f"{', '.join(self.targets)} needs the parameter{'s' * (len(missing) > 1)} "
                f"{', '.join(missing)}; give a value"
            )
        anew = self.anew | (downstream_of(self.graph, start) if start else set())
        return dataclasses.replace(self, anew=anew)


def _compute(
    asked: _Asked, pool: Executor, store: Store, monitor: Monitor, clock: float
) -> dict[str, Any]:
    """Compute the early outputs and then the targets; return the values by name."""
    done = dict[str, Any]()  # no later part of the run computes these again

    def add(targets: Sequence[str]) -> None:
        known = {**asked.overrides, **done}
        steps = needed_for(asked.graph, targets, known)
        given = {**asked.params, **known}
        inputs = {name: given[name] for name in inputs_of(steps)}
        done.update(_map(steps, inputs, pool, store, monitor.folder, asked.anew))

    for name, tell in asked.early.items():
        add([name])
        monitor.poll()
        seconds = time.perf_counter() - clock
        tell(Outcome({**asked.overrides, **done}, monitor.stats, seconds, 0, store))
    add(asked.targets)
    given = {name: value for name, value in asked.overrides.items() if name in asked.targets}
    return given | done


Early = Mapping[str, Callable[[Outcome], None]]
"""Outputs by name, and the functions to call as soon as they are computed."""


@contextlib.contextmanager
def _tolerate_loss(last: bool, monitor: Monitor) -> Iterator[None]:
    """Ignore a dead worker or a lost value, unless this is the `last` attempt or the listener has
    stopped the run."""
    try:
        yield
    except BaseException as error:
        monitor.check()
        if not isinstance(error, LostObjectError | BrokenProcessPool):
            raise
        if last:
            raise _final(error) from None


def _final(error: BaseException) -> BaseException:
    """Return the error of the last attempt, in a sentence if a worker died."""
    if isinstance(error, LostObjectError):
        return error
    return A2VError(
        f"a worker process was killed in each of {ATTEMPTS} attempts, most likely because it ran "
        "out of memory; finished results are kept: run again with fewer --workers or a smaller "
        "--size"
    )


def _map(
    steps: Graph,
    inputs: Mapping[str, Any],
    pool: Executor,
    store: Store,
    events: Path,
    anew: Collection[str],
) -> dict[str, Any]:
    if not steps:
        return {}
    pipeline = build(steps, store=store, events=str(events), fresh=anew)
    here = SerialExecutor()  # single nodes run in this process with all its threads
    executors: dict[Any, Executor] = {"": here}
    for step in steps:
        if step.fans_out:
            executors[step.output] = pool
    sizes = {"": 1} | {
        step.output: step.together(inputs) for step in steps if step.fans_out and step.together
    }
    _leave_out_advice()
    try:
        results = pipeline.map(
            dict(inputs),
            executor=executors,
            storage="dict",
            chunksizes=sizes,
            show_progress=False,
            return_results=True,
        )
    except BaseException as error:
        _leave_out_arguments(error)
        raise
    return {name: results[name].output for name in results if name not in inputs}


def _leave_out_advice() -> None:
    """Keep pipefunc from printing debugging advice before a node's error if rich is installed."""
    from pipefunc import _pipefunc_utils

    _pipefunc_utils.is_installed = lambda name: False


def _leave_out_arguments(error: BaseException) -> None:
    """Drop what pipefunc notes on an error of a node, or of the user's progress function that is
    called in one: the node's arguments."""
    notes: list[str] = getattr(error, "__notes__", [])
    notes[:] = [text for text in notes if "occurred while executing function" not in text]


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
