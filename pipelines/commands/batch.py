"""``a2v batch``: make the videos of a table of jobs."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from a2v.io import say
from pipelines.answer import Answer
from pipelines.batch.results import is_over, write_job, write_tables
from pipelines.batch.rows import defaults, read_rows
from pipelines.batch.schedule import Schedule, Watch
from pipelines.batch.tasks import Job, Planner, Result, Task
from pipelines.commands.cache import parse_size
from pipelines.engine.progress import Lasting
from pipelines.engine.store import Store
from pipelines.graph import video_graph
from pipelines.inputs import RunOptions, check_writable
from pipelines.options import flag, group, option
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import PersonStages

HELP = "Make the videos of a table of jobs. Each person and each motion is computed once."
EXAMPLES = """examples:
  a2v batch jobs.csv --out out                               one job per line; the first line names the columns
  a2v batch jobs.yaml --out out --frames 90 --views front    options given here apply to all rows that do not set them
  a2v batch jobs.csv --out out --retry-failed                repeat failed jobs
  a2v batch jobs.csv --out out --workers 8 --limit-memory 12GB
  a2v batch jobs.csv --out out --cache s3://bucket/a2v --executor dask --address tcp://scheduler:8786

  jobs.csv:                        jobs.yaml:
    photo,action,seed                - {photo: anna.jpg, action: Walk, seed: 4}
    anna.jpg,Walk,4                  - {photo: ben.jpg, action: "Walk,Jump", views: front, frames: 120}
    ben.jpg,"Walk,Jump",

Columns are name and the options of a2v video that this help shows. The folder gets one folder per job (what a2v video writes, and
job.json), results.csv and index.html. A failed job does not stop the others. The same command continues an interrupted run."""

TABLES_EVERY = 30.0
"""Minimum seconds between two writes of the tables."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    jobs: str = option("table of jobs, a CSV or YAML file", names=("jobs",), metavar="FILE")
    out: str = option("folder to write to")
    motion: MotionRequest = group(MotionRequest, "the motion")
    film: FilmRequest = group(FilmRequest, "the film")
    retry_failed: bool = flag("repeat jobs that failed in an earlier run")
    limit_memory: str | None = option(
        "start no further job while all processes together use more memory than this, such as 8GB",
        default=None,
        metavar="SIZE",
    )
    stages: PersonStages = group(PersonStages, "the people")
    running: RunOptions = group(RunOptions, "execution")


def run(options: Options) -> Answer:
    """Run the unfinished jobs. The overview page is written first."""
    limit = parse_size(options.limit_memory) if options.limit_memory else None
    rows = read_rows(options.jobs, defaults(options.stages, options.motion, options.film))
    out, store = check_writable(options.out), _store(options.running.cache)
    store.prepare()
    planner = Planner(store)
    jobs = {job.name: job for job in map(planner.job, rows)}
    left = {
        job.name: job
        for job in jobs.values()
        if not is_over(out, job, retry_failed=options.retry_failed)
    }
    with Lasting("videos", len(left), quiet=options.running.quiet) as shown:
        book = _Book(out, store, left.values(), shown)
        for job in left.values():
            if not job.tasks:
                book.close(job, Result(problem=job.row.problem))
        schedule = Schedule(store, options.running, limit=limit, done=book.done, tick=book.tick)
        try:
            schedule.run(_in_order(left.values()))
        finally:
            counts = write_tables(out)
    say(
        f"{len(rows)} jobs: {len(jobs) - len(left)} were finished already, {book.made} were made, "
        f"{book.failed} failed; {out} holds {counts['done']} videos and {counts['failed']} failures"
    )
    numbers = {
        "jobs": len(rows),
        "over_before": len(jobs) - len(left),
        "made": book.made,
        "failed": book.failed,
    }
    return Answer(
        files=[out / "index.html", out / "results.csv"], text=str(out / "index.html"), facts=numbers
    )


def _store(cache: str | None) -> Store:
    """Open the store.

    If workers share only an object store, results per frame stay on the worker.
    """
    store = Store(cache)
    if store.remote is None:
        return store
    return Store(
        store.address, private=[step.node.name for step in video_graph() if "t" in step.axes]
    )


def _in_order(jobs: Iterable[Job]) -> list[Task]:
    """Return the tasks without duplicates: people, then motions, then videos."""
    given = [job.tasks for job in jobs if job.tasks]
    return [tasks[place] for place in range(3) for tasks in given]


class _Book:
    """Records the results of jobs while they run."""

    def __init__(self, out: Path, store: Store, jobs: Iterable[Job], shown: Lasting) -> None:
        self._out, self._store, self._shown = out, store, shown
        self._jobs: dict[str, list[Job]] = {}
        for job in jobs:
            if job.tasks:
                self._jobs.setdefault(job.tasks[-1].key, []).append(job)
        self.made = self.failed = 0
        self._next = time.monotonic() + TABLES_EVERY

    def done(self, task: Task, result: Result) -> None:
        """Record the result of a task."""
        for job in self._jobs.pop(task.key, []):
            self.close(job, result)

    def close(self, job: Job, result: Result) -> None:
        """Write the files and the record of a job."""
        write_job(self._out, job, result, self._store)
        self.made, self.failed = (
            self.made + (not result.problem),
            self.failed + bool(result.problem),
        )
        if result.problem:
            self._shown.say(f"{job.name}: {result.problem}")

    def tick(self, watch: Watch) -> None:
        """Show the progress; write the tables from time to time."""
        self._shown.update(
            self.made + self.failed,
            watch.remaining(),
            f"{watch.left['person']} people, {watch.left['motion']} motions left",
        )
        if time.monotonic() > self._next:
            begun = time.monotonic()
            write_tables(self._out)
            self._next = time.monotonic() + max(TABLES_EVERY, 100 * (time.monotonic() - begun))
