"""The server of the page without a browser: access, accepted input, and output."""

from __future__ import annotations

import base64
import json
import shutil
import signal
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import psutil
import pytest

from a2v.errors import InputError
from a2v.rendering import write_video
from pipelines.clock import Clock
from pipelines.engine.progress import Update
from pipelines.serve.library import Library
from pipelines.serve.stages import STAGES
from pipelines.serve.wishes import FIRST, MODELS, Wish, actions_of
from tests.support.page import ROOT, Server, arrived, ready
from tests.support.uploads import hostile_uploads, picture

SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with a finished job that was written by the test: its files are real."""
    folder = tmp_path_factory.mktemp("page")
    library = Library(folder)
    photo = ready(library)
    job = library.add_job(photo, Wish(action="Walk", model="cmu"))
    write_video(library.place(job) / "video.mp4", [np.full((64, 64, 3), 90, np.uint8)] * 5, 10.0)
    (library.place(job) / "secret.txt").symlink_to("/etc/hostname")
    job.status = "done"
    job.files = {"video.mp4": (library.place(job) / "video.mp4").stat().st_size, "secret.txt": 1}
    library.keep(job)
    running = Server(folder)
    yield running
    running.end()


@pytest.fixture
def job(server: Server) -> dict:
    return server.state()["jobs"][0]


# --- access


def test_it_listens_on_this_machine_alone(server: Server) -> None:
    process = psutil.Process(server.process.pid)
    listening = [one for one in process.net_connections() if one.status == psutil.CONN_LISTEN]
    assert [one.laddr.ip for one in listening] == ["127.0.0.1"]


def test_the_token_is_its_users_alone(server: Server) -> None:
    assert stat.S_IMODE((server.folder / "token").stat().st_mode) == 0o600


@pytest.mark.parametrize(
    "path", ["/", "/api/state", "/x" * 20 + "/api/state", "//api/state", "/%C3%A9/", "/%ED%A0%80/"]
)
def test_without_the_token_nothing_is_told(server: Server, path: str) -> None:
    status, _, body = server.ask(path, whole=True)
    assert status in (400, 403)
    assert b"photos" not in body


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "127.0.0.1.evil.example:8420"},
        {"Host": "127.0.0.1@evil.example"},
        {"Host": ""},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "https://127.0.0.1:{port}"},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"},
        {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "cors"},
    ],
    ids=str,
)
def test_other_hosts_and_origins_are_refused(server: Server, headers: dict[str, str]) -> None:
    given = {name: value.format(port=server.port) for name, value in headers.items()}
    for method, path in (("GET", "api/state"), ("POST", "api/jobs")):
        status, _, body = server.ask(path, method, b"{}" if method == "POST" else None, given)
        assert status == 403
        assert json.loads(body)["problem"]


def test_the_page_itself_may_ask(server: Server) -> None:
    for host in (
        f"127.0.0.1:{server.port}",
        f"localhost:{server.port}",
        "localhost:9999",
    ):  # the last: forwarded by ssh
        status, headers, _ = server.ask(
            "api/state", headers={"Host": host, "Origin": f"http://{host}"}
        )
        assert status == 200
        assert "access-control-allow-origin" not in headers


def test_every_answer_holds_the_browser_to_this_server(server: Server, job: dict) -> None:
    for path in ("", "api/state", "page/main.js", "nowhere", f"jobs/{job['id']}/video.mp4"):
        headers = server.ask(path)[1]
        assert headers["content-security-policy"].startswith(
            "default-src 'none'; script-src 'self'"
        )
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["x-content-type-options"] == "nosniff"
        assert "server" not in headers
    text = "".join(
        server.ask(f"page/{path.name}")[2].decode()
        for path in (ROOT / "pipelines/serve/page").iterdir()
        if path.suffix in (".html", ".css", ".js", ".svg")
    )
    assert "innerHTML" not in text
    assert not [
        word
        for word in text.split()
        if "//" in word and "http" in word and "www.w3.org" not in word
    ]


# --- input


def test_fifty_hostile_uploads_are_refused_with_a_sentence(server: Server) -> None:
    uploads = hostile_uploads()
    assert len(uploads) >= 50
    before, memory = server.state()["photos"], psutil.Process(server.process.pid).memory_info().rss
    for data in uploads:
        status, _, body = server.ask("api/photos?name=../../x", "POST", data)
        said = json.loads(body)["problem"]
        assert status == 400, (data[:30], said)
        assert len(said) > 20
        assert "\n" not in said
        assert str(server.folder) not in said
    assert server.state()["photos"] == before
    assert len(list((server.folder / "photos").iterdir())) == len(before)
    assert psutil.Process(server.process.pid).memory_info().rss - memory < 300 << 20


def test_the_size_is_checked_before_and_while_it_is_read(server: Server) -> None:
    status, _, body = server.ask("api/photos", "POST", b"", {"Content-Length": str(1 << 40)})
    assert status == 413
    assert "larger than 40 MB" in json.loads(body)["problem"]
    for length in ("-1", "abc"):
        assert server.ask("api/photos", "POST", b"x", {"Content-Length": length})[0] in (400, 413)
    with socket.create_connection(
        ("127.0.0.1", server.port), timeout=30
    ) as wire:  # has no length and does not end
        wire.sendall(
            f"POST /{server.token}/api/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n".encode()
        )
        part = b"10000\r\n" + b"x" * 65536 + b"\r\n"
        wire.sendall(part * 3)
        assert b"413" in wire.recv(65536).split(b"\r\n")[0]


def test_a_name_is_words_to_show_and_never_a_path(server: Server) -> None:
    name = "..%2F..%2Fetc%2F%3Cb%3Epasswd%00%E2%80%AE%0A.png"
    status, _, body = server.ask(f"api/photos?name={name}", "POST", picture())
    photo = json.loads(body)
    assert status == 201
    assert photo["title"] == "<b>passwd"
    assert (server.folder / "photos" / photo["id"] / "original").read_bytes() == picture()
    deadline = time.monotonic() + 120
    while (seen := next(one for one in server.state()["photos"] if one["id"] == photo["id"]))[
        "status"
    ] == "looking":
        assert time.monotonic() < deadline
        time.sleep(0.3)
    assert seen["status"] == "unusable"  # noise: the detector has looked at it and found nobody
    assert "person" in seen["problem"]
    assert str(server.folder) not in seen["problem"]
    status, said = server.say("api/jobs", {"photo": photo["id"], "wish": {"action": "Walk"}})
    assert status == 400
    assert "cannot be used" in said["problem"]
    assert server.ask(f"api/photos/{photo['id']}", "DELETE")[0] == 200
    assert not (server.folder / "photos" / photo["id"]).exists()


HOSTILE_WISHES = [
    None, [], "Walk", {}, {"action": ""}, {"action": 5}, {"action": "x" * 301}, {"action": "Walk", "model": "../../x.onnx"},
    {"action": "Walk", "model": "/etc/passwd"}, {"action": "Walk", "background": "/etc/passwd"}, {"action": "Walk", "background": "red; x"},
    {"action": "Walk", "look": "/etc/passwd"}, {"action": "Walk", "aspect": "3:1"}, {"action": "Walk", "camera": "c.yaml"},
    {"action": "Walk", "background": None}, {"action": "Walk", "views": []}, {"action": "Walk", "views": ["front", "front"]},
    {"action": "Walk", "views": ["../x"]}, {"action": "Walk", "views": "front"}, {"action": "Walk", "views": [[]]}, {"action": "Walk", "size": 10**9},
    {"action": "Walk", "size": 65}, {"action": "Walk", "size": 256.5}, {"action": "Walk", "size": True}, {"action": "Walk", "spp": 0},
    {"action": "Walk", "spp": 10**400}, {"action": "Walk", "seconds": 1e9}, {"action": "Walk", "seconds": float("nan")}, {"action": "Walk", "seconds": "4"},
    {"action": "Walk", "fps": 0}, {"action": "Walk", "fps": float("inf")}, {"action": "Walk", "seed": -1}, {"action": "Walk", "seed": 1.5},
    {"action": "Walk", "out": "/tmp"}, {"action": "Walk", "camera": "x.yaml"}, {"action": "Walk", "photo": "/etc/passwd"}, {"action": {"a": 1}},
]  # fmt: skip


@pytest.mark.parametrize("said", HOSTILE_WISHES, ids=lambda said: str(said)[:40])
def test_a_hostile_wish_is_one_sentence(said: object) -> None:
    with pytest.raises(InputError) as caught:
        Wish.of(said)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_hostile_requests_are_refused(server: Server, job: dict) -> None:
    assert (
        server.say(
            "api/jobs", {"photo": job["photo"], "wish": {"action": "xyzzy plugh", "model": "cmu"}}
        )[0]
        == 400
    )
    assert server.say("api/jobs", {"photo": "../..", "wish": {"action": "Walk"}})[0] == 400
    assert server.say("api/jobs", [[[[]]]])[0] == 400
    for body in (b"", b"{", b"\xff", b"[" * 60000, b"9" * 60000, b'{"photo":' * 5000):
        assert server.ask("api/jobs", "POST", body)[0] == 400
    assert server.say("api/words", {"text": "z" * 301})[0] == 400
    assert server.say("api/words", {"text": ["run"]})[0] == 400
    assert server.ask(f"api/jobs/{job['id']}/cancel", "POST")[0] == 400  # it is done
    assert server.ask("api/state", "PUT", b"{}")[0] == 405
    assert [one["id"] for one in server.state()["jobs"]] == [job["id"]]


def test_words_are_understood(server: Server) -> None:
    status, said = server.say(
        "api/words", {"model": "cmu-fine", "text": "sneak for 3 s, then run away"}
    )
    assert status == 200
    assert [part["action"] for part in said["parts"]] == ["Sneak", "Run"]


def test_many_may_ask_at_once(server: Server) -> None:
    asked = [
        {"model": model, "text": text}
        for text in ("walk slowly, then jump", "dancing", "running", "sneak")
        for model in ("cmu", "cmu-fine")
    ] * 4
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda said: server.say("api/words", said), asked))
    assert [status for status, _ in answers[:8] * 4] == [status for status, _ in answers]
    assert {status for status, _ in answers} <= {200, 400}  # of eight actions none sneaks


# --- output


def test_nothing_outside_the_folder_is_read(server: Server, job: dict) -> None:
    own = f"jobs/{job['id']}"
    for path in (
        f"{own}/job.json", f"{own}/secret.txt", f"{own}/../../token", f"{own}/%2e%2e/%2e%2e/token", f"{own}//etc/passwd", f"{own}/..%2f..%2ftoken",
        f"photos/{job['photo']}/original", f"photos/{job['photo']}/photo.json", "photos/../token", "page/../../token", "page/%2e%2e%2f%2e%2e%2fapp.py",
        "page/", "token", "jobs/../../../etc/passwd", f"{own}/\0",
    ):  # fmt: skip
        status, _, body = server.ask(path.replace("\0", "%00"))
        assert status == 404, path
        assert server.token.encode() not in body


def test_a_player_may_ask_for_parts(server: Server, job: dict) -> None:
    whole = server.ask(f"jobs/{job['id']}/video.mp4")
    part = server.ask(f"jobs/{job['id']}/video.mp4", headers={"Range": "bytes=4-7"})
    assert whole[0] == 200
    assert whole[1]["content-type"] == "video/mp4"
    assert (part[0], part[2]) == (206, b"ftyp")
    assert (
        'filename="video.mp4"'
        in server.ask(f"jobs/{job['id']}/video.mp4?download")[1]["content-disposition"]
    )


def test_every_action_has_its_figure(server: Server) -> None:
    book = json.loads(server.ask("page/figures.json")[2])
    assert set(book["actions"]) == {action for name in MODELS for action in actions_of(name)}
    sizes = {}
    for name, figure in book["actions"].items():
        moves = (
            np.frombuffer(base64.b64decode(figure), np.uint8)
            .reshape(book["frames"], book["joints"], 2)
            .astype(int)
        )
        sizes[name] = np.ptp(moves, axis=0).max(), np.ptp(moves[..., 1])
    assert (
        np.mean([moved > 4 for moved, _ in sizes.values()]) > 0.9
    )  # some poses are held: aiming a pistol, sleeping
    assert np.median([tall for _, tall in sizes.values()]) > 150  # most stand
    assert server.ask("page/sample.webp")[1]["content-type"] == "image/webp"


def test_a_stage_that_is_not_made_has_no_shape(server: Server, job: dict) -> None:
    own = f"photos/{job['photo']}"
    for name in STAGES.values():
        assert server.ask(f"{own}/{name}")[0] == 404
    (server.folder / own / STAGES["body"]).write_bytes(b"x")
    assert server.ask(f"{own}/{STAGES['body']}")[0] == 200


# --- the process


def test_two_servers_do_not_share_a_folder(server: Server) -> None:
    command = [
        sys.executable,
        "-m",
        "pipelines",
        "serve",
        "--folder",
        str(server.folder),
        "--port",
        "0",
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "runs on" in done.stderr
    other = [*command[:-3], str(server.folder) + "2", "--port", str(server.port)]
    done = subprocess.run(other, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "choose another --port" in done.stderr


def test_ctrl_c_is_a_good_end_and_the_address_stays(tmp_path: Path) -> None:
    first = Server(tmp_path / "page")
    assert first.end(signal.SIGINT) == 0
    second = Server(tmp_path / "page", first.port)
    assert second.address == first.address
    second.end()
    (tmp_path / "page" / "token").chmod(0o644)  # others may have read it
    third = Server(tmp_path / "page")
    assert third.token != first.token
    third.end()


def test_ctrl_c_the_moment_the_address_is_read_closes_all_in_order(tmp_path: Path) -> None:
    code = f"""
