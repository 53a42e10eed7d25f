"""Small batches, and schedules of tasks without a graph."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipelines.batch import schedule, tasks
from pipelines.batch.schedule import Schedule
from pipelines.batch.tasks import Result, Task
from pipelines.cli import main
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions

SMALL = [
    "--frames",
    "2",
    "--views",
    "front",
    "--size",
    "48",
    "--spp",
    "1",
    "--executor",
    "serial",
    "--quiet",
]


def batch(jobs: Path, out: Path, *more: str) -> int:
    return main(["batch", str(jobs), "--out", str(out), *SMALL, *more])


def task(key: str, kind: tasks.Kind = "video", after: tuple[str, ...] = ()) -> Task:
    return Task(kind, key, {}, False, after)


def drive(
    monkeypatch, tmp_path: Path, given: list[Task], answer: Callable[..., Result], **options: Any
) -> dict[str, Result]:
    over: dict[str, Result] = {}
    monkeypatch.setattr(schedule, "perform", answer)
    running = RunOptions(executor=options.pop("executor", "serial"), workers=2, cache=str(tmp_path))
    plan = Schedule(
        Store(tmp_path),
        running,
        limit=options.pop("limit", None),
        done=lambda one, result: over.update({one.key: result}),
        tick=str,
    )
    plan.run(given)
    assert set(over) == {one.key for one in given}
    return over


def dies_once(task: Task, store: Store, likeness: object) -> Result:
    mark = store.folder / f"{task.key}.died"
    if task.key == "always" or not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return Result(seconds=1.0)
