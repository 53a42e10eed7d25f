"""``a2v batch``: results are made once, failures stop nothing, runs resume, tables list all."""

from __future__ import annotations

import csv
import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest

from a2v.errors import A2VError
from a2v.io import sha256
from pipelines.batch import schedule, worker
from pipelines.batch.results import write_tables
from pipelines.batch.schedule import SeparateWorkers, Watch
from pipelines.batch.tasks import Result, Task
from pipelines.batch.worker import perform
from pipelines.engine.store import Store
from tests.support.batches import batch, dies_once, drive, task

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"


def records(out: Path) -> dict[str, dict[str, Any]]:
    found = [json.loads(path.read_text()) for path in out.glob("*/job.json")]
    return {record["name"]: record for record in found}


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> tuple[Path, Path]:
    """A batch of jobs, of which three fail, and its folder.

    Of the other three, two share their person, and one is given twice.
    """
    folder = tmp_path_factory.mktemp("batch")
    shutil.copy(SAMPLE, folder / "me.jpg")
    (folder / "poisoned.jpg").write_bytes(SAMPLE.read_bytes()[:5000])
    jobs = folder / "jobs.csv"
    jobs.write_text(
        "name,photo,action,seed\nwalk,me.jpg,Walk,0\njump,me.jpg,Jump,1\nagain,me.jpg,Walk,0\npoisoned,poisoned.jpg,Walk,0\n"
        "missing,nobody.jpg,Walk,0\nunknown,me.jpg,Quidditch,0\n"
    )
    assert batch(jobs, folder / "out") == 0
    return jobs, folder / "out"


def test_what_fails_stops_nothing_and_is_told(made):
    _, out = made
    found = records(out)
    assert {name: record["status"] for name, record in found.items()} == {
        "walk": "done",
        "jump": "done",
        "again": "done",
        "poisoned": "failed",
        "missing": "failed",
        "unknown": "failed",
    }
    assert "does not exist" in found["missing"]["problem"]
    assert "'Quidditch'" in found["unknown"]["problem"]
    assert "damaged" in found["poisoned"]["problem"]
    assert not any(record["trace"] for record in found.values())
    for name in ("walk", "jump", "again"):
        assert {
            "video.mp4",
            "front.mp4",
            "character.glb",
            "motion.bvh",
            "motion.npz",
            "preview.html",
            "thumbnail.jpg",
        } == set(found[name]["files"])
    assert sha256(out / found["walk"]["folder"] / "video.mp4") == sha256(
        out / found["again"]["folder"] / "video.mp4"
    )
    assert sha256(out / found["walk"]["folder"] / "video.mp4") != sha256(
        out / found["jump"]["folder"] / "video.mp4"
    )


def test_the_tables_hold_every_job(made):
    _, out = made
    with open(out / "results.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["name"]: row["status"] for row in rows} == {
        name: record["status"] for name, record in records(out).items()
    }
    page = (out / "index.html").read_text()
    assert page.count("<img ") == 3
    assert page.count('class="failed"') == 3


def test_a_table_page_quotes_what_users_write(tmp_path):
    record = {
        "folder": "a",
        "status": "failed",
        "name": "<script>",
        "photo": "=1+1",
        "problem": "<b>",
        "files": {},
    }
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "job.json").write_text(json.dumps(record))
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "job.json").write_text("half")
    assert write_tables(tmp_path) == {"done": 0, "failed": 1}
    assert "<b>" not in (tmp_path / "index.html").read_text()
    assert "'=1+1" in (tmp_path / "results.csv").read_text()


@pytest.fixture
def performed(monkeypatch) -> list[str]:
    """Kinds of the tasks that were given to a worker."""
    seen: list[str] = []

    def watched(task: Task, store: Store, likeness) -> Result:
        seen.append(task.kind)
        return perform(task, store, likeness)

    monkeypatch.setattr(schedule, "perform", watched)
    return seen


def test_again_does_nothing_and_another_folder_recalls(made, tmp_path, performed):
    jobs, out = made
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.mp4")}
    assert batch(jobs, out) == 0
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.mp4")} == before
    assert performed == []
    assert batch(jobs, tmp_path / "other") == 0
    assert performed == ["person"]  # the poisoned one: failures are not remembered in the store
    assert {path.name: sha256(path) for path in out.rglob("*.bvh")} == {
        path.name: sha256(path) for path in (tmp_path / "other").rglob("*.bvh")
    }


