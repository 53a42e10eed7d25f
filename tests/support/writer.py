"""A child process of the page that only writes files, in many steps, as the real ones do.

It imports little, because each of hundreds of removed people ends it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from a2v.io import atomic_path
from pipelines.serve.talk import Tell, answer

WRITER = "from tests.support.writer import write; write()"
STEPS = 60
STEP_SECONDS = 0.005


def write() -> None:
    """Run as the child process."""
    answer(_work)


def _work(task: Mapping[str, Any], tell: Tell) -> dict[str, object] | None:
    if task["task"] == "warm":
        return None
    if task["task"] in ("open", "look", "person", "video", "outline", "export", "play"):
        _work.folder = Path(task["folder"])  # type: ignore[attr-defined]
    folder: Path = _work.folder  # type: ignore[attr-defined]
    for number in range(STEPS):
        with atomic_path(folder / "deep" / str(number % 3) / f"{number}.glb") as temporary:
            temporary.write_bytes(b"a person")
        time.sleep(STEP_SECONDS)
    if task["task"] == "look":
        return {"landmarks": [], "warnings": [], "people": []}
    return {"files": {"deep/0/0.glb": 8}, "notes": [], "times": {}, "known": True}
