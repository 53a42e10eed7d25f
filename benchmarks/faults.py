"""A batch while things break: workers killed, requests of the object store failing, the scheduler
restarted, a photo damaged.

    python -m benchmarks.faults --folder out/faults --jobs 200 --kill-every 20 --moto
    ENVIRONMENT/bin/python python -m benchmarks.faults --folder out/faults --single-kills 100
    python -m benchmarks.faults --folder out/faults --memory 1000

The first compares every file with those of an undisturbed run; the second kills single runs at
random moments of their whole length and compares what they give in the end; the third follows the
memory of driver and worker over many remembered jobs. The first two end after ``--for`` seconds and
go on where they were by the same command: a batch loses its driver and its cluster then, but not
the object store. An S3 server is started with a Python that has ``moto[s3,server]``; without one
the object store is a folder whose requests do not fail.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import resource
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections import Counter
from pathlib import Path
from typing import Any

from a2v.io import atomic_path, sha256
from a2v.sessions import WEIGHTS

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = WEIGHTS.parent / "samples" / "person.jpg"
ACTIONS = ("Walk", "Jump", "Run", "Dance")
SERVER = """
import random, sys
from moto.server import DomainDispatcherApplication, create_backend_app
from werkzeug.serving import run_simple
application, chance, draw = DomainDispatcherApplication(create_backend_app), float(sys.argv[2]), random.Random(0)
counts = [0, 0]
def failing(environment, start):
    counts[0] += 1
    if draw.random() < chance:
        counts[1] += 1
        start("503 Slow Down", [("Content-Length", "0")])
        return [b""]
    return application(environment, start)
run_simple("127.0.0.1", int(sys.argv[1]), failing, threaded=True)
"""
DASK = "import sys; from distributed.cli import {0}; {0}.main(sys.argv[1:])"
LIGHT = (
    "--fit.rounds",
    2,
    "--fit.steps",
    3,
    "--perception.refine",
    "false",
    "--implicit.resolution",
    200,
    "--implicit.vertices",
    25000,
)
"""Settings with which a person takes a quarter of the time."""
QUIET: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}


def free_port() -> int:
    """Return a free port."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def write_jobs(folder: Path, count: int, people: int) -> Path:
    """Write a table of `count` jobs of `people` people (the sample photo in several brightnesses);
    the last job has a damaged photo."""
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    for number in range(people):
        Image.open(SAMPLE).point(lambda value, more=2 * number: min(value + more, 255)).save(
            folder / f"p{number}.png"
        )
    (folder / "poisoned.png").write_bytes((folder / "p0.png").read_bytes()[:9000])
    rows = [f"p{n % people}.png,{ACTIONS[n % len(ACTIONS)]},{n}" for n in range(count - 1)] + [
        "poisoned.png,Walk,0"
    ]
    (folder / "jobs.csv").write_text("\n".join(["photo,action,seed", *rows, ""]))
    return folder / "jobs.csv"


def batch_command(given: argparse.Namespace, jobs: Path, out: Path, *more: str) -> list[str]:
    """Return the command line of a batch."""
    small = [
        "--frames",
        given.frames,
        "--views",
        "front",
        "--size",
        given.size,
        "--spp",
        1,
        *(LIGHT if given.light else ()),
    ]
    return [
        sys.executable,
        "-m",
        "pipelines",
        "batch",
        str(jobs),
        "--out",
        str(out),
        *map(str, small),
        *more,
    ]


def digests(out: Path) -> dict[str, str]:
    """Return the SHA-256 of every result by its path."""
    names = (
        "video.mp4",
        "front.mp4",
        "character.glb",
        "motion.bvh",
        "motion.npz",
        "preview.html",
        "thumbnail.jpg",
    )
    return {
        str(path.relative_to(out)): sha256(path)
        for path in sorted(out.glob("*/*"))
        if path.name in names
    }


