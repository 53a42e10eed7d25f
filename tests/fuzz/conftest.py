"""Number of tried cases: few fixed ones in the suite, many new ones with `make fuzz`."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import asdict
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
    terminalreporter.write_line(whole.sentence())
    if path := os.environ.get("A2V_FUZZ_REPORT"):
        failed = [
            report.nodeid.split("::")[-1] for report in terminalreporter.stats.get("failed", [])
        ]
        tests = {name: asdict(tally) for name, tally in TALLIES.items()}
        Path(path).write_text(json.dumps({"failed": failed, "tests": tests}), encoding="utf-8")
