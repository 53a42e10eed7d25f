"""Unknown clients: texts in no encoding, silent connections, many large photos, held downloads."""

from __future__ import annotations

import asyncio
import contextlib
import io
import json
import re
import socket
import threading
import time
import zipfile
import zlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import psutil
import pytest
import uvicorn

from a2v.errors import InputError
from pipelines.serve import edge, wire
from pipelines.serve.archive import PART, zipped
from pipelines.serve.library import Library
from pipelines.serve.wishes import Wish
from tests.support.page import Server, ready
from tests.support.uploads import chunk


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with one photo whose job's record has half a character, from an older version."""
    folder = tmp_path_factory.mktemp("page")
    library = Library(folder)
    photo = ready(library)
    job = library.add_job(photo, Wish(action="Walk"))
    path = library.place(job) / "job.json"
    path.write_text(path.read_text().replace('"Walk"', '"Walk\\ud800"'))
    running = Server(folder)
    yield running
    running.end()


def said(wire_: socket.socket) -> bytes:
    """What comes until an "ok" or the end of the connection."""
    found = b""
    with contextlib.suppress(ConnectionResetError):
        while not found.endswith(b"ok") and (part := wire_.recv(4096)):
            found += part
    return found


def memory(server: Server) -> int:
    return int(psutil.Process(server.process.pid).memory_info().rss)


# --- texts


@pytest.mark.parametrize("text", ["Walk\ud800", "\udfffWalk", "a\ud83d b"], ids=ascii)
def test_half_a_character_is_refused_once_and_hides_nothing(server: Server, text: str) -> None:
    (photo,) = server.state()["photos"]
    for address, said in (
        ("api/jobs", {"photo": photo["id"], "wish": {"action": text}}),
        ("api/jobs", {"photo": text, "wish": {"action": "Walk"}}),
        ("api/jobs", {"photo": photo["id"], "wish": {"action": "Walk", text: 1}}),
        ("api/words", {"model": "cmu", "text": text}),
        ("api/words", {"model": text, "text": "walk"}),
    ):
        status, answer = server.say(address, said)
        assert (status, "half a character" in answer["problem"]) == (400, True)
    state = server.state()
    assert [one["id"] for one in state["photos"]] == [photo["id"]]
    assert state["jobs"] == []


def test_a_record_that_cannot_be_told_is_counted_and_can_be_removed(server: Server) -> None:
    assert server.state()["damaged"] == 1
    assert len(list((server.folder / "jobs").iterdir())) == 1
    assert server.ask("api/damaged", "DELETE")[0] == 200
    assert server.state()["damaged"] == 0
    assert list((server.folder / "jobs").iterdir()) == []


def test_texts_are_composed_and_lose_what_steers() -> None:
    assert edge.clean({"cafe\u0301": ["a\u202eb\x00c\nd", 5, None]}) == {
        "caf\u00e9": ["a b c d", 5, None]
    }
    with pytest.raises(InputError):
        edge.clean([{"x": ["\ud800"]}])


def test_control_characters_of_an_action_are_spaces(server: Server) -> None:
    status, said = server.say("api/words", {"model": "cmu", "text": "walk,\x00\u202e jump"})
    assert (status, [part["action"] for part in said["parts"]]) == (200, ["Walk", "Jump"])


# --- connections


