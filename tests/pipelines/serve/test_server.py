"""The server of the page without a browser: who may ask, what may come in, what goes out."""

from __future__ import annotations

import io
import json
import os
import signal
import socket
import stat
import struct
import subprocess
import sys
import time
import zipfile
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import psutil
import pytest
from PIL import Image

from a2v.errors import InputError
from a2v.rendering import write_video
from pipelines.progress import Update
from pipelines.serve.clock import Clock
from pipelines.serve.records import Library
from pipelines.serve.wishes import Wish
from tests.support.page import ROOT, Server

SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"


def picture(size: tuple[int, int] = (160, 200), form: str = "png", **how: object) -> bytes:
    buffer = io.BytesIO()
    pixels = np.random.default_rng(0).integers(0, 255, (size[1], size[0], 3), dtype=np.uint8)
    Image.fromarray(pixels).save(buffer, form, **how)
    return buffer.getvalue()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with a finished job that was written by hand: its files are real, nothing was computed."""
    folder = tmp_path_factory.mktemp("page")
    library = Library(folder)
    photo = library.add_photo(picture(), "somebody")
    photo.status = "ready"
    library.keep(photo)
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


# --- who may ask


def test_it_listens_on_this_machine_alone(server: Server) -> None:
    process = psutil.Process(server.process.pid)
    listening = [one for one in process.net_connections() if one.status == psutil.CONN_LISTEN]
    assert [one.laddr.ip for one in listening] == ["127.0.0.1"]


def test_the_token_is_its_users_alone(server: Server) -> None:
    assert stat.S_IMODE((server.folder / "token").stat().st_mode) == 0o600


@pytest.mark.parametrize("path", ["/", "/api/state", "/x" * 20 + "/api/state", "//api/state", "/%C3%A9/", "/%ED%A0%80/"])
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
    for host in (f"127.0.0.1:{server.port}", f"localhost:{server.port}", "localhost:9999"):  # the last: forwarded by ssh
        status, headers, _ = server.ask("api/state", headers={"Host": host, "Origin": f"http://{host}"})
        assert status == 200
        assert "access-control-allow-origin" not in headers


def test_every_answer_holds_the_browser_to_this_server(server: Server, job: dict) -> None:
    for path in ("", "api/state", "page/main.js", "nowhere", f"jobs/{job['id']}/video.mp4"):
        headers = server.ask(path)[1]
        assert headers["content-security-policy"].startswith("default-src 'none'; script-src 'self'")
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["x-content-type-options"] == "nosniff"
        assert "server" not in headers
    text = "".join(server.ask(f"page/{path.name}")[2].decode() for path in (ROOT / "pipelines/serve/page").iterdir())
    assert "innerHTML" not in text
    assert not [word for word in text.split() if "//" in word and "http" in word and "www.w3.org" not in word]


# --- what may come in


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def bomb(width: int, height: int) -> bytes:
    """A PNG that says it is very large."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")


def zipped(name: str) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(name, "x")
    return buffer.getvalue()