import builtins, os, signal
from pipelines.commands import serve
from pipelines.serve.desk import Desk
said, close = builtins.print, Desk.close
def address(*words, **more):
    os.kill(os.getpid(), signal.SIGINT)
async def closed(desk):
    await close(desk)
    said("closed")
builtins.print, Desk.close = address, closed
serve.run(serve.Options(folder={str(tmp_path / "page")!r}, port=0))
said("ended")
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stdout.split() == ["closed", "ended"], done.stderr


DAMAGE: list[tuple[str, object]] = [
    ("created", "x"), ("created", float("inf")), ("created", float("nan")), ("created", None), ("photo", ["a"]), ("photo", {}), ("photo", "0" * 16),
    ("status", "flying"), ("status", 1), ("problem", None), ("seconds", -float("inf")), ("notes", "text"), ("notes", [1]), ("files", ["video.mp4"]),
    ("files", {"video.mp4": "x"}), ("wish", None), ("wish", {"action": "Walk\ud800"}), ("wish", {"action": 3}), ("problem", "\udfff"),
]  # fmt: skip


def test_records_that_are_none_of_ours_are_passed_over(tmp_path: Path) -> None:
    library = Library(tmp_path)
    photo = arrived(library, b"x", "a")
    job = library.add_job(photo, Wish(action="Walk"))
    whole = json.loads((tmp_path / "jobs" / job.id / "job.json").read_text())
    strange: list[str] = [
        "",
        "[]",
        "{}",
        '{"id": 5}',
        "[" * 10_000,
        json.dumps({"id": "x3", "nonsense": 1}),
    ]
    for number, (name, value) in enumerate(DAMAGE):
        strange.append(json.dumps(whole | {"id": f"{number:016x}", name: value}))
    strange.append(json.dumps(whole | {"id": "../../x"}))
    for number, text in enumerate(strange):
        folder = (
            tmp_path
            / "jobs"
            / (json.loads(text)["id"] if 6 <= number < 6 + len(DAMAGE) else f"x{number}")
        )
        folder.mkdir()
        (folder / "job.json").write_text(text)
    read = Library(tmp_path)
    assert list(read.jobs) == [job.id]
    assert read.jobs[job.id].wish == job.wish
    assert list(read.photos) == [photo.id]
    assert len(read.damaged) == len(strange)
    for folder in read.remove_damaged():
        shutil.rmtree(folder)
    assert len(Library(tmp_path).damaged) == 0
    assert [path.name for path in (tmp_path / "jobs").iterdir()] == [job.id]


def test_the_clock_knows_more_as_frames_come(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    clock = Clock(
        frames=10,
        pictures=10,
        samples=256 * 256 * 8,
        known=True,
        measured={"frame": 1.0, "vertices": 0.0},
    )
    first = clock.take(Update("subject", 1, 1))
    assert first["left"] < 20  # type: ignore[operator]  # a remembered character costs nothing
    for done in range(1, 8):
        now[0] += 3
        said = clock.take(Update("frame", done, 10))
    assert said["stage"] == "frames 7 of 10"
    assert said["left"] == pytest.approx(
        9 + 2.4, abs=1
    )  # three frames at three seconds, and what comes after
    assert 0.5 < float(str(said["share"])) < 0.75
    assert clock.take(Update("frame", 10, 10))["share"] > said["share"]  # type: ignore[operator]


def test_the_gallery_begins_with_what_people_ask_for_first(server: Server) -> None:
    _, _, body = server.ask("api/choices")
    everything = [entry["name"] for entry in json.loads(body)["actions"]]
    assert everything[: len(FIRST)] == list(FIRST)  # each of them can be requested
    assert sorted(everything) == sorted(actions_of(MODELS[0]))