def test_silent_strangers_do_not_crowd_out_the_page(server: Server) -> None:
    silent = [socket.create_connection(("127.0.0.1", server.port), timeout=30) for _ in range(450)]
    try:
        for _ in range(5):
            assert server.ask("api/state")[0] == 200
        assert said(silent[0]) == b""  # the oldest was closed for the newest
    finally:
        for one in silent:
            one.close()


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The port of a server that waits 0.5 s for headers and takes four strangers."""
    monkeypatch.setattr(wire, "HEADER_SECONDS", 0.5)
    monkeypatch.setattr(wire, "MAX_STRANGERS", 4)

    async def app(scope, receive, send) -> None:  # type: ignore[no-untyped-def]
        await asyncio.sleep(1.0 if "slow" in scope["path"] else 0)
        await send(
            {"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]}
        )
        await send({"type": "http.response.body", "body": b"ok"})

    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    running = uvicorn.Server(
        uvicorn.Config(
            app, http=wire.protocol("key"), ws="none", lifespan="off", log_level="critical"
        )
    )
    thread = threading.Thread(target=running.run, kwargs={"sockets": [listener]})
    thread.start()
    while not running.started:
        time.sleep(0.01)
    yield listener.getsockname()[1]
    running.should_exit = True
    thread.join(10)


def test_headers_are_waited_for_so_long_and_answers_as_long_as_they_take(patient: int) -> None:
    def connect() -> socket.socket:
        return socket.create_connection(("127.0.0.1", patient), timeout=20)

    with connect() as silent, connect() as dripping, connect() as asking:
        asking.sendall(b"GET /key/slow HTTP/1.1\r\nHost: x\r\n\r\n")
        dripped = 0
        with contextlib.suppress(OSError):
            while dripped < 200:
                dripping.send(b"G")
                dripped += 1
                time.sleep(0.05)
        assert 5 < dripped < 200
        assert said(silent) == b""
        assert said(asking).endswith(b"ok")
        asking.sendall(b"GET /key/ HTTP/1.1\r\nHost: x\r\n\r\n")
        assert said(asking).endswith(b"ok")  # the same connection again
        assert said(asking) == b""  # and then it is silent for too long


def test_who_has_the_token_is_no_stranger(patient: int) -> None:
    with socket.create_connection(("127.0.0.1", patient), timeout=20) as known:
        known.sendall(b"GET /key/slow HTTP/1.1\r\nHost: x\r\n\r\n")
        time.sleep(0.2)
        crowd = [socket.create_connection(("127.0.0.1", patient), timeout=20) for _ in range(12)]
        assert said(known).endswith(b"ok")
        assert sum(said(one) == b"" for one in crowd) == 12
        for one in crowd:
            one.close()


# --- what is large


def test_many_large_photos_at_once_are_not_held_in_memory(server: Server) -> None:
    data, before = b"no photo" + bytes(39 << 20), memory(server)
    most, done = [0], threading.Event()

    def watch() -> None:
        while not done.wait(0.05):
            most[0] = max(most[0], memory(server))

    watching = threading.Thread(target=watch)
    watching.start()
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: server.ask("api/photos", "POST", data), range(8)))
    done.set()
    watching.join()
    assert {status for status, _, _ in answers} == {400}
    assert most[0] - before < 80 << 20  # 312 MB were sent
    assert list((server.folder / "incoming").iterdir()) == []


def test_photos_are_decoded_elsewhere(server: Server) -> None:
    side = 7500
    head = chunk(b"IHDR", bytes.fromhex(f"{side:08x}{side:08x}0802000000"))
    large = (
        b"\x89PNG\r\n\x1a\n"
        + head
        + chunk(b"IDAT", zlib.compress(bytes(side * (3 * side + 1)), 1))
        + chunk(b"IEND", b"")
    )
    before, peak = memory(server), Path(f"/proc/{server.process.pid}/status")
    Path(f"/proc/{server.process.pid}/clear_refs").write_text("5")
    status, _, body = server.ask("api/photos?name=black", "POST", large)
    assert status == 201
    most = int(re.findall(r"VmHWM:\s*(\d+)", peak.read_text())[0]) << 10
    assert most - before < 60 << 20  # the pixels are 169 MB
    photo = json.loads(body)
    assert (photo["width"], photo["height"]) == (1280, 1280)
    assert (
        server.ask(f"photos/{photo['id']}/photo.jpg")[0] == 200
    )  # immediately, before the photo is processed
    assert server.ask(f"api/photos/{photo['id']}", "DELETE")[0] == 200
    time.sleep(1.5)
    assert not (server.folder / "photos" / photo["id"]).exists()


def test_a_photo_that_breaks_off_leaves_nothing(server: Server) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as wire_:
        wire_.sendall(
            f"POST /{server.token}/api/photos HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100000\r\n\r\n".encode()
            + bytes(5000)
        )
        time.sleep(0.3)
    deadline = time.monotonic() + 10
    while list((server.folder / "incoming").iterdir()):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_an_archive_is_made_while_it_is_read(tmp_path: Path) -> None:
    sizes = {"a/large.bin": 5 << 20, "small.txt": 3, "gone.txt": 1, "link": 1}
    (tmp_path / "a").mkdir()
    for name in ("a/large.bin", "small.txt"):
        (tmp_path / name).write_bytes(bytes(range(256)) * (sizes[name] // 256) + b"xyz")
    (tmp_path / "link").symlink_to("/etc/hostname")
    parts = list(zipped(tmp_path, sizes))
    assert max(map(len, parts)) < 2 * PART
    with zipfile.ZipFile(io.BytesIO(b"".join(parts))) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["a/large.bin", "small.txt"]
        assert all(
            archive.read(name) == (tmp_path / name).read_bytes() for name in archive.namelist()
        )
