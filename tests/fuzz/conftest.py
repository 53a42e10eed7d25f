"""How many cases are tried: few in the suite, always the same; `make fuzz` tries many new ones (A2V_FUZZ a reader)."""

from __future__ import annotations

import tempfile

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.configuration import set_hypothesis_home_dir

from tests.support.hostile import COUNT, TALLY

settings.register_profile(
    "a2v", max_examples=COUNT or 40, derandomize=not COUNT, database=None, deadline=None, suppress_health_check=list(HealthCheck)
)
settings.load_profile("a2v")
set_hypothesis_home_dir(tempfile.gettempdir())


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say how much was tried."""
    if TALLY.cases:
        terminalreporter.write_line(
            f"{TALLY.cases:,} hostile inputs: the slowest took {TALLY.slowest:.1f} s of processor time, none more than {TALLY.megabytes:.0f} MB"
        )
