"""The queue while users change their minds and the disk is full.

The child process here writes files and waits; it computes nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from threading import Event
from typing import Any

import psutil
import pytest

from a2v.errors import InputError
from pipelines.engine.store import Store, put, using
from pipelines.nodes.values import Blob
from pipelines.serve import desk as desk_module
from pipelines.serve import library as library_module
from pipelines.serve.desk import Desk
from pipelines.serve.guard import Guard
from pipelines.serve.library import Library
from pipelines.serve.records import Photo, Record
from pipelines.serve.talk import ORIGINAL
from pipelines.serve.threads import Threads
from pipelines.serve.wishes import Wish
from tests.support.page import arrived

CHILD = """
import json, os, sys, time
from pathlib import Path
for line in sys.stdin:
    task = json.loads(line)
    if task["task"] == "warm":
        continue
    folder = Path(task["folder"])
    (folder / "begun").write_text(str(os.getpid()))
    time.sleep(float(os.environ.get("A2V_TEST_WORK", "0")))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "mask.png").write_text("made")
    done = {"landmarks": [], "warnings": []} if task["task"] == "look" else {"files": {"mask.png": 4}, "notes": [], "times": {}}
    print(json.dumps({"done": done}), flush=True)
"""
WISH = Wish(action="Walk")


@pytest.fixture(autouse=True)
def no_orphans() -> Iterator[None]:
    """At the end no child process of a desk is running."""
    yield
    time.sleep(0.1)
    assert [
        one
        for one in psutil.Process().children(recursive=True)
        if "A2V_TEST_WORK" in " ".join(one.cmdline())
    ] == []


def desk_of(folder: Path, *names: str) -> Desk:
    """A desk with photos that have not been processed yet."""
    library = Library(folder / "page")
    for name in names:
        arrived(library, name.encode(), name)
    return Desk(library, CHILD, cache=str(folder / "store"))


def go(desk: Desk, what: Callable[[], Awaitable[None]]) -> None:
    """Run a desk, and `what` meanwhile; at most half a minute."""

    async def all_of_it() -> None:
        desk.start()
        try:
            await asyncio.wait_for(what(), 30)
        finally:
            await desk.close()

    asyncio.run(all_of_it())


async def until(true: Callable[[], Any]) -> None:
    while not true():
        await asyncio.sleep(0.01)


def only(desk: Desk) -> Photo:
    (photo,) = desk.library.photos.values()
    return photo


def test_a_job_that_is_cancelled_while_its_process_starts_is_not_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start, begun = asyncio.create_subprocess_exec, list[float]()

    async def slowly(*words: Any, **how: Any) -> Any:
        begun.append(time.monotonic())
        await asyncio.sleep(0.3)
        return await start(*words, **how)

    desk = desk_of(tmp_path, "one")
    monkeypatch.setenv("A2V_TEST_WORK", "60")
    only(desk).status, only(desk).known = "ready", True

    async def change_of_mind() -> None:
        monkeypatch.setattr(asyncio, "create_subprocess_exec", slowly)
        jobs = [desk.library.add_job(only(desk), WISH) for _ in range(2)]
        desk.wake()
        await until(lambda: begun)
        before = time.monotonic()
        await desk.cancel(jobs[0])
        assert time.monotonic() - before < 15
        assert jobs[0].status == "cancelled"
        await until(lambda: jobs[1].status == "running")
        await until(lambda: (desk.library.place(jobs[1]) / "begun").exists())
        await desk.remove(only(desk))
        assert (
            not (desk.library.folder / "jobs").exists()
            or list((desk.library.folder / "jobs").iterdir()) == []
        )
        assert desk.library.jobs == {}

    go(desk, change_of_mind)


def test_a_photo_that_is_removed_while_it_is_looked_at_stays_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("A2V_TEST_WORK", "0.5")
    desk = desk_of(tmp_path, "one", "other")

    async def change_of_mind() -> None:
        photo = next(iter(desk.library.photos.values()))
        await until(lambda: (desk.library.place(photo) / "begun").exists())
        await desk.remove(photo)
        assert not desk.library.place(photo).exists()
        await until(lambda: only(desk).status == "ready")  # the other one's turn came
        await asyncio.sleep(0.7)
        assert not desk.library.place(photo).exists()

    go(desk, change_of_mind)


def test_a_job_that_is_asked_for_during_the_removal_goes_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("A2V_TEST_WORK", "60")
    desk = desk_of(tmp_path, "one")
    photo = only(desk)
    photo.status, photo.known = "ready", True

    async def late() -> None:
        first = desk.library.add_job(photo, WISH)
        desk.wake()
        await until(lambda: (desk.library.place(first) / "begun").exists())
        removing = asyncio.create_task(desk.remove(photo))
        await asyncio.sleep(0)
        with contextlib.suppress(InputError):
            desk.library.add_job(photo, WISH)
            desk.wake()
        await removing
        with pytest.raises(InputError, match="removed"):
            desk.library.add_job(photo, WISH)
        assert list((desk.library.folder / "jobs").iterdir()) == []

    go(desk, late)


def test_a_full_disk_ends_no_round_and_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, full = library_module.write_record, [True]

    def written(item: Record, folder: Path) -> None:
        if full[0]:
            raise InputError("cannot write it: No space left on device")
        write(item, folder)

    desk = desk_of(tmp_path, "one")
    monkeypatch.setattr(library_module, "write_record", written)

    async def while_it_is_full() -> None:
        await until(lambda: only(desk).status == "ready")
        assert "No space left" in desk.library.problem
        with pytest.raises(InputError):
            desk.library.add_job(only(desk), WISH)
        assert desk.library.jobs == {}
        full[0] = False
        arrived(desk.library, b"other", "other")
        desk.wake()
        await until(lambda: all(photo.status == "ready" for photo in desk.library.photos.values()))
        assert desk.library.problem == ""
        job = desk.library.add_job(only_first(desk), WISH)
        desk.wake()
        await until(lambda: job.status == "done")

    go(desk, while_it_is_full)
    assert [photo.status for photo in Library(tmp_path / "page").photos.values()] == [
        "ready",
        "ready",
    ]


def only_first(desk: Desk) -> Photo:
    return next(iter(desk.library.photos.values()))


def test_a_round_that_fails_is_followed_by_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    desk = desk_of(tmp_path, "one")
    do, calls = desk.cast.looker.do, list[int]()

    async def fails_once(*words: Any, **how: Any) -> Any:
        calls.append(1)
        if len(calls) == 1:
            raise RuntimeError("a defect")
        return await do(*words, **how)

    desk.cast.looker.do = fails_once  # type: ignore[method-assign]

    async def wait() -> None:
        await until(lambda: only(desk).status == "ready")

    go(desk, wait)
    assert "a defect" in capsys.readouterr().err


def test_a_person_who_is_removed_is_forgotten_unless_the_photo_is_here_twice(
    tmp_path: Path,
) -> None:
    desk = desk_of(tmp_path, "same", "same", "other")
    store = Store(tmp_path / "store")
    with using(store):
        refs = {name: put(Blob.of(name.encode())) for name in ("same", "other")}
        left = {name: put(Blob.of(b"person of " + name.encode())) for name in refs}
        for name in refs:
            store.remember("person", name * 20, left[name], {}, given=[refs[name]])

    async def remove() -> None:
        await until(lambda: all(photo.status == "ready" for photo in desk.library.photos.values()))
        for photo in list(desk.library.photos.values()):
            if photo.title == "same":
                before = sum(one.title == "same" for one in desk.library.photos.values())
                await desk.remove(photo)
                assert store.has(left["same"]) == (before == 2)
        assert store.has(left["other"])
        assert store.has(refs["other"])

    go(desk, remove)


def test_a_server_that_ends_before_it_has_forgotten_does_so_after_its_next_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Values of a person whose photo was sent again survive a kill between removal and cleanup."""
    desk = desk_of(tmp_path, "gone", "back")
    store, names = Store(tmp_path / "store"), ("gone", "back")
    with using(store):
        left = {name: put(Blob.of(b"person of " + name.encode())) for name in names}
        for name in names:
            store.remember("person", name * 20, left[name], {}, given=[put(Blob.of(name.encode()))])

    async def killed(*digests: object) -> Any:
        raise asyncio.CancelledError

    desk._forget = killed  # type: ignore[method-assign,assignment]
    for photo in list(desk.library.photos.values()):
        with contextlib.suppress(asyncio.CancelledError):
            asyncio.run(desk.remove(photo))
    assert all(map(store.has, left.values()))
    for name, value in (("SETTLED_SECONDS", 0.2), ("_TICK_SECONDS", 0.1)):
        monkeypatch.setattr(desk_module, name, value)

    async def wait() -> None:
        await until(lambda: not (tmp_path / "page" / "forgetting").exists())

    go(desk_of(tmp_path, "back"), wait)
    assert [store.has(left[name]) for name in names] == [False, True]