class Cluster:
    """A scheduler and workers, each with its own folder; dead ones are started again, as in a
    cluster.

    Parameters
    ----------
    folder : for the workers' folders
    environment : of the processes
    workers : how many
    """

    def __init__(self, folder: Path, environment: dict[str, str], workers: int) -> None:
        self.address = f"tcp://127.0.0.1:{free_port()}"
        self._folder, self._environment = folder, environment
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._names = ["scheduler", *(f"w{number}" for number in range(workers))]
        self._stop = threading.Event()
        self.restarts = 0
        threading.Thread(target=self._keep, daemon=True).start()

    def _keep(self) -> None:
        while not self._stop.wait(0.5):
            for name in self._names:
                if name not in self._running or self._running[name].poll() is not None:
                    self.restarts += name in self._running
                    self._running[name] = self._start(name)

    def _start(self, name: str) -> subprocess.Popen[bytes]:
        folder = self._folder / name
        folder.mkdir(parents=True, exist_ok=True)
        words = ["--host", self.address, "--no-dashboard", "--no-show"]
        if name != "scheduler":
            words = [
                self.address,
                "--nthreads",
                "1",
                "--no-dashboard",
                "--no-nanny",
                "--name",
                f"{name}-{time.time()}",
            ]
        code = DASK.format("dask_scheduler" if name == "scheduler" else "dask_worker")
        environment = {
            **self._environment,
            "A2V_CACHE": str(folder / "cache"),
            "OMP_NUM_THREADS": "1",
        }
        return subprocess.Popen(
            [sys.executable, "-c", code, *words], cwd=folder, env=environment, **QUIET
        )

    def kill(self, name: str) -> None:
        """Kill one process without warning, as a loss of power would."""
        with contextlib.suppress(KeyError):
            self._running[name].kill()

    def close(self) -> None:
        """End all processes."""
        self._stop.set()
        time.sleep(0.6)
        for process in self._running.values():
            process.kill()
            process.wait()


class Ledger:
    """Figures of a part that may take several runs, in a file.

    Parameters
    ----------
    path : of the file, made when it is first written
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.figures: Counter[str] = Counter(json.loads(path.read_text()) if path.exists() else {})

    def save(self) -> None:
        """Write the figures to the file."""
        with atomic_path(self._path) as temporary:
            temporary.write_text(json.dumps(self.figures))


class ObjectStore:
    """An S3 server that fails a share of all requests and outlives this process, or a folder.

    Parameters
    ----------
    folder : where its port is written down
    moto : a Python that has moto, or None for a folder
    chance : of a request to fail

    Attributes
    ----------
    url : str
    environment : of processes that reach it
    """

    def __init__(self, folder: Path, moto: str | None, chance: float) -> None:
        self.environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        self._process: tuple[int, int] | None = None
        if moto is None:
            self.url = f"file://{folder}/objects"
            return
        self.url, note = "s3://bucket/a2v", folder / "server.json"
        if note.exists():
            process, port = json.loads(note.read_text())
        else:
            port = free_port()
            process = subprocess.Popen(
                [moto, "-c", SERVER, str(port), str(chance)], start_new_session=True, **QUIET
            ).pid
            folder.mkdir(parents=True, exist_ok=True)
            note.write_text(json.dumps([process, port]))
        self._process = process, port
        self._make_bucket(port)
        self.environment |= {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
            "AWS_ALLOW_HTTP": "true",
            "AWS_ACCESS_KEY_ID": "x",
            "AWS_SECRET_ACCESS_KEY": "y",
            "AWS_REGION": "us-east-1",
        }

    @staticmethod
    def _make_bucket(port: int) -> None:
        for _ in range(300):
            with contextlib.suppress(OSError):
                urllib.request.urlopen(
                    urllib.request.Request(f"http://127.0.0.1:{port}/bucket", method="PUT"),
                    timeout=5,
                ).close()
                return
            time.sleep(0.2)
        raise SystemExit(f"no S3 server answers at port {port}; remove the folder and start again")

    def close(self) -> None:
        """End the server; its contents are lost."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._process[0], signal.SIGKILL)


