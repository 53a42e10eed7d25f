"""Motions of files on the page: every person can do them."""

from __future__ import annotations

import base64
import json
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats import read_motion, write_motion
from a2v.formats.fbx import can_write
from a2v.motion.plan import plan_motion
from a2v.motion.timeline import Take
from a2v.types import Motion
from pipelines.serve.acts import SAMPLE
from pipelines.serve.library import Library
from pipelines.serve.wishes import Wish
from pipelines.sprites import seen_around
from tests.support.page import Server
from tests.support.uploads import hostile_uploads


@pytest.fixture(scope="module")
def walk() -> Motion:
    from a2v.motion.plan import make_steps

    plan = plan_motion("Walk", model="clips")
    return make_steps(None, plan.steps, Take(frames=60, fps=30.0, seed=0))


@pytest.fixture(scope="module")
def files(walk: Motion, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """One motion in the formats of other tools."""
    folder = tmp_path_factory.mktemp("files")
    found = {}
    for suffix in (".bvh", ".glb", ".npz", *([".fbx"] if can_write() else [])):
        write_motion(folder / f"walk{suffix}", walk)
        found[suffix] = (folder / f"walk{suffix}").read_bytes()
    return found


def send(server: Server, name: str, data: bytes) -> tuple[int, dict[str, Any]]:
    status, _, body = server.ask(f"api/motions?name={name}", "POST", data)
    return status, json.loads(body)


def played(server: Server, motion: str, person: str = SAMPLE, **more: object) -> tuple[int, dict]:
    wish = {"action": "walk", "motion": motion, "seconds": 2.0, **more}
    return server.say(f"api/people/{person}/play", {"wish": wish})


def test_every_kind_of_file_becomes_the_same_motion(
    server: Server, files: dict[str, bytes], walk: Motion
) -> None:
    """By its content, whatever it is called; the uploaded file is not kept."""
    shown = []
    for suffix, data in files.items():
        for name in (f"my%20walk{suffix}", "my walk.bvh"):
            status, kept = send(server, name.replace(" ", "%20"), data)
            assert (status, kept["title"]) == (201, "my walk"), kept
            assert "digest" not in kept
            assert kept["seconds"] == walk.frames / walk.fps
            folder = server.folder / "motions" / kept["id"]
            assert sorted(path.name for path in folder.iterdir()) == ["motion.json", "motion.npz"]
            status, told = played(server, kept["id"])
            assert status == 200, told
            shown.append(np.frombuffer(base64.b64decode(told["bones"]), "<i2").astype(int))
    assert all(np.abs(one - shown[0]).max() < 330 for one in shown)  # 1 % of a quaternion
    assert [one["id"] for one in server.state()["motions"]] != []
    mirrored = played(server, kept["id"], mirror=True)[1]
    assert mirrored["bones"] != told["bones"]
    assert played(server, kept["id"], speed=2.0)[1]["frames"] < told["frames"]


def test_a_motion_stays_until_it_is_removed(server: Server, files: dict[str, bytes]) -> None:
    _, kept = send(server, "walk.bvh", files[".bvh"])
    assert kept["id"] in Library(server.folder).motions
    photo = server.state()["photos"][0]["id"]
    wish = {"action": "walk", "motion": kept["id"], "seconds": 0.2, "size": 64, "spp": 1}
    status, job = server.say("api/jobs", {"photo": photo, "wish": wish})
    assert status == 201
    status, told = server.say(f"api/motions/{kept['id']}", {}, "DELETE")
    assert (status, "cancel the films" in told["problem"]) == (400, True)
    assert server.ask(f"api/jobs/{job['id']}", "DELETE")[0] == 200
    assert server.ask(f"api/motions/{kept['id']}", "DELETE")[0] == 200
    assert not (server.folder / "motions" / kept["id"]).exists()
    assert server.ask(f"api/motions/{kept['id']}", "DELETE")[0] == 404
    for status, told in (
        played(server, kept["id"]),
        server.say("api/jobs", {"photo": photo, "wish": wish}),
    ):
        assert (status, "removed" in told["problem"]) == (400, True)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("walk.bvh", b"", "is empty"),
        ("walk.bvh", b"HIERARCHY\nROOT", "line"),
        ("walk.exe", b"MZ" + bytes(90), "unknown kind of motion"),
        (
            "..%2F..%2Fx%00.fbx",
            b"Kaydara FBX Binary  \0" + bytes(90),
            "cannot read this file|FBX needs",
        ),
        ("walk.pkl", pickle.dumps({"__import__": print}), "this file"),
        ("walk.npy", b"\x93NUMPY\x01\x00", "this file"),
        ("me.jpg", b"\xff\xd8\xff\xe0", "unknown kind of motion"),
        ("bones.json", b"[" * 70000, "this file cannot be read"),
    ],
)
def test_what_is_no_motion_is_refused_with_a_sentence(
    server: Server, name: str, data: bytes, said: str
) -> None:
    before = server.state()["motions"]
    status, told = send(server, name, data)
    assert status == 400
    assert re.search(said, told["problem"]), told
    assert str(server.folder) not in told["problem"]
    assert "Error" not in told["problem"]
    assert not list(server.folder.glob("incoming/*"))
    assert server.state()["motions"] == before