def test_a_cancellation_that_gets_lost_does_not_keep_the_server(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Return what has just finished, as `asyncio.wait_for` of Python 3.10 and 3.11 does."""
    desk = desk_of(tmp_path)
    lost = list[int]()

    async def deaf() -> None:
        while True:
            try:
                await asyncio.sleep(3600)
            except asyncio.CancelledError:
                lost.append(1)
                if len(lost) > 1:
                    raise

    monkeypatch.setattr(desk, "_rest", deaf)

    async def briefly() -> None:
        await asyncio.sleep(0.1)

    go(desk, briefly)
    assert len(lost) == 2


def test_threads_answer_wait_for_their_turn_and_keep_nobody() -> None:
    running, most = list[int](), list[int]()

    def work(number: int) -> int:
        running.append(number)
        most.append(len(running))
        time.sleep(0.05)
        running.remove(number)
        if number == 3:
            raise InputError("three")
        return number

    async def all_of_them() -> list[Any]:
        threads = Threads(2)
        return await asyncio.gather(
            *(threads.do(work, number) for number in range(5)), return_exceptions=True
        )

    answers = asyncio.run(all_of_them())
    assert [str(answer) for answer in answers] == ["0", "1", "2", "three", "4"]
    assert max(most) == 2

    async def gives_up() -> None:
        with contextlib.suppress(asyncio.TimeoutError, TimeoutError):
            await asyncio.wait_for(Threads(1).do(Event().wait), 0.1)

    asyncio.run(gives_up())  # would not return with `asyncio.to_thread`


def test_a_request_that_the_end_of_the_server_cuts_off_is_answered() -> None:
    sent = list[Any]()

    async def inner(scope: Any, receive: Any, send: Any) -> None:
        await asyncio.sleep(3600)

    async def send(message: Any) -> None:
        sent.append(message)

    async def ended() -> None:
        scope = {"type": "http", "path": "/key/", "headers": [(b"host", b"localhost")]}
        request = asyncio.ensure_future(Guard(inner, "key")(scope, send, send))  # type: ignore[arg-type]
        await asyncio.sleep(0.01)
        request.cancel()
        await request

    asyncio.run(ended())
    assert sent[0]["status"] == 503
    assert b"the server is stopping" in sent[1]["body"]


def test_what_was_cut_off_in_the_middle_is_cleared_at_the_start(tmp_path: Path) -> None:
    library = Library(tmp_path)
    photo = arrived(library, b"x", "a")
    job = library.add_job(photo, WISH)
    (library.arriving() / ORIGINAL).write_bytes(b"half")
    (path,) = library.remove(job)
    assert path.exists()
    again = Library(tmp_path)
    assert (list(again.photos), list(again.jobs), again.damaged) == ([photo.id], [], [])
    assert sorted(path.name for path in tmp_path.rglob("[!.]*") if path.is_file()) == [
        "original",
        "photo.json",
    ]
