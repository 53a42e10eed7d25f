"""The page under many clients that upload, cancel, delete, disconnect and send rubbish, while its
workers are killed and the disk gets full.

    nice -n 10 python -m benchmarks.soak --folder out/soak --minutes 60 --clients 50 --kills 10
    --full 2 --seed 0

Everything goes to 127.0.0.1. The folder and the store lie on a separate small file system (a tmpfs,
which needs root; without root the disk is never full). Afterwards the page must answer, list its
contents, make a video, and hold nothing of removed people; its memory is compared with what it had
after the first two minutes under the same load. Prints one JSON object; exits with 1 where a check
fails.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
from PIL import Image

from tests.support.page import ROOT, Server
from tests.support.uploads import hostile_uploads

SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"
WISH = {
    "action": "Walk",
    "model": "cmu",
    "seconds": 0.4,
    "fps": 12,
    "size": 64,
    "spp": 1,
    "views": ["front"],
}
"""The smallest possible video."""
DISK_BYTES = 900 << 20
WARM_SECONDS = 120.0
SETTLED_SECONDS = 140.0
"""Seconds after a removal until the remains of stopped computations are gone
(`pipelines.serve.desk`)."""
RUBBISH: tuple[object, ...] = (
    None,
    [],
    {},
    "Walk",
    {"photo": "x"},
    {"wish": {"action": "Walk\ud800"}},
    {"model": "cmu", "text": "\udfff"},
    {"photo": [], "wish": []},
    [[[[]]]],
    {"photo": "../..", "wish": {"action": "Walk", "size": 10**9}},
    {"model": "cmu", "text": "\x00\u202e" * 99},
    {"text": "z" * 60000},
)


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[bool]:
    """Mount a file system of `DISK_BYTES` at `folder`; return whether it worked."""
    folder.mkdir(parents=True, exist_ok=True)
    mounted = (
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={DISK_BYTES}", "none", str(folder)], check=False
        ).returncode
        == 0
    )
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", "-l", str(folder)], check=False)


class Client(threading.Thread):
    """A client that performs random actions one after the other until it is stopped.

    Parameters
    ----------
    number : names the photos that are their own
    until : time to stop, `time.monotonic`
    figures : number of each kind of answer, shared by all clients
    """

    def __init__(
        self, server: Server, number: int, seed: int, until: float, figures: Counter[str]
    ) -> None:
        super().__init__(daemon=True)
        self._server, self._until, self._figures = server, until, figures
        self._draw = random.Random(f"{seed} {number}")
        self._hostile = hostile_uploads()
        self._acts: dict[Callable[[], None], float] = {
            self._upload: 3,
            self._order: 3,
            self._cancel: 3,
            self._remove: 3,
            self._rubbish: 4,
            self._hang_up: 4,
            self._poll: 8,
            self._download: 1,
            self._idle: 2,
        }

    def run(self) -> None:
        """Run the client."""
        while time.monotonic() < self._until:
            act = self._draw.choices(list(self._acts), list(self._acts.values()))[0]
            try:
                act()
            except (
                OSError,
                ValueError,
            ) as error:  # a connection that was reset, an answer that broke off
                self._figures[f"{act.__name__.strip('_')}: {type(error).__name__}"] += 1
            time.sleep(self._draw.expovariate(1 / 4.0))

    def _tell(self, act: str, status: int) -> None:
        self._figures[f"{act}: {status}"] += 1

    def _state(self) -> dict[str, Any]:
        status, _, body = self._server.ask("api/state")
        self._tell("state", status)
        if status != 200:
            return {"photos": [], "jobs": []}
        found: dict[str, Any] = json.loads(body)
        return found

    def _photo(self) -> bytes:
        """Return the sample in one of twelve sizes, or noise."""
        buffer = io.BytesIO()
        side = 300 + 10 * self._draw.randrange(12)
        image = (
            Image.open(SAMPLE).resize((side, side))
            if self._draw.random() < 0.5
            else Image.effect_noise((200, 260), 90).convert("RGB")
        )
        image.save(buffer, "jpeg")
        return buffer.getvalue()

    def _upload(self) -> None:
        data = self._photo() if self._draw.random() < 0.6 else self._draw.choice(self._hostile)
        self._tell("upload", self._server.ask("api/photos?name=soak", "POST", data)[0])

    def _order(self) -> None:
        if photos := self._state()["photos"]:
            wish = WISH | {"seed": self._draw.randrange(6)}
            self._tell(
                "order",
                self._server.say(
                    "api/jobs", {"photo": self._draw.choice(photos)["id"], "wish": wish}
                )[0],
            )

    def _spared(self, jobs: list[dict[str, Any]]) -> set[str]:
        """Return the video in progress and its photo, except rarely, so that some video is
        finished."""
        queue = sorted(
            (job for job in jobs if job["status"] in ("waiting", "running")),
            key=lambda job: float(job["created"]),
        )
        return (
            {queue[0]["id"], queue[0]["photo"]} if queue and self._draw.random() > 0.02 else set()
        )

    def _cancel(self) -> None:
        state = self._state()
        spared = self._spared(state["jobs"])
        if jobs := [
            job
            for job in state["jobs"]
            if job["status"] in ("waiting", "running") and job["id"] not in spared
        ]:
            self._tell(
                "cancel",
                self._server.ask(f"api/jobs/{self._draw.choice(jobs)['id']}/cancel", "POST", b"")[
                    0
                ],
            )

    def _remove(self) -> None:
        kind, state = self._draw.choice(("photos", "jobs")), self._state()
        spared = self._spared(state["jobs"])
        if found := [item for item in state[kind] if item["id"] not in spared]:
            self._tell(
                "remove",
                self._server.ask(f"api/{kind}/{self._draw.choice(found)['id']}", "DELETE")[0],
            )

    def _rubbish(self) -> None:
        path = self._draw.choice(
            (
                "api/jobs",
                "api/words",
                "api/photos/x/again",
                "api/nothing",
                "jobs/x/all.zip",
                "%ff%fe",
                "api/damaged",
            )
        )
        body = self._draw.choice(
            [
                json.dumps(self._draw.choice(RUBBISH)).encode(),
                self._draw.randbytes(300),
                b"[" * 5000,
                b"",
            ]
        )
        self._tell(
            "rubbish",
            self._server.ask(path, self._draw.choice(("POST", "GET", "PUT", "DELETE")), body)[0],
        )

    def _connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self._server.port), timeout=20)

    def _hang_up(self) -> None:
        head = f"POST /{self._server.token}/api/photos HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 3000000\r\n\r\n".encode()
        with self._connect() as wire:
            wire.sendall(
                head[: self._draw.randrange(1, len(head))]
                if self._draw.random() < 0.5
                else head + bytes(self._draw.randrange(1, 200000))
            )
            time.sleep(self._draw.random())
        self._figures["hung up"] += 1

    def _idle(self) -> None:
        with self._connect() as wire, contextlib.suppress(OSError):
            wire.recv(1)
        self._figures["silent"] += 1

    def _poll(self) -> None:
        self._state()

    def _download(self) -> None:
        if jobs := [job for job in self._state()["jobs"] if job["status"] == "done"]:
            job = self._draw.choice(jobs)
            if self._draw.random() < 0.5:
                self._tell("download", self._server.ask(f"jobs/{job['id']}/all.zip")[0])
                return
            with self._connect() as wire:  # sends a request and does not read the answer
                wire.sendall(
                    f"GET /{self._server.token}/jobs/{job['id']}/all.zip HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()
                )
                time.sleep(3)
            self._figures["held"] += 1


def resident(server: Server) -> float:
    """Return the memory of the server itself, MB."""
    return float(psutil.Process(server.process.pid).memory_info().rss / 1e6)


def kill_one(server: Server, draw: random.Random) -> str:
    """Kill a process below the server, as the system does if memory runs out."""
    children = psutil.Process(server.process.pid).children(recursive=True)
    if not children:
        return ""
    with contextlib.suppress(psutil.Error):
        child = draw.choice(children)
        child.kill()
        return "worker" if child.ppid() != server.process.pid else "child"
    return ""


def fill(folder: Path, seconds: float) -> None:
    """Fill the disk for `seconds`."""
    path = folder / "filler"
    with contextlib.suppress(OSError), path.open("wb") as stream:
        while True:
            stream.write(bytes(1 << 20))
            stream.flush()
    with contextlib.suppress(OSError), path.open("ab", buffering=0) as stream:
        while stream.write(bytes(4096)):
            pass
    time.sleep(seconds)
    path.unlink()


def wait_for(true: Callable[[], Any], seconds: float) -> bool:
    """Return whether something becomes true within some seconds."""
    until = time.monotonic() + seconds
    while not (found := true()) and time.monotonic() < until:
        time.sleep(0.5)
    return bool(found)


def afterwards(server: Server, folder: Path) -> dict[str, Any]:
    """Check the page afterwards: it answers and lists, removes everybody, and makes a video."""
    state = server.state()
    listed = {
        kind: {path.name for path in (folder / "page" / kind).iterdir()}
        == {one["id"] for one in state[kind]}
        for kind in ("photos", "jobs")
    }
    removed = [server.ask(f"api/photos/{photo['id']}", "DELETE")[0] for photo in state["photos"]]
    status, _, body = server.ask("api/photos?name=last", "POST", SAMPLE.read_bytes())
    photo = json.loads(body)

    def find(kind: str, name: str) -> dict[str, Any]:
        return next((one for one in server.state()[kind] if one["id"] == name), {})

    looked = wait_for(lambda: find("photos", photo["id"])["status"] == "ready", 300)
    _, job = server.say("api/jobs", {"photo": photo["id"], "wish": WISH})
    made = wait_for(lambda: find("jobs", job["id"])["status"] in ("done", "failed"), 1500)
    last = find("jobs", job["id"])
    film = server.ask(f"jobs/{job['id']}/video.mp4")
    gone = server.ask(f"api/photos/{photo['id']}", "DELETE")
    time.sleep(SETTLED_SECONDS)
    left = [
        str(path.relative_to(folder))
        for part in ("page/photos", "page/jobs", "page/incoming", "page/removed")
        for path in (folder / part).rglob("*")
    ]
    calls = {path.parent.parent.name for path in (folder / "store" / "calls").rglob("*.json")}
    return {
        "listed": listed,
        "removed": Counter(map(str, removed)),
        "upload": status,
        "looked": looked,
        "made": made and last.get("status"),
        "problem": last.get("problem"),
        "film": [film[0], len(film[2])],
        "forgotten": json.loads(gone[2]),
        "left in the page's folder": left,
        "remembered calls that are left": sorted(calls),
    }


def seconds_to_end(server: Server) -> float | None:
    """Return the exit code after SIGTERM, or None if it has not ended within half a minute."""
    begun = time.monotonic()
    try:
        server.end(signal.SIGTERM)
    except subprocess.TimeoutExpired:
        return None
    return round(time.monotonic() - begun, 2)


def storm(given: argparse.Namespace, server: Server, folder: Path, mounted: bool) -> dict[str, Any]:
    """Run all clients; return the figures."""
    begun = time.monotonic()
    until, figures = begun + 60 * given.minutes, Counter[str]()
    draw = random.Random(given.seed)
    clients = [
        Client(server, number, given.seed, until, figures) for number in range(given.clients)
    ]
    for client in clients:
        client.start()
    kills = sorted(
        begun + WARM_SECONDS + draw.random() * (until - begun - WARM_SECONDS)
        for _ in range(given.kills)
    )
    fulls = [
        begun + (until - begun) * (number + 1) / (given.full + 1)
        for number in range(given.full if mounted else 0)
    ]
    sizes, first = list[float](), 0.0
    while time.monotonic() < until:
        time.sleep(1)
        assert server.process.poll() is None, "the server has ended"
        sizes.append(resident(server))
        if not first and time.monotonic() > begun + WARM_SECONDS:
            first = sum(sizes[-20:]) / 20
        if kills and time.monotonic() > kills[0] and (killed := kill_one(server, draw)):
            figures[f"killed a {killed}"] += 1
            kills.pop(0)
        if fulls and time.monotonic() > fulls[0]:
            fulls.pop(0)
            figures["disk full"] += 1
            threading.Thread(target=fill, args=(folder, 20.0)).start()
    for client in clients:
        client.join(90)
    last = sum(sizes[-20:]) / 20
    return {
        "answers": dict(sorted(figures.items())),
        "clients that hang": sum(client.is_alive() for client in clients),
        "server MB": {
            "after two minutes": round(first, 1),
            "at the end": round(last, 1),
            "most": round(max(sizes), 1),
        },
    }


def main() -> int:
    """Run it and print the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--full", type=int, default=2, help="how often the disk gets full")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    with small_disk(given.folder) as mounted:
        os.environ["A2V_CACHE"] = str(given.folder / "store")
        server = Server(given.folder / "page")
        try:
            told = {
                "settings": {**vars(given), "folder": str(given.folder), "small disk": mounted},
                **storm(given, server, given.folder, mounted),
            }
            told["afterwards"] = after = afterwards(server, given.folder)
            print(json.dumps(told), file=sys.stderr)
            told["seconds to end"] = ended = seconds_to_end(server)
        finally:
            server.process.kill()
            server.process.wait()
            if not mounted:
                shutil.rmtree(given.folder / "page", ignore_errors=True)
    size = told["server MB"]
    checks = {
        "no answer of 500": not any(name.endswith(": 500") for name in told["answers"]),
        "nobody hangs": not told["clients that hang"],
        "memory within a tenth": size["at the end"] < 1.1 * size["after two minutes"],
        "lists its contents": all(after["listed"].values()),
        "makes a video": after["made"] == "done" and after["film"][1] > 1000,
        "ends on SIGTERM": ended is not None,
        "nothing is left of anybody": not after["left in the page's folder"]
        and "subject" not in after["remembered calls that are left"],
    }
    print(json.dumps({**told, "checks": checks}, indent=1))
    return 0 if all(checks.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