def processor_time() -> float:
    """Return the seconds of all ended child processes, and of theirs."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def one_batch(
    given: argparse.Namespace, jobs: Path, folder: Path, rough: bool, until: float
) -> Ledger:
    """Run a batch on its own cluster, `rough` or not, to its end or `until` the time is over."""
    ledger = Ledger(folder / "ledger.json")
    figures = ledger.figures
    if figures["over"]:
        return ledger
    store = ObjectStore(folder, given.moto, given.failing if rough else 0.0)
    begun, spent = time.monotonic(), processor_time()
    cluster = Cluster(folder, store.environment, given.workers)
    time.sleep(8.0)  # the scheduler is there
    more = ("--executor", "dask", "--address", cluster.address, "--cache", store.url)
    driver = {**store.environment, "A2V_CACHE": str(folder / "driver")}
    process = subprocess.Popen(
        batch_command(given, jobs, folder / "out", *more), cwd=ROOT, env=driver
    )
    draw, last = random.Random(figures["workers killed"]), time.monotonic()
    while process.poll() is None and time.monotonic() < until:
        time.sleep(0.5)
        if rough and time.monotonic() - last > given.kill_every:
            last = time.monotonic()
            figures["workers killed"] += 1
            cluster.kill(f"w{draw.randrange(given.workers)}")
        if (
            rough
            and not figures["schedulers killed"]
            and len(list((folder / "out").glob("*/job.json"))) > given.jobs // 3
        ):
            figures["schedulers killed"] += 1
            cluster.kill("scheduler")
    figures["over"] = process.poll() is not None
    process.kill()
    code = process.wait()
    cluster.close()
    figures["sittings"] += 1
    figures["seconds"] += round(time.monotonic() - begun, 1)
    figures["processor seconds"] += round(processor_time() - spent, 1)
    ledger.save()
    if figures["over"]:
        store.close()
        if code:
            raise SystemExit(f"the batch in {folder} ended with {code}")
    return ledger


def disturbed(given: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Run a batch undisturbed and disturbed on the same kind of cluster; compare the files."""
    jobs = write_jobs(folder / "jobs", given.jobs, given.people)
    until = time.monotonic() + given.seconds
    calm = one_batch(given, jobs, folder / "calm", False, until).figures
    rough = (
        one_batch(given, jobs, folder / "disturbed", True, until).figures if calm["over"] else calm
    )
    settings = {
        name: getattr(given, name)
        for name in ("jobs", "people", "frames", "size", "workers", "kill_every", "light")
    }
    asked = settings | {
        "s3": given.moto is not None,
        "failing requests": given.failing if given.moto else 0.0,
    }
    told = asked | {"undisturbed": dict(calm), "disturbed": dict(rough)}
    if not rough["over"]:
        return told
    calm_files, rough_files = (
        digests(folder / "calm" / "out"),
        digests(folder / "disturbed" / "out"),
    )
    return told | {
        "videos": sum(path.endswith("video.mp4") for path in calm_files),
        "files": len(calm_files),
        "files equal": sum(rough_files.get(path) == digest for path, digest in calm_files.items()),
        "files of one run only": len(set(calm_files) ^ set(rough_files)),
    }


def family_time(process: subprocess.Popen[bytes]) -> float:
    """Return the processor seconds of a process and its living descendants."""
    import psutil

    total = 0.0
    with contextlib.suppress(psutil.Error):
        parent = psutil.Process(process.pid)
        for one in [parent, *parent.children(recursive=True)]:
            with contextlib.suppress(psutil.Error):
                total += sum(one.cpu_times()[:2])
    return total


def stage(store: Path, order: list[str]) -> str:
    """Return the node that a run was at: the first of `order` without a record."""
    return next(
        (name for name in order if not any((store / "calls" / name).rglob("*.json"))), "files"
    )


