"""A video on the page whose motion the person copies."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.rendering import write_video
from pipelines.engine.memo import refs_within
from pipelines.engine.refs import File
from pipelines.serve.wishes import Wish
from tests.support.page import Server


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("film") / "film.mp4"
    write_video(path, [np.full((96, 128, 3), shade, np.uint8) for shade in range(0, 250, 25)], 10.0)
    return path.read_bytes()


def send(server: Server, name: str, data: bytes) -> tuple[int, bytes]:
    photo = server.state()["photos"][0]["id"]
    status, _, body = server.ask(f"api/photos/{photo}/clip?name={name}", "POST", data)
    return status, body


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("me.exe", b"MZ", "not named like a video"),
        ("me.mp4", b"", "is empty"),
        ("me.mp4", b"#EXTM3U\nfile:///etc/passwd\n", "not a video that can be read"),
        ("me.webm", bytes(5000), "not a video that can be read"),
        ("..%2F..%2Fme.mov", b"GIF89a", "not a video that can be read"),
    ],
)
def test_what_is_no_video_is_refused_with_a_sentence(
    server: Server, name: str, data: bytes, said: str
) -> None:
    status, body = send(server, name, data)
    assert status == 400
    assert said in body.decode()
    assert b"/" not in body  # no name of a file of ours
    assert not list(server.folder.glob("incoming/*"))
    assert server.state()["photos"][0]["clip"] == ""


def test_a_video_belongs_to_its_person_and_goes_with_them(server: Server, film: bytes) -> None:
    photo = server.state()["photos"][0]["id"]
    wish = {"action": "dance", "clip": True}
    status, told = server.say("api/jobs", {"photo": photo, "wish": wish})
    assert (status, "send one first" in told["problem"]) == (400, True)
    assert send(server, "my%20dance.MP4", film)[0] == 201
    shown = server.state()["photos"][0]
    assert (shown["clip"], shown["clip_title"], shown["clip_seconds"]) == (".mp4", "my dance", 1.0)
    assert "clip_digest" not in shown
    kept = server.folder / "photos" / photo / "clip.mp4"
    assert kept.read_bytes() == film
    assert server.ask(f"photos/{photo}/clip.mp4")[0] == 404  # the upload is never served
    assert server.ask(f"api/photos/{photo}/clip", "DELETE")[0] == 200
    assert not kept.exists()
    assert send(server, "again.mp4", film)[0] == 201
    assert server.ask(f"api/photos/{photo}", "DELETE")[0] == 200
    assert not list(server.folder.rglob("clip*"))


def test_a_wish_takes_the_motion_of_the_video() -> None:
    wish = Wish(action="my dance", clip=True, model="cmu", seed=3, seconds=2.0)
    request = wish.request("me.jpg", clip="clip.mp4")
    assert request.motion.motion == "clip.mp4"
    assert request.motion.path is None
    with pytest.raises(InputError, match="clear the path"):
        dataclasses.replace(wish, path="0,0 1,1")
    with pytest.raises(InputError, match="true or false"):
        Wish.of({"action": "x", "clip": "clip.mp4"})


def test_what_was_made_of_a_video_is_found_again_to_be_forgotten(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    path.write_bytes(b"some film")
    given: Any = File.of(path)
    assert [ref.digest for ref in refs_within([given])] == [given.digest]
