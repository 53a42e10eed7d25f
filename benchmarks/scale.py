"""Estimate the cost of many videos: measure a small batch, and simulate the scheduler with its
times.

    python -m benchmarks.scale --folder out/scale --people 50 --actions 3 --frames 8 --size 128
    --light python -m benchmarks.scale --simulate
    python -m benchmarks.scale --folder out/scale --nodes 10000

The first makes a batch of `--sample` people on one worker with every request to the object store
counted, then one of `--people` on `--workers` with an empty store, and compares its time with
simulations from the sample's times of tasks and from its own. The second simulates a thousand
people with ten actions each from `DEFAULTS`. The third runs a graph of that number of remembered
nodes, and gives the engine's time per node.
"""

from __future__ import annotations

import argparse
import heapq
import json
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Costs:
    """Costs of a task of each kind (person, motion, video).

    Attributes
    ----------
    seconds : of one worker with one core
    requests : to the object store
    megabytes : sent to the object store
    driver : seconds of the driver for a finished video
    latency : seconds of one request
    """

    seconds: tuple[float, float, float]
    requests: tuple[int, int, int]
    megabytes: tuple[float, float, float]
    driver: float
    latency: float


DEFAULTS = Costs(
    seconds=(35.0, 0.6, 195.0),
    requests=(48, 9, 67),
    megabytes=(67.4, 0.01, 5.8),
    driver=0.06,
    latency=0.03,
)
"""`a2v video` at its defaults (60 frames, four views, 512 px) from docs/pipeline.md, a person's on
one core, requests and bytes as `measure` counted them at 8 frames of one view."""


def simulate(people: int, actions: int, workers: int, costs: Costs) -> dict[str, float]:
    """Return the hours of a batch in the order of `pipelines.batch`: people, motions (one per
    action), videos that wait for both."""
    lasting = [
        second + requests * costs.latency
        for second, requests in zip(costs.seconds, costs.requests, strict=True)
    ]
    free = [0.0] * workers
    heapq.heapify(free)
    driver = 0.0

    def place(ready: float, kind: int) -> float:
        begun = max(heapq.heappop(free), ready)
        heapq.heappush(free, begun + lasting[kind])
        return begun + lasting[kind]

    person = [place(0.0, 0) for _ in range(people)]
    motion = [place(0.0, 1) for _ in range(actions)]
    ends = sorted(
        place(max(person[p], motion[a]), 2) for p in range(people) for a in range(actions)
    )
    for end in ends:
        driver = max(driver, end) + costs.driver
    counts = (people, actions, people * actions)
    total = max(driver, ends[-1])
    return {
        "workers": workers,
        "hours": round(total / 3600, 2),
        "efficiency": round(
            sum(n * s for n, s in zip(counts, costs.seconds, strict=True)) / (total * workers), 3
        ),
        "requests": sum(n * r for n, r in zip(counts, costs.requests, strict=True)),
        "requests a second": round(
            sum(n * r for n, r in zip(counts, costs.requests, strict=True)) / total, 2
        ),
        "GB sent": round(sum(n * m for n, m in zip(counts, costs.megabytes, strict=True)) / 1e3, 1),
        "driver busy": round(counts[2] * costs.driver / total, 4),
    }


