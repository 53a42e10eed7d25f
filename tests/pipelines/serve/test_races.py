"""A person who is removed at any moment stays away, and uploads at the same time keep apart."""

from __future__ import annotations

import asyncio
import random
import shutil
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.exceptions import HTTPException

from a2v.errors import A2VError, InputError
from a2v.folders import make_folder, owner_mark
from a2v.footage.figure import person_skeleton
from a2v.io import atomic_path
from a2v.rendering import write_video
from pipelines.serve.arrivals import MAX_ARRIVING, MAX_ARRIVING_BYTES, Arrivals
from pipelines.serve.desk import Desk
from pipelines.serve.edge import MAX_CLIP
from pipelines.serve.library import Library
from pipelines.serve.live import Live
from pipelines.serve.live_child import Session, kept
from tests.support.hostile import COUNT
from tests.support.live import plain_character
from tests.support.motions import person as walker
from tests.support.page import Server, ready
from tests.support.races import CORRECTED, photograph, remove_at_moments
from tests.support.writer import WRITER

MOMENTS = 50
CLIENTS = 40


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("film") / "film.mp4"
    write_video(path, [np.full((96, 128, 3), shade, np.uint8) for shade in range(0, 250, 25)], 10.0)
    return path.read_bytes()


def test_nobody_makes_a_folder_that_its_owner_removed(tmp_path: Path) -> None:
    room = tmp_path / "photos"
    (room / "me").mkdir(parents=True)
    owner_mark(room).touch()
    with atomic_path(room / "me" / "live" / "a.glb") as temporary:
        temporary.write_bytes(b"x")
    shutil.rmtree(room / "me")
    for path in (room / "me" / "a", room / "me" / "live" / "a", room / "you" / "a"):
        with (
            pytest.raises(InputError, match="was removed"),
            atomic_path(path) as temporary,
        ):
            temporary.write_bytes(b"x")
    assert list(room.iterdir()) == []
    make_folder(tmp_path / "others" / "a" / "b")  # elsewhere folders are made as ever
    assert (tmp_path / "others" / "a" / "b").is_dir()


def test_a_folder_that_is_removed_while_a_file_is_written(tmp_path: Path) -> None:
    room = tmp_path / "photos"
    (room / "me").mkdir(parents=True)
    owner_mark(room).touch()

    def written() -> None:
        with atomic_path(room / "me" / "a") as temporary:
            temporary.write_bytes(b"x")
            (room / "me").rename(tmp_path / "removed")

    with pytest.raises(InputError):
        written()
    assert list(room.iterdir()) == []


def test_a_person_is_removed_at_fifty_moments(tmp_path: Path, film: bytes) -> None:
    """Live, uploads, maker, looker, films, exports and corrections; nothing is left of anybody."""
    remove_at_moments(tmp_path, film, random.Random(58), MOMENTS)


def test_the_real_maker_and_looker_lose_their_person(tmp_path: Path, film: bytes) -> None:
    """With `make fuzz`'s count many more moments."""
    remove_at_moments(tmp_path, film, random.Random(59), 30 if COUNT else 4, real=True)


def test_a_live_session_ends_with_its_person(tmp_path: Path) -> None:
    desk = Desk(Library(tmp_path / "page"), WRITER, cache=str(tmp_path / "store"))
    live = Live(desk, WRITER)

    async def one_session() -> None:
        photo = ready(desk.library)
        await live.open(photo)
        recording = asyncio.create_task(live.record(False))
        await asyncio.sleep(0.05)
        await desk.remove(photo)
        assert not live._child.alive
        assert live._session == ""
        with pytest.raises((InputError, HTTPException)):
            await recording
        with pytest.raises(HTTPException) as ended:
            await live.frame(b"x", 1.0)
        assert ended.value.status_code == 404
        assert not live._child.alive
        assert not desk.library.place(photo).exists()
        await desk.close()

    asyncio.run(one_session())


