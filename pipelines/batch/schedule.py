"""Schedule tasks on workers that may die.

Ready tasks are sent out, lost tasks are sent again, and no task is done twice. People come before
motions, and motions before videos. A task waits for the tasks whose results it shares with others.
A local worker that dies loses only its own task. After the loss of a cluster the scheduler connects
again.
"""

from __future__ import annotations

import contextlib
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import Any

from a2v.errors import A2VError, InputError
from pipelines.batch.tasks import Kind, Result, Task
from pipelines.batch.worker import own_likeness, perform, recall
from pipelines.engine.executors import LocalExecutor, cpu_count, open_executor
from pipelines.engine.progress import memory_of_family
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions

LOSSES = 6
"""A task fails after its worker has died this often, unless workers die as often at other tasks."""
_CHANCE = 3.0
"""Factor on the loss rate of the other tasks up to which a task is sent again beyond `LOSSES`.

A rate is losses per time in flight. Above this factor the task fails.
"""
WAIT_FOR_CLUSTER = 180.0
"""Seconds within which a lost scheduler must be reachable again."""
_PRIOR: Mapping[Kind, float] = {"person": 25.0, "motion": 1.0, "video": 120.0}
"""Assumed seconds of a task before any of its kind has been measured."""

Done = Callable[[Task, Result], None]


@dataclass
class Watch:
    """Progress of a batch. The remaining time follows from the time of the finished tasks."""

    left: Counter[Kind] = field(default_factory=Counter)
    done: Counter[Kind] = field(default_factory=Counter)
    seconds: dict[Kind, float] = field(default_factory=dict)
    workers: int = 1

    def take(self, kind: Kind, seconds: float) -> None:
        """Count a finished task. A recalled one took no time and is not used for the estimate."""
        self.left[kind] -= 1
        if seconds:
            self.done[kind] += 1
            self.seconds[kind] = self.seconds.get(kind, 0.0) + seconds

    def remaining(self) -> float:
        """Return the remaining seconds, from the mean time of the computed tasks."""
        each = {
            kind: self.seconds[kind] / self.done[kind] if self.done[kind] else _PRIOR[kind]
            for kind in self.left
        }
        return sum(count * each[kind] for kind, count in self.left.items()) / max(self.workers, 1)


@dataclass
class Losses:
    """Which tasks lost their workers, and whether the task or the machine is the cause.

    Losses are compared per time in flight.
    """

    lost: Counter[str] = field(default_factory=Counter)
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))

    def flew(self, key: str, seconds: float, *, lost: bool) -> None:
        """Count one flight of a task."""
        self.lost[key] += lost
        self.seconds[key] += seconds

    def hopeless(self, key: str) -> bool:
        """Return whether a task has lost its worker too often, and much more often than others."""
        lost, seconds = self.lost[key], self.seconds[key]
        others = self.lost.total() - lost
        expected = others / max(sum(self.seconds.values()) - seconds, 1.0) * seconds
        return lost >= LOSSES + min(_CHANCE * expected, others)


