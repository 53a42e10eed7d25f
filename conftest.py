"""One store for the whole test run, so that the sample's character is computed once and not by
every test; and which files are fast."""

from __future__ import annotations

import functools
import gc
import os
import shutil
import sys
import tempfile
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path

import pytest

pytest_plugins = ["tests.support.characters", "tests.support.dressed", "tests.support.glb"]

SLOW = Path(__file__).parent / "tests" / "slow.txt"
"""Files of tests that ``--fast`` leaves out, one per line with the seconds that each took."""
FAST_SECONDS = 150.0
"""Processor seconds that the files which ``--fast`` runs took together when the list was made."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options of ``make test-fast`` and ``make slow``."""
    parser.addoption("--fast", action="store_true", help="leave out the files of tests/slow.txt")
    parser.addoption(
        "--note-slow",
        action="store_true",
        help="write tests/slow.txt anew; only with the whole suite",
    )


def pytest_configure(config: pytest.Config) -> None:
    """The controlling process makes the folder; workers and the programs that tests start inherit
    it."""
    os.environ.setdefault("A2V_SMALL", "1")  # notebooks run at their small size
    # hundreds of child processes import what the first of them has compiled
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    if "A2V_CACHE" not in os.environ and not hasattr(config, "workerinput"):
        config.stash[_MADE] = os.environ["A2V_CACHE"] = tempfile.mkdtemp(prefix="a2v-tests-")
    config.pluginmanager.register(_Processor())
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(_Spent(write=config.getoption("--note-slow")))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove what was made."""
    if made := config.stash.get(_MADE, None):
        os.environ.pop("A2V_CACHE", None)
        shutil.rmtree(made, ignore_errors=True)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """With ``--fast`` the listed files are not even imported."""
    if not config.getoption("--fast"):
        return None
    return True if _name(collection_path) in _slow_files() else None


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the slowest files: so that no worker is left alone with one of them at the end."""
    slow = _slow_files()
    items.sort(key=lambda item: -slow.get(_name(item.path), 0.0))


def pytest_collection_finish() -> None:
    """Let the garbage collector skip what was imported, and run seldom: it took a tenth of the
    time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 10, 10)


@functools.cache
def _name(path: Path) -> str:
    root = SLOW.parents[1]
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else ""


@functools.cache
def _slow_files() -> dict[str, float]:
    """Seconds of the slow files by name."""
    lines = (line.split() for line in SLOW.read_text().splitlines() if not line.startswith("#"))
    return {name: float(seconds) for name, seconds in lines}


class _Processor:
    """Adds to each report the processor seconds of this process and its ended children since the
    last one; unlike durations they depend little on what else runs."""

    def __init__(self) -> None:
        self.last = sum(os.times()[:4])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        now = sum(os.times()[:4])
        report.processor, self.last = now - self.last, now
        return report


class _Spent:
    """Processor seconds per file, fixtures included; their sum is printed, and with `write` those
    that are not among the quickest of `FAST_SECONDS` together are listed."""

    def __init__(self, *, write: bool) -> None:
        self.seconds, self.write = defaultdict[str, float](float), write

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.seconds[report.nodeid.partition("::")[0]] += getattr(report, "processor", 0.0)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        minutes = sum(self.seconds.values()) / 60
        terminalreporter.write_line(f"processor time of these tests: {minutes:.1f} min")

    def pytest_sessionfinish(self) -> None:
        if not self.write:
            return
        total, slow = 0.0, list[tuple[str, float]]()
        for name, seconds in sorted(self.seconds.items(), key=lambda item: item[1]):
            total += seconds
            if total > FAST_SECONDS:
                slow.append((name, seconds))
        lines = [
            f"{name} {seconds:.0f}" for name, seconds in sorted(slow, key=lambda item: -item[1])
        ]
        SLOW.write_text(
            "# Written by `make slow`: files that `make test-fast` leaves out, and their processor "
            "seconds.\n" + "\n".join(lines) + "\n"
        )


_MADE = pytest.StashKey[str]()