def test_a_recording_is_not_written_for_a_person_who_is_gone(tmp_path: Path) -> None:
    """The live mode's own function, while the folder goes at random moments."""
    library = Library(tmp_path)
    character = plain_character()
    poses = walker(person_skeleton(), frames=8).joints
    draw = random.Random(0)
    took = 0.2
    for number in range((COUNT and MOMENTS) or MOMENTS // 5):
        photo = ready(library)
        session = Session(library.place(photo), character, None, None, None)  # type: ignore[arg-type]
        session.recorded = [(at / 10, joints) for at, joints in enumerate(poses)]
        said = list[object]()

        def record(session: Session = session, said: list[object] = said) -> None:
            try:
                said.append(kept(session))
            except A2VError as error:
                said.append(error)

        begun = time.monotonic()
        writing = threading.Thread(target=record)
        writing.start()
        if number:  # the first one is not disturbed
            time.sleep(draw.uniform(0, took))
        else:
            writing.join()
            took = time.monotonic() - begun
            assert isinstance(said[0], dict), said
        for folder in library.remove(photo):
            shutil.rmtree(folder, ignore_errors=True)
        writing.join()
        assert len(said) == 1, "a traceback"
        assert list((tmp_path / "photos").iterdir()) == []
        assert [path for path in (tmp_path / "removed").rglob("*") if path.is_file()] == []


def test_corrections_that_arrive_after_the_removal_are_refused(tmp_path: Path) -> None:
    desk = Desk(Library(tmp_path / "page"), "", cache=str(tmp_path / "store"))
    photo = ready(desk.library)
    asyncio.run(desk.remove(photo))
    with pytest.raises(InputError, match="was removed"):
        desk.correct(photo, CORRECTED)
    assert list((desk.library.folder / "photos").iterdir()) == []


def test_uploads_are_counted_and_bounded_in_sum(tmp_path: Path) -> None:
    async def nothing(digests: Any) -> Any:
        return None

    arrivals = Arrivals(Library(tmp_path), None, forget=nothing)  # type: ignore[arg-type]

    async def fill(size: int) -> int:
        taken = 0

        async def one() -> None:
            nonlocal taken
            async with arrivals.folder(size):
                taken += 1
                await asyncio.sleep(0.05)

        said = await asyncio.gather(*(one() for _ in range(85)), return_exceptions=True)
        assert all(isinstance(one, HTTPException) and one.status_code == 503 for one in said if one)
        return taken

    assert asyncio.run(fill(1)) == MAX_ARRIVING
    assert asyncio.run(fill(MAX_CLIP)) == MAX_ARRIVING_BYTES // MAX_CLIP
    assert list((tmp_path / "incoming").iterdir()) == []
    assert arrivals._sizes == []


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    folder = tmp_path / "page"
    ready(Library(folder))
    running = Server(folder)
    yield running
    running.end()


def test_forty_clients_at_once(server: Server, film: bytes) -> None:
    """Every accepted upload is one file that the record names; after a removal none is left."""
    own = f"api/photos/{server.state()['photos'][0]['id']}"
    folder = server.folder / "photos" / own.rpartition("/")[2]

    def further(number: int) -> int:
        return server.ask(f"{own}/more", "POST", photograph(number))[0]

    def mixed(number: int) -> int:
        if number % 4 == 0:
            return server.ask(f"{own}/more", "DELETE")[0]
        if number % 4 == 1:
            suffix = (".mp4", ".webm", ".mov")[number % 3]
            data = film + bytes(number)  # another content
            return server.ask(f"{own}/clip?name=a{suffix}", "POST", data)[0]
        return further(number)

    with ThreadPoolExecutor(CLIENTS) as pool:
        answers = list(pool.map(further, range(CLIENTS)))
        assert set(answers) <= {201, 400, 503}
        (photo,) = server.state()["photos"]
        assert answers.count(201) == len(photo["more"]) == 7
        agree(folder, photo)
        answers = list(pool.map(mixed, range(3 * CLIENTS)))
        assert set(answers) <= {200, 201, 400, 503}
        assert 201 in answers
        (photo,) = server.state()["photos"]
        agree(folder, photo)
        going = [pool.submit(mixed, number) for number in range(CLIENTS)]
        time.sleep(0.2)
        assert server.ask(own, "DELETE")[0] == 200
        assert {one.result() for one in going} <= {200, 201, 400, 404, 503}
    assert server.state()["photos"] == []
    for room in ("photos", "incoming", "removed"):
        assert not any(path.is_file() for path in (server.folder / room).rglob("*")), room


def agree(folder: Path, photo: dict[str, Any]) -> None:
    """Check that the files of a person are those of the record."""
    further = [f"more-{number + 1}" for number in range(len(photo["more"]))]
    names = {path.name for path in folder.iterdir()}
    assert {name for name in names if name.startswith("more")} == {
        name + suffix for name in further for suffix in ("", ".jpg")
    }
    assert len({(folder / name).read_bytes() for name in further}) == len(further)
    films = [name for name in names if name.startswith("clip")]
    assert films == ([f"clip{photo['clip']}"] if photo["clip"] else [])