def measure(given: argparse.Namespace) -> dict[str, Any]:
    """Make a batch one by one, count its requests, and again on several workers; compare with the
    simulation."""
    from PIL import Image

    from benchmarks.faults import ACTIONS, LIGHT, SAMPLE, write_jobs
    from pipelines.batch.results import write_job
    from pipelines.batch.rows import Row, read_rows
    from pipelines.batch.schedule import Schedule
    from pipelines.batch.tasks import Job, Planner, Result, Task
    from pipelines.engine.remote import Remote
    from pipelines.engine.store import Store
    from pipelines.graph import video_graph
    from pipelines.inputs import RunOptions
    from pipelines.options import parse
    from pipelines.requests.person import PersonStages
    from pipelines.requests.video import VideoRequest

    photos = write_jobs(given.folder, 2, 1).parent
    for number in range(given.people):
        Image.open(SAMPLE).point(lambda value, more=number: min(value + more, 255)).save(
            photos / f"p{number}.png"
        )
    rows = [f"p{p}.png,{ACTIONS[a]}" for p in range(given.people) for a in range(given.actions)]
    (photos / "jobs.csv").write_text("\n".join(["photo,action", *rows, ""]))
    words = list(map(str, LIGHT)) if given.light else []
    stages = (
        parse(PersonStages, words, command="scale", about="people", examples="")
        if words
        else PersonStages()
    )
    person = stages.with_photo("")
    asked = VideoRequest(person=person).changed(
        frames=given.frames, views="front", size=given.size, spp=1
    )
    read = read_rows(photos / "jobs.csv", asked)
    few = read[: given.sample * given.actions]
    requests: Counter[str] = Counter()
    sent: Counter[str] = Counter()
    now = ["person"]
    for name in ("exists", "fetch", "put"):
        _count(Remote, name, requests, sent, now)

    def go(
        name: str, rows: list[Row], executor: str, workers: int
    ) -> tuple[float, dict[str, list[float]], float]:
        private = [step.node.name for step in video_graph() if "t" in step.axes]
        store = Store(f"file://{given.folder.absolute()}/objects-{name}", private)
        planner = Planner(store)
        jobs: dict[str, Job] = {job.tasks[-1].key: job for job in map(planner.job, rows)}
        spent: dict[str, list[float]] = {"person": [], "motion": [], "video": []}
        writing = [0.0]

        def done(task: Task, result: Result) -> None:
            assert not result.problem, result.problem
            spent[task.kind].append(result.seconds)
            now[0] = (
                {"person": "motion", "motion": "video"}.get(task.kind, "video")
                if not left[task.kind]
                else task.kind
            )
            if task.kind == "video":
                begun = time.perf_counter()
                write_job(given.folder / f"out-{name}", jobs[task.key], result, store)
                writing[0] += time.perf_counter() - begun

        order = {
            task.key: task
            for place in range(3)
            for job in jobs.values()
            for task in [job.tasks[place]]
        }
        left = Counter(task.kind for task in order.values())

        def counted(task: Task, result: Result) -> None:
            left[task.kind] -= 1
            done(task, result)

        plan = Schedule(
            store,
            RunOptions(executor=executor, workers=workers),
            limit=None,
            done=counted,
            tick=lambda watch: None,
        )  # type: ignore[arg-type]
        begun = time.perf_counter()
        plan.run(order.values())
        return time.perf_counter() - begun, spent, writing[0] / len(jobs)

    def costs(of: dict[str, list[float]], workers: int) -> float:
        each = tuple(sum(values) / len(values) for values in of.values())
        return (
            simulate(
                given.people, given.actions, workers, Costs(each, (0, 0, 0), (0, 0, 0), driver, 0.0)
            )["hours"]
            * 3600
        )

    counts = {"person": len(few) // given.actions, "motion": given.actions, "video": len(few)}
    alone, spent, driver = go("alone", few, "serial", 1)
    per_kind = {
        kind: (round(requests[kind] / counts[kind]), round(sent[kind] / counts[kind] / 1e6, 3))
        for kind in counts
    }
    wall, together, _ = go("together", read, "local", given.workers)
    return {
        "people": given.people,
        "actions": given.actions,
        "frames": given.frames,
        "size": given.size,
        "light": given.light,
        "seconds alone": {
            kind: [round(value, 2) for value in values] for kind, values in spent.items()
        },
        "wall alone": round(alone, 1),
        "requests and MB sent each": per_kind,
        "driver seconds a video": round(driver, 3),
        "mean seconds together": {
            kind: round(sum(values) / len(values), 2) for kind, values in together.items()
        },
        "workers": given.workers,
        "wall": round(wall, 1),
        "wall as simulated from the sample": round(costs(spent, given.workers), 1),
        "wall as simulated from its own times": round(costs(together, given.workers), 1),
    }


def overhead(folder: Path, nodes: int) -> dict[str, Any]:
    """Return the processor time of a graph of about `nodes` nodes, computed and then remembered. It
    has the shape of the real graph; its values are small numbers."""
    from pipelines.engine.run import run
    from pipelines.engine.store import Store
    from tests.support.numbers import GRAPH, Scale

    views, spent = (0, 1, 2, 3), []
    length = nodes // (1 + len(views))
    for _ in range(2):
        begun, clock = time.process_time(), time.perf_counter()
        outcome = run(
            "total",
            graph=GRAPH,
            store=Store(folder / "nodes"),
            executor="serial",
            length=length,
            scale=Scale(),
            views=views,
            wait=0.0,
        )
        calls = sum(stats.calls for stats in outcome.nodes.values())
        cached = sum(stats.cached for stats in outcome.nodes.values())
        spent.append(
            {
                "nodes": calls,
                "remembered": cached,
                "processor seconds": round(time.process_time() - begun, 2),
                "seconds": round(time.perf_counter() - clock, 2),
                "ms a node": round((time.process_time() - begun) / calls * 1e3, 3),
            }
        )
    return {"computed": spent[0], "remembered": spent[1]}


def _count(
    kind: type, name: str, requests: Counter[str], sent: Counter[str], now: list[str]
) -> None:
    real = getattr(kind, name)

    def counted(self: Any, key: str, *data: bytes) -> Any:
        requests[now[0]] += 1
        sent[now[0]] += sum(map(len, data))
        return real(self, key, *data)

    setattr(kind, name, counted)


def main() -> None:
    """Measure or simulate; prints JSON."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--people", type=int, default=2)
    parser.add_argument("--sample", type=int, default=2)
    parser.add_argument("--light", action="store_true", help="people at small settings")
    parser.add_argument("--actions", type=int, default=3)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--nodes", type=int, default=0)
    parser.add_argument("--simulate", action="store_true")
    given = parser.parse_args()
    if given.simulate:
        for workers in (1, 10, 100, 1000, 4000):
            print(json.dumps(simulate(1000, 10, workers, DEFAULTS)))
    if given.folder and given.nodes:
        print(json.dumps(overhead(given.folder, given.nodes), indent=1))
    elif given.folder:
        given.folder.mkdir(parents=True, exist_ok=True)
        print(json.dumps(measure(given), indent=1))


if __name__ == "__main__":
    main()