def test_a_lost_file_is_made_again_and_failures_are_tried_on_demand(made, tmp_path):
    jobs, out = made
    copy = tmp_path / "out"
    shutil.copytree(out, copy)
    found = records(copy)
    (copy / found["walk"]["folder"] / "video.mp4").write_bytes(b"")
    (copy / found["unknown"]["folder"] / "job.json").write_text("{")
    stamp = (copy / found["poisoned"]["folder"] / "job.json").stat().st_mtime_ns
    assert batch(jobs, copy) == 0
    assert sha256(copy / found["walk"]["folder"] / "video.mp4") == sha256(
        out / found["walk"]["folder"] / "video.mp4"
    )
    assert records(copy)["unknown"]["status"] == "failed"
    assert (copy / found["poisoned"]["folder"] / "job.json").stat().st_mtime_ns == stamp
    assert batch(jobs, copy, "--retry-failed") == 0
    assert (copy / found["poisoned"]["folder"] / "job.json").stat().st_mtime_ns > stamp


# --- the schedule, on tasks without a graph


def good(task: Task, store: Store, likeness: object) -> Result:
    return Result(seconds=1.0)


def bad(task: Task, store: Store, likeness: object) -> Result:
    return Result(problem=f"{task.key} is bad") if task.key == "p" else Result(seconds=1.0)


def strange(task: Task, store: Store, likeness: object) -> Result:
    return Result(problem="worker x runs other code", strange=True)


def test_jobs_of_a_failed_person_fail_with_its_reason_and_others_go_on(monkeypatch, tmp_path):
    given = [
        task("p", "person"),
        task("q", "person"),
        task("a", after=("p",)),
        task("b", after=("p", "a")),
        task("c", after=("q", "gone")),
    ]
    over = drive(monkeypatch, tmp_path, given, bad)
    assert {key for key, result in over.items() if result.problem == "p is bad"} == {"p", "a", "b"}


def test_a_worker_that_dies_takes_only_its_own_task(monkeypatch, tmp_path):
    monkeypatch.setattr(schedule, "LOSSES", 3)
    over = drive(
        monkeypatch,
        tmp_path,
        [task(name) for name in ("a", "b", "always", "c")],
        dies_once,
        executor="local",
    )
    assert {key for key, result in over.items() if result.problem} == {"always"}
    assert "memory" in over["always"].problem


def test_one_task_at_least_runs_however_little_memory_is_allowed(monkeypatch, tmp_path):
    assert (
        len(
            drive(
                monkeypatch,
                tmp_path,
                [task(str(n)) for n in range(5)],
                good,
                executor="local",
                limit=1,
            )
        )
        == 5
    )


def test_a_worker_that_runs_something_else_stops_the_batch(monkeypatch, tmp_path):
    with pytest.raises(A2VError, match="other code"):
        drive(monkeypatch, tmp_path, [task("a")], strange)
    result = perform(
        task("a"), Store(tmp_path), worker.own_likeness() | {"the weights person.onnx": "0" * 40}
    )
    assert result.strange
    assert "the weights person.onnx" in result.problem


def test_the_time_left_follows_what_was_measured():
    watch = Watch(workers=2)
    watch.left.update({"video": 10})
    before = watch.remaining()
    watch.take("video", 4.0)
    watch.take("video", 0.0)
    assert watch.remaining() == 8 * 4.0 / 2 < before


def test_workers_of_their_own_are_used_again():
    pool = SeparateWorkers(2)
    try:
        first = pool.submit(os.getpid).result()
        assert pool.submit(os.getpid).result() == first
        pool.rest()
        assert pool.submit(os.getpid).result() != first
    finally:
        pool.shutdown()


def test_a_task_is_given_up_when_it_dies_more_often_than_others_not_where_all_do():
    alone, among, two = schedule.Losses(), schedule.Losses(), schedule.Losses()
    for number in range(schedule.LOSSES):
        assert not alone.hopeless("a")
        alone.flew("a", 20.0, lost=True)
        alone.flew(f"b{number}", 200.0, lost=False)
    assert alone.hopeless("a")
    for number in range(12):  # workers are killed in every task
        among.flew("a", 60.0, lost=True)
        among.flew(f"b{number}", 60.0, lost=True)
        assert not among.hopeless("a")
    for _ in range(schedule.LOSSES + 4):  # two that run out of memory among many that do not
        two.flew("a", 10.0, lost=True)
        two.flew("b", 10.0, lost=True)
        for number in range(10):
            two.flew(f"c{number}", 10.0, lost=False)
    assert two.hopeless("a")
    assert two.hopeless("b")
    for _ in range(30):
        among.flew("a", 1e6, lost=True)
    assert among.hopeless("a")