def test_the_sentence_is_that_of_the_command(server: Server, tmp_path: Path) -> None:
    path = tmp_path / "legless.bvh"
    path.write_text(
        "HIERARCHY\nROOT UpperSpine\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        "JOINT Head\n{\nOFFSET 0 10 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\n"
        "OFFSET 0 9 0\n}\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0 0 0 0\n0 0 0 0 0 0\n"
    )
    with pytest.raises(InputError) as refused:
        read_motion(path)
    command = str(refused.value).split(": ", 1)[1]
    _, told = send(server, "legless.bvh", path.read_bytes())
    said = command.split(";")[0].replace("_", " ").replace("UpperSpine", "Upper Spine")
    assert told["problem"].split(": ", 1)[1].split(";")[0] == said


def test_hostile_files_leave_a_sentence_and_a_running_server(server: Server) -> None:
    for number, data in enumerate(hostile_uploads()):
        suffix = (".bvh", ".npz", ".pkl", ".glb", ".txt", "")[number % 6]
        status, told = send(server, f"x{suffix}", data)
        assert status == 400, (number, told)
        assert "something went wrong" not in told["problem"], (number, data[:40])
    assert not list(server.folder.glob("incoming/*"))


def test_a_wish_for_sprites_has_views_of_its_own() -> None:
    wish = Wish(
        action="Walk", sprites=8, size=128, fps=8.0, seconds=2.0, views=("front",), camera="still"
    )
    assert wish.pictures == 8 * 16
    film = seen_around(wish.request("me.jpg"), wish.sprites).film
    assert film.background == "transparent"
    assert Wish(action="Walk", animation="gif").request("me.jpg").film.views
    for wrong in ({"sprites": 5}, {"sprites": 8, "size": 1080, "seconds": 3}, {"animation": "mp4"}):
        with pytest.raises(InputError):
            Wish.of({"action": "x", **wrong})


def test_a_wish_names_a_motion_by_its_identity() -> None:
    own = "0123456789abcdef"
    wish = Wish(action="my walk", motion=own, seconds=2.0, seed=3)
    assert wish.request("me.jpg", clip="motion.npz").motion.motion == "motion.npz"
    assert Wish.of(wish.said()) == wish
    for other in ({"motion": "../x"}, {"motion": 1}, {"motion": own, "clip": True}):
        with pytest.raises(InputError):
            Wish.of({"action": "x", **other})
    with pytest.raises(InputError, match="clear the path"):
        Wish(action="x", motion=own, path="0,0 1,1")
