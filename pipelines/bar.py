"""What people see while something runs: a bar for one long call, and one line for a whole run."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from a2v.io import say
from a2v.types import Progress
from pipelines.clock import Clock, stage_of
from pipelines.engine.progress import Update, duration

LIVE_SECONDS = 1.0
"""Seconds between two drawings of the line on a terminal."""
LINE_SECONDS = 10.0
"""Seconds between two lines without a terminal."""


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


class Bars:
    """One line on standard error about a run: the stage in words; after `expect` also the share and
    the remaining time.

    A terminal or a notebook shows one line that changes; elsewhere a line is printed every ten
    seconds, also while no node tells anything.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._clock: Clock | None = None
        self._live = sys.stderr.isatty() or "JPY_PARENT_PID" in os.environ
        self._last: Update | None = None
        self._said = time.monotonic()
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._quiet = quiet
        self._thread = threading.Thread(target=self._watch, daemon=True)
        if not quiet:
            self._thread.start()

    def expect(self, clock: Clock) -> None:
        """Estimate by `clock`, which knows what will run."""
        with self._lock:
            self._clock = clock

    def __call__(self, update: Update) -> None:
        """Take an update."""
        with self._lock:
            self._last = update
            if self._clock is not None:
                self._clock.take(update)

    def text(self) -> str:
        """Return the line."""
        with self._lock:
            if self._last is None:
                return "  0 % starting"
            if self._clock is None:
                return stage_of(self._last)
            said = self._clock.take(self._last)
        share, left = float(str(said["share"])), float(str(said["left"]))
        more = f", about {duration(left)} left" if left >= 1 else ""
        return f"{min(share, 0.99):4.0%} {said['stage']}{more}".replace("%", " %")

    def close(self) -> None:
        """End the line."""
        if self._ended.is_set() or self._quiet:
            return
        self._ended.set()
        self._thread.join()
        if self._live:
            self._print(f"\r{'':<79}\r")

    def _watch(self) -> None:
        while not self._ended.wait(LIVE_SECONDS / 2 if self._live else LINE_SECONDS / 20):
            now = time.monotonic()
            if now - self._said < (LIVE_SECONDS if self._live else LINE_SECONDS):
                continue
            self._said = now
            self._print(f"\r{self.text():<79}" if self._live else f"{self.text()}\n")

    @staticmethod
    def _print(text: str) -> None:
        say(
            text.strip("\r\n"),
            first="\r" * text.startswith("\r"),
            end="\n" * text.endswith("\n") or "\r" * text.endswith("\r"),
        )
