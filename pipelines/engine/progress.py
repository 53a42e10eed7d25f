"""Follow the events of nodes (`pipelines.engine.memo.emit`), wherever they run."""

from __future__ import annotations

import contextlib
import json
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from math import prod
from pathlib import Path
from typing import Any

from a2v.io import say
from pipelines.engine.graph import Graph


@dataclass
class NodeStats:
    """Calls, times, memory and notes of one node in a run.

    Attributes
    ----------
    calls, cached : int
        Number of requests of its result, and how many were answered from the store.
    seconds, cpu_seconds : float
        Time computing by the clock, and processor time of all threads; summed over workers.
    span : tuple of 2 float
        First start and last end, seconds since the epoch.
    peak_memory : int
        Highest resident memory of a process during a call, bytes.
    notes : list of str
        Its notes for the user.
    measures : dict
        Numbers about its result, such as residuals; of the last call.
    """

    calls: int = 0
    cached: int = 0
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    span: tuple[float, float] = (float("inf"), 0.0)
    peak_memory: int = 0
    notes: list[str] = field(default_factory=list)
    measures: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Update:
    """Progress of one node.

    Attributes
    ----------
    node : str
    done, total : int
        Finished calls of the node and how many there will be; `total` is 0 while that is unknown.
    part : float
        Share of the running call that is done, 0 to 1.
    """

    node: str
    done: int
    total: int
    part: float = 0.0


Listener = Callable[[Update], None]


class Monitor:
    """Collects the events of a run and passes them on; reads only new ones.

    An exception of the listener stops the run: it is kept in `stopped`, and `stop` is called.
    """

    def __init__(self, graph: Graph, folder: Path, listener: Listener | None) -> None:
        self.stats: dict[str, NodeStats] = {}
        self.stopped: BaseException | None = None
        self.stop: Callable[[], object] = lambda: None
        self.folder, self._listener = folder, listener
        self._steps = {step.node.name: step for step in graph}
        self._read: dict[str, int] = {}
        self._sizes: dict[str, int] = {}
        self._polling = threading.Lock()

    def poll(self) -> None:
        """Read the events since the last poll; may be called from any thread."""
        with self._polling:
            self._poll()

    def _poll(self) -> None:
        for entry in sorted(self.folder.glob("*.jsonl")):
            with open(entry, "rb") as stream:
                stream.seek(self._read.get(entry.name, 0))
                data = stream.read()
            whole = data[: data.rfind(b"\n") + 1]  # a line may be half-written
            self._read[entry.name] = self._read.get(entry.name, 0) + len(whole)
            for line in whole.splitlines():
                with contextlib.suppress(
                    ValueError, KeyError, TypeError, AttributeError
                ):  # not an event of this engine
                    self._take(json.loads(line))

    def _take(self, event: Mapping[str, Any]) -> None:
        name = event["node"]
        step = self._steps.get(name)
        if step is None:
            return
        stats = self.stats.setdefault(name, NodeStats())
        part = 0.0
        if "progress" in event:
            done, total = event["progress"]
            part = done / max(total, 1)
        elif event.get("done"):
            stats.calls += 1
            stats.cached += bool(event["hit"])
            stats.seconds += 0.0 if event["hit"] else event["seconds"]
            stats.cpu_seconds += event.get("cpu", 0.0)
            stats.span = (
                min(stats.span[0], event["start"]),
                max(stats.span[1], event["start"] + event["seconds"]),
            )
            stats.peak_memory = max(stats.peak_memory, event.get("peak", 0))
            stats.notes += [text for text in event["notes"] or [] if text not in stats.notes]
            stats.measures |= event["measures"] or {}
            self._sizes |= dict(zip(step.axes, event["size"], strict=False))
        if self._listener is not None and self.stopped is None:
            total = prod(self._sizes.get(axis, 0) for axis in step.axes) if step.fans_out else 1
            try:
                self._listener(Update(name, stats.calls, total, part))
            except BaseException as error:
                self.stopped = error
                self.stop()

    def check(self) -> None:
        """Raise the exception with which the listener has stopped the run, if it has."""
        if self.stopped is not None:
            raise self.stopped


@contextlib.contextmanager
def watching(monitor: Monitor, interval: float = 0.2) -> Iterator[None]:
    """Poll `monitor` in a thread while the block runs, and once more after it."""
    stop = threading.Event()

    def watch() -> None:
        while not stop.wait(interval):
            monitor.poll()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
        monitor.poll()


def duration(seconds: float) -> str:
    """Return a time in words: ``"40 s"``, ``"3 min"``, ``"1.5 h"``."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


MOST_RISE = 1.1
"""Factor by which a shown time may exceed the shortest one that was shown before."""


class Steady:
    """Bounds an estimate of the remaining time: what is shown never rises by more than a tenth."""

    def __init__(self) -> None:
        self._shortest = float("inf")

    def __call__(self, seconds: float) -> float:
        """Return the seconds to show for an estimate."""
        shown = min(seconds, MOST_RISE * self._shortest)
        self._shortest = min(self._shortest, shown)
        return shown


class Lasting:
    """One line on standard error for long work: the finished share and the remaining time."""

    def __init__(self, name: str, total: int, *, quiet: bool = False) -> None:
        self._name, self._total, self._quiet = name, total, quiet
        self._said = 0.0
        self._live = sys.stderr.isatty()
        self._steady = Steady()

    def __enter__(self) -> Lasting:
        return self

    def __exit__(self, *_: object) -> None:
        if self._live and not self._quiet and self._said:
            say()

    def update(self, done: int, seconds: float, more: str = "") -> None:
        """Show the progress at most once per second, or once in ten seconds without a terminal."""
        now = time.monotonic()
        if self._quiet or now - self._said < (1.0 if self._live else 10.0):
            return
        self._said = now
        text = (
            f"{self._name}: {done}/{self._total}, about {duration(self._steady(seconds))} left"
            + (f" ({more})" if more else "")
        )
        if self._live:
            say(f"{text:<100}", first="\r", end="")
        else:
            say(text)

    def say(self, text: str) -> None:
        """Print a line that stays."""
        if not self._quiet:
            say(f"{text:<100}" if self._live else text, first="\r" if self._live else "")


def memory_of_family() -> int:
    """Return the resident memory of this process and its descendants, bytes.

    Shared pages count in each process.
    """
    import psutil

    total = 0
    me = psutil.Process()
    for process in [me, *me.children(recursive=True)]:
        with contextlib.suppress(psutil.Error):
            total += process.memory_info().rss
    return total


@contextlib.contextmanager
def peak_family_memory(interval: float = 0.5) -> Iterator[Callable[[], int]]:
    """Yield a function that returns the maximum `memory_of_family` so far, from samples."""
    stop, highest = threading.Event(), [memory_of_family()]

    def sample() -> None:
        while not stop.wait(interval):
            highest[0] = max(highest[0], memory_of_family())

    thread = threading.Thread(target=sample, daemon=True)
    thread.start()
    try:
        yield lambda: highest[0]
    finally:
        stop.set()
        thread.join()
