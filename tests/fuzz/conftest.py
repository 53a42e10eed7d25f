"""How many cases are tried: few in the suite, always the same; `make fuzz` tries many new ones (A2V_FUZZ a reader)."""

from __future__ import annotations

import os
import tempfile

from hypothesis import HealthCheck, settings
from hypothesis.configuration import set_hypothesis_home_dir

COUNT = int(os.environ.get("A2V_FUZZ", "0"))
settings.register_profile(
    "a2v", max_examples=COUNT or 40, derandomize=not COUNT, database=None, deadline=None, suppress_health_check=list(HealthCheck)
)
settings.load_profile("a2v")
set_hypothesis_home_dir(tempfile.gettempdir())
