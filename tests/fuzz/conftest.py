"""Number of tried cases: few fixed ones in the suite, many new ones with `make fuzz`."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.configuration import set_hypothesis_home_dir

from tests.support.hostile import COUNT, TALLIES, Tally

settings.register_profile(
    "a2v",
    max_examples=COUNT or 40,
    derandomize=not COUNT,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
settings.load_profile("a2v")
set_hypothesis_home_dir(tempfile.gettempdir())


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Report how many cases were tried."""
    whole = Tally()
    for tally in TALLIES.values():
        whole.add(tally)
    if not whole.cases:
        return
    said = f"{whole.cases:,} hostile inputs: {whole.refused:,} refused in a sentence, the slowest took {whole.slowest:.1f} s of processor time, none more than {whole.megabytes:.0f} MB; {whole.files:,} files were written, all whole; {whole.deleted:,} photos and videos were deleted, nothing of them left"
    terminalreporter.write_line(said)
    if path := os.environ.get("A2V_FUZZ_REPORT"):
        failed = [
            report.nodeid.split("::")[-1] for report in terminalreporter.stats.get("failed", [])
        ]
        rows = [
            f"| {name} | {one.cases:,} | {one.refused:,} | {one.slowest:.2f} | {one.megabytes:.0f} "
            f"| {one.files:,} | {one.deleted:,} |"
            for name, one in sorted(TALLIES.items())
        ]
        head = [
            "| test | inputs | refused | slowest, s | MB at most | files written | deleted |",
            "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
        ]
        Path(path).write_text(
            "\n".join([f"{said}; failed: {', '.join(failed) or 'none'}.", "", *head, *rows, ""]),
            encoding="utf-8",
        )