class SeparateWorkers(Executor):
    """Local workers, each in its own process pool, started when they are needed.

    A worker that dies breaks only one call.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._idle: list[LocalExecutor] = []
        self._busy: set[LocalExecutor] = set()

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Give the call to a worker of its own."""
        pool = self._idle.pop() if self._idle else LocalExecutor(1)
        self._busy.add(pool)
        future = pool.submit(function, *args, **kwargs)
        future.add_done_callback(lambda finished: self._put_back(pool, finished))
        return future

    def _put_back(self, pool: LocalExecutor, finished: Future[Any]) -> None:
        self._busy.discard(pool)
        if not finished.cancelled() and not isinstance(finished.exception(), BrokenProcessPool):
            self._idle.append(pool)

    def rest(self) -> None:
        """End the idle workers to free their memory."""
        while self._idle:
            self._idle.pop().shutdown()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all workers; with `cancel_futures` also those that are busy."""
        for pool in [*self._idle, *self._busy]:
            pool.shutdown(wait=wait, cancel_futures=cancel_futures)


class Schedule:
    """Runs tasks on workers.

    Parameters
    ----------
    store : Store
    running : RunOptions
        Where.
    limit : int or None
        Bytes of memory that all local processes together may have before another task is begun.
    done : called with every task and what became of it, in this thread
    tick : called about once per second with the `Watch`
    """

    def __init__(
        self,
        store: Store,
        running: RunOptions,
        *,
        limit: int | None,
        done: Done,
        tick: Callable[[Watch], None],
    ) -> None:
        self._store, self._running, self._limit = store, running, limit
        self._done, self._tick = done, tick
        self._waiting: dict[str, list[Task]] = {}
        self._missing: dict[str, int] = {}
        self._ready: deque[Task] = deque()
        self._over: dict[str, Result] = {}
        self._losses = Losses()
        self._begun: dict[str, float] = {}
        self._largest = 0
        self.watch = Watch()

    def run(self, tasks: Iterable[Task]) -> None:
        """Run `tasks`, one per key, after the tasks that their `after` names.

        Raises
        ------
        A2VError
            A worker runs other code or weights, or the cluster is lost for good.
        """
        own = {task.key: task for task in tasks}
        for task in own.values():
            self._add(task, [key for key in task.after if key in own])
        lost_since: float | None = None
        while self._ready or self._missing:
            try:
                with _open(self._running) as (pool, workers):
                    lost_since, self.watch.workers = None, workers
                    self._drive(pool, workers)
            except (_ClusterLostError, InputError) as error:
                begun = bool(self._over) or isinstance(error, _ClusterLostError)
                lost_since = lost_since or time.monotonic()
                if not begun or time.monotonic() - lost_since > WAIT_FOR_CLUSTER:
                    raise
                time.sleep(2.0)

    def _add(self, task: Task, missing: list[str]) -> None:
        self.watch.left[task.kind] += 1
        if not missing:
            self._ready.append(task)
            return
        self._missing[task.key] = len(missing)
        for key in missing:
            self._waiting.setdefault(key, []).append(task)

    def _drive(self, pool: Executor, workers: int) -> None:
        flying: dict[Future[Any], Task] = {}
        try:
            while self._ready or flying:
                while self._ready and len(flying) < workers and self._fits(pool, flying):
                    task = self._ready.popleft()
                    if (known := recall(task, self._store)) is not None:
                        self._finish(task, known)
                        self._tick(self.watch)
                    else:
                        self._begun[task.key] = time.monotonic()
                        flying[pool.submit(perform, task, self._store, own_likeness())] = task
                if not flying:
                    continue
                self._tick(self.watch)
                for future in wait(flying, timeout=1.0, return_when=FIRST_COMPLETED).done:
                    self._land(future, flying)
        finally:
            self._ready.extendleft(
                reversed(flying.values())
            )  # Lost with the cluster, or interrupted.

    def _land(self, future: Future[Any], flying: dict[Future[Any], Task]) -> None:
        task = flying[future]
        try:
            result: Result = future.result()
        except (CancelledError, Exception) as error:
            if not isinstance(error, BrokenProcessPool) and type(error).__name__ not in (
                "KilledWorker",
                "WorkerCrashedError",
            ):
                raise _ClusterLostError(
                    f"the connection to the cluster was lost ({type(error).__name__}: {error}); "
                    "repeat the command when the cluster is reachable"
                ) from error
            del flying[future]
            self._losses.flew(task.key, time.monotonic() - self._begun[task.key], lost=True)
            if not self._losses.hopeless(task.key):
                self._ready.appendleft(task)
                return
            often = self._losses.lost[task.key]
            result = Result(
                problem=f"the worker was killed {often} times, most likely because it ran out of "
                "memory; use fewer --workers"
            )
        else:
            del flying[future]
            self._losses.flew(task.key, time.monotonic() - self._begun[task.key], lost=False)
        if result.strange:
            raise _StrangeWorkerError(result.problem)
        self._largest = max(self._largest, result.peak_memory)
        self._finish(task, result)

    def _finish(self, task: Task, result: Result) -> None:
        self._over[task.key] = Result(problem=result.problem)
        self.watch.take(task.kind, result.seconds)
        self._done(task, result)
        for other in self._waiting.pop(task.key, []):
            if other.key not in self._missing:  # It has failed already.
                continue
            if result.problem and task.kind != "video":
                del self._missing[other.key]
                self._finish(other, Result(problem=result.problem, trace=result.trace))
                continue
            self._missing[other.key] -= 1
            if not self._missing[other.key]:
                del self._missing[other.key]
                self._ready.append(other)

    def _fits(self, pool: Executor, flying: Mapping[Future[Any], Task]) -> bool:
        """Return whether another task may start within the memory limit.

        At least one always runs.
        """
        if self._limit is None or not flying:
            return True
        if memory_of_family() + self._largest <= self._limit and self._largest:
            return True
        if isinstance(pool, SeparateWorkers):
            pool.rest()
        return False


class _ClusterLostError(A2VError):
    """Signals that all running tasks are lost. Finished results are kept."""


class _StrangeWorkerError(A2VError):
    """Signals that a worker would compute other results."""


@contextlib.contextmanager
def _open(running: RunOptions) -> Iterator[tuple[Executor, int]]:
    """Return the workers and the number of tasks to give them at once."""
    if running.executor == "local":
        workers = running.workers or cpu_count()
        pool = SeparateWorkers(workers)
        try:
            yield pool, workers
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
        pool.shutdown()
        return
    with open_executor(
        running.executor, workers=running.workers, address=running.address
    ) as executor:
        yield executor, _size(executor, running)


def _size(executor: Executor, running: RunOptions) -> int:
    """Return the number of tasks to send out at once: one more than the cluster has threads.

    So no thread waits for this process.
    """
    if running.executor == "serial":
        return 1
    client = getattr(executor, "_client", None)
    threads = (
        sum(client.ncores().values()) if client is not None else running.workers or cpu_count()
    )
    return int(threads) + 1 + int(threads) // 4