def hostile_uploads() -> list[bytes]:
    """What is no photo, not whole, or would fill the memory."""
    random = np.random.default_rng(1)
    png, jpeg, webp = picture(), picture(form="jpeg"), picture(form="webp")
    texts = [
        b"", b"\0", b"x", b"not a picture", b"<svg xmlns='http://www.w3.org/2000/svg'><script>alert(1)</script></svg>",
        b"<!doctype html><script>fetch('/')</script>", b"%PDF-1.7", b"GIF89a", b"\xff\xd8\xff\xe0", b"RIFF\xff\xff\xff\xffWEBPVP8 ", b"BM" + bytes(60),
        b"II*\0" + b"\xff" * 60, b"P6 99999 99999 255\n", b"P6\n-1 -1\n255\n", b"%!PS-Adobe-3.0 EPSF\n%%BoundingBox: 0 0 9 9\n", zipped("../../etc/x"),
        b"\x1f\x8b" + bytes(50), b"\x7fELF" + bytes(100), b"ftypheic" * 10, b"\0\0\0\x1cftypavif" + bytes(100), b"push graphic-context\n", b"{}",
        b"\x89PNG\r\n\x1a\n", b"\x80\x04\x95" + bytes(30), b"v 0 0 0\nf 1 1 1\n", b"glTF\2\0\0\0", os.urandom(4096), b"A" * 100_000,
    ]  # fmt: skip
    sizes = [bomb(1 << 20, 1 << 20), bomb(2**31 - 1, 1), bomb(0, 0), bomb(30000, 30000), picture((10, 10)), picture((2000, 20))]
    cut = [data[: int(len(data) * share)] for data in (png, jpeg, webp) for share in (0.02, 0.3, 0.7)]
    mixed = []
    for data in (png, webp):
        for _ in range(4):
            broken = bytearray(data)
            broken[30:] = random.permutation(np.frombuffer(bytes(broken[30:]), np.uint8)).tobytes()
            mixed.append(bytes(broken))
    return [*texts, *sizes, *cut, *mixed]


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
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as wire:  # says nothing of its size and goes on and on
        wire.sendall(f"POST /{server.token}/api/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n".encode())
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
    while (seen := next(one for one in server.state()["photos"] if one["id"] == photo["id"]))["status"] == "looking":
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
    assert server.say("api/jobs", {"photo": job["photo"], "wish": {"action": "xyzzy plugh", "model": "cmu"}})[0] == 400
    assert server.say("api/jobs", {"photo": "../..", "wish": {"action": "Walk"}})[0] == 400
    assert server.say("api/jobs", [[[[]]]])[0] == 400
    for body in (b"", b"{", b"\xff", b"[" * 60000, b"9" * 60000, b'{"photo":' * 5000):
        assert server.ask("api/jobs", "POST", body)[0] == 400
    assert server.say("api/words", {"model": "cmu", "text": "z" * 301})[0] == 400
    assert server.say("api/words", {"model": ["cmu"], "text": "run"})[0] == 400
    assert server.ask(f"api/jobs/{job['id']}/cancel", "POST")[0] == 400  # it is done
    assert server.ask("api/state", "PUT", b"{}")[0] == 405
    assert [one["id"] for one in server.state()["jobs"]] == [job["id"]]


def test_words_are_understood(server: Server) -> None:
    status, said = server.say("api/words", {"model": "cmu-fine", "text": "sneak for 3 s, then run away"})
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


# --- what goes out


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
    assert 'filename="video.mp4"' in server.ask(f"jobs/{job['id']}/video.mp4?download")[1]["content-disposition"]


# --- the process


def test_two_servers_do_not_share_a_folder(server: Server) -> None:
    command = [sys.executable, "-m", "pipelines", "serve", "--folder", str(server.folder), "--port", "0"]
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
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout.split() == ["closed", "ended"], done.stderr


def test_records_that_are_none_of_ours_are_passed_over(tmp_path: Path) -> None:
    library = Library(tmp_path)
    photo = library.add_photo(b"x", "a")
    job = library.add_job(photo, Wish(action="Walk"))
    for number, text in enumerate(("", "[]", "{}", '{"id": 5}', "[" * 10_000, json.dumps({"id": "x3", "nonsense": 1}))):
        (tmp_path / "jobs" / f"x{number}").mkdir()
        (tmp_path / "jobs" / f"x{number}" / "job.json").write_text(text)
    read = Library(tmp_path)
    assert list(read.jobs) == [job.id]
    assert read.jobs[job.id].wish == job.wish
    assert list(read.photos) == [photo.id]


def test_the_clock_knows_more_as_frames_come(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    clock = Clock(frames=10, pictures=10, samples=256 * 256 * 8, known=True, measured={"frame": 1.0, "posed": 0.0})
    first = clock.take(Update("subject", 1, 1))
    assert first["left"] < 15  # type: ignore[operator]  # a remembered character costs nothing
    for done in range(1, 8):
        now[0] += 3
        said = clock.take(Update("frame", done, 10))
    assert said["stage"] == "Rendering 7 of 10"
    assert said["left"] == pytest.approx(9 + 2.4, abs=1)  # three frames at three seconds, and what comes after
    assert 0.5 < float(str(said["share"])) < 0.75
    assert clock.take(Update("frame", 10, 10))["share"] > said["share"]  # type: ignore[operator]
