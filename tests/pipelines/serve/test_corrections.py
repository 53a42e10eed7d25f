"""Corrections, further photos, paths and exports: what the server accepts and stores."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest
import yaml

from a2v.errors import InputError
from a2v.perception import Corrections, read_corrections
from pipelines.serve.desk import Desk
from pipelines.serve.library import Library
from pipelines.serve.records import Photo, read_record
from pipelines.serve.talk import CORRECTIONS
from pipelines.serve.wishes import Wish
from tests.support.page import Server, arrived, ready
from tests.support.uploads import picture

SAID = {
    "units": "fractions",
    "landmarks": {"left_wrist": [0.25, 0.5]},
    "limbs": {"left_lower_arm": "back"},
}


def test_what_cannot_be_is_told(server: Server) -> None:
    photo = server.state()["photos"][0]["id"]
    for said, told in (
        ({"limbs": {"tail": "front"}}, "unknown limb"),
        ({"person": 9}, "person is 9"),
        ({"mask": [{"add": [[0, 0]]}]}, "radius"),
    ):
        for path, method in (("corrections", "PUT"), ("outline", "POST")):
            status, answer = server.say(f"api/photos/{photo}/{path}", said, method)
            assert status == 400
            assert told in answer["problem"].lower()
    assert server.say("api/photos/0123456789abcdef/corrections", {}, "PUT")[0] == 404
    assert server.ask(f"photos/{photo}/{CORRECTIONS}")[0] == 404
    for said in ({}, {"rig": "nobody's", "format": ".glb"}, {"rig": "mixamo", "format": "../x"}):
        assert server.say("api/people/0123456789abcdef/export", said)[0] in (400, 404)


def test_a_further_photo_is_one_and_another(server: Server) -> None:
    photo = server.state()["photos"][0]["id"]
    status, _, body = server.ask(f"api/photos/{photo}/more", "POST", b"no photo")
    assert status == 400
    other = picture(size=(300, 300))
    status, _, body = server.ask(f"api/photos/{photo}/more", "POST", other)
    assert status == 201
    assert len(json.loads(body)["more"]) == 1
    assert server.ask(f"photos/{photo}/more-1.jpg")[0] == 200
    assert server.ask(f"photos/{photo}/more-1")[0] == 404  # the upload is never served
    assert b"here already" in server.ask(f"api/photos/{photo}/more", "POST", other)[2]
    assert server.ask(f"api/photos/{photo}/more", "DELETE")[0] == 200
    assert server.state()["photos"][0]["more"] == []
    assert not list((server.folder / "photos" / photo).glob("more*"))


def test_corrections_are_kept_and_looked_at_again(tmp_path: Path) -> None:
    library = Library(tmp_path)
    photo = arrived(library, picture(), "somebody")
    desk = Desk(library, "", cache=str(tmp_path / "store"))
    with pytest.raises(InputError, match="still being detected"):
        desk.correct(photo, Corrections.of(SAID))
    photo.status = "ready"
    desk.correct(photo, Corrections.of(SAID))
    assert (photo.status, photo.corrected, photo.known) == ("looking", True, False)
    path = library.place(photo) / CORRECTIONS
    assert read_corrections(path.read_bytes(), path) == Corrections.of(SAID)
    assert yaml.safe_load(path.read_text())["limbs"] == {"left_lower_arm": "back"}
    assert read_record(Photo, library.place(photo)).corrected
    job = library.add_job(photo, Wish(action="Walk"))
    task = desk.task_of(job)
    request = Wish.of(task["wish"]).request(task["photo"], task["corrections"], task["more"])
    assert request.person.corrections == str(path)
    assert request.person.more is None
    photo.status = "ready"
    desk.correct(photo, Corrections())
    assert not path.exists()
    assert desk.task_of(job)["corrections"] is None


def test_a_path_is_points_and_nothing_else() -> None:
    wish = Wish(action="Walk", path="0,0 0,2 -1.5,3.25")
    assert wish.request("a.jpg").motion.path == "0,0 0,2 -1.5,3.25"
    wish.check_path()
    assert Wish(action="Walk").request("a.jpg").motion.path is None
    for path in (
        "/etc/passwd",
        "0,0",
        "way.csv",
        "0,0 100,0",
        "0,0 1,nan",
        "0,0\n1,1",
        " ".join(["0,0"] * 41),
    ):
        with pytest.raises(InputError, match="path is"):
            Wish(action="Walk", path=path)


def test_further_photos_are_forgotten_too(tmp_path: Path) -> None:
    library = Library(tmp_path)
    photo = ready(library)
    photo.more = ["a" * 32, "b" * 32]
    desk = Desk(library, "", cache=str(tmp_path / "store"))
    asked = list[list[str]]()

    async def forget(digests: list[str]) -> object:
        asked.append(list(digests))
        return None

    desk._forget = forget  # type: ignore[method-assign,assignment]
    asyncio.run(desk.remove(photo))
    assert asked == [[photo.digest, *photo.more]]


def test_who_is_removed_is_fitted_no_longer(tmp_path: Path) -> None:
    library = Library(tmp_path / "page")
    photo = ready(library)
    waits = "import sys, time\nfor line in sys.stdin: time.sleep(60)"
    desk = Desk(library, waits, cache=str(tmp_path / "store"))

    async def both() -> None:
        waiting = asyncio.create_task(desk.cast.outline(photo, Corrections()))
        while not desk.cast.looker.alive:
            await asyncio.sleep(0.01)
        await asyncio.wait_for(desk.remove(photo), 20)
        with pytest.raises(InputError, match="has ended"):
            await waiting
        assert not desk.cast.looker.alive

    asyncio.run(both())