def single_kills(given: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Kill a run at random moments, resume it, and compare the result with an undisturbed run.

    Moments are drawn in processor time of the run with all its processes, so that a busy machine
    does not shift them.
    """
    small = [
        "--frames",
        given.frames,
        "--views",
        "front",
        "--size",
        given.size,
        "--spp",
        1,
        "--workers",
        1,
        "--quiet",
    ]
    small += LIGHT if given.light else ()

    def start(store: Path, out: Path) -> subprocess.Popen[bytes]:
        words = ["--photo", SAMPLE, "--action", "Walk", "--out", out, "--cache", store, *small]
        return subprocess.Popen(
            [sys.executable, "-m", "pipelines", "video", *map(str, words)],
            cwd=ROOT,
            start_new_session=True,
            **QUIET,
        )

    until, ledger = time.monotonic() + given.seconds, Ledger(folder / "ledger.json")
    figures = ledger.figures
    if not figures["processor seconds of one run"]:
        spent = processor_time()
        assert start(folder / "store", folder / "out").wait() == 0
        figures["processor seconds of one run"] = round(processor_time() - spent, 1)
        ledger.save()
    truth = {
        path.name: sha256(path) for path in (folder / "out").iterdir() if path.name != "report.json"
    }
    records = {
        node.name: [json.loads(path.read_text())["start"] for path in node.rglob("*.json")]
        for node in (folder / "store" / "calls").iterdir()
    }
    order = sorted(records, key=lambda name: min(records[name]))
    while figures["kills"] < given.single_kills and time.monotonic() < until:
        number = figures["runs finished"]
        store, out = folder / f"store{number}", folder / f"out{number}"
        moment = random.Random(figures["kills"]).uniform(0, figures["processor seconds of one run"])
        process = start(store, out)
        while process.poll() is None and family_time(process) < moment:
            time.sleep(0.05)
        if process.poll() is None:
            at = stage(store, order)
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            figures["kills"] += 1
            figures[f"at {at}"] += 1
        else:
            assert process.returncode == 0
            figures["runs finished"] += 1
            figures["runs that differ"] += {
                path.name: sha256(path) for path in out.iterdir() if path.name != "report.json"
            } != truth
            shutil.rmtree(store)
        ledger.save()
    return dict(figures)


def memory(given: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Resident memory of a process that writes many remembered jobs and of one that recalls their
    graphs, every tenth of them."""
    from pipelines.batch.results import write_job
    from pipelines.batch.rows import Row
    from pipelines.batch.tasks import Planner, steps_of
    from pipelines.batch.worker import perform, recall
    from pipelines.engine.store import Store
    from pipelines.requests.video import VideoRequest

    store = Store(folder / "store")
    planner = Planner(store)
    asked = VideoRequest.of(
        photo=SAMPLE, action="Walk", frames=given.frames, views="front", size=given.size, spp=1
    )
    first = planner.job(Row(number=0, request=asked))
    for task in first.tasks:
        if problem := perform(task, store, {}).problem:
            raise SystemExit(problem)
    assert steps_of("video", False)
    sizes: dict[str, list[int]] = {"driver": [], "worker": []}
    seconds: dict[str, float] = {}
    for who in sizes:
        begun = time.perf_counter()
        for number in range(given.memory):
            if who == "driver":
                job = planner.job(Row(number=number, name=f"n{number % 20}", request=asked))
                result = recall(job.tasks[-1], store)
                assert result is not None
                write_job(folder / "out", job, result, store)
            else:
                for path in (store.folder / "calls" / "task_video").rglob("*.json"):
                    path.unlink()
                assert not perform(first.tasks[-1], store, {}).problem
            if number % max(given.memory // 10, 1) == 0:
                sizes[who].append(_resident())
        seconds[who] = time.perf_counter() - begun
    return {
        "jobs": given.memory,
        "frames": given.frames,
        "size": given.size,
        **{f"{who} MB": [round(size / 1e6, 1) for size in sizes[who]] for who in sizes},
        **{f"{who} jobs a second": round(given.memory / seconds[who], 1) for who in sizes},
    }


def _resident() -> int:
    import psutil

    return int(psutil.Process().memory_info().rss)


def main() -> None:
    """Run the requested part and print the result as JSON."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=0)
    parser.add_argument("--people", type=int, default=2)
    parser.add_argument("--workers", type=int, default=4)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--kill-every", type=float, default=20.0)
    parser.add_argument("--failing", type=float, default=0.05)
    parser.add_argument("--moto", help="a Python that has moto[s3,server]")
    parser.add_argument("--single-kills", type=int, default=0)
    parser.add_argument("--memory", type=int, default=0)
    parser.add_argument("--light", action="store_true", help="people at small settings")
    parser.add_argument(
        "--for", type=float, default=1e9, dest="seconds", metavar="SECONDS", help="of a sitting"
    )
    parser.add_argument("--folder", type=Path, required=True)
    given = parser.parse_args()
    parts = {
        "batch": (given.jobs, disturbed),
        "single": (given.single_kills, single_kills),
        "memory": (given.memory, memory),
    }
    for name, (asked, part) in parts.items():
        if asked:
            print(json.dumps({name: part(given, given.folder / name)}), flush=True)


if __name__ == "__main__":
    main()
