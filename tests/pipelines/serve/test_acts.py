"""What people on the stage do: motions at once, for the sample person and for others."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics import quat_to_rotmat
from a2v.motion.plan import plan_motion
from a2v.samples import load_ready_person
from a2v.types import Body
from pipelines.serve.acts import SAMPLE
from pipelines.serve.cast import MAX_PLAYING
from pipelines.serve.figure import BODY, FIRST_SECONDS, QUATS, body_of, performed, play
from pipelines.serve.library import Library
from pipelines.serve.stages import packed
from pipelines.serve.wishes import Wish
from tests.support.page import Server, ready

ACTIONS = ("Walk", "eat_pie_burger", "walk for 2 s, then wave for 1 s")


@pytest.fixture(scope="module")
def body() -> Body:
    return load_ready_person().body


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory, body: Body) -> Iterator[Server]:
    folder = tmp_path_factory.mktemp("page")
    library = Library(folder)
    photo = ready(library)
    body.save(library.place(photo) / BODY)
    running = Server(folder)
    yield running
    running.end()


def asked(person: str, wish: object, server: Server) -> tuple[int, dict]:
    return server.say(f"api/people/{person}/play", {"wish": wish})


@pytest.mark.parametrize("action", ACTIONS)
def test_the_page_gets_what_a_film_shows(action: str, body: Body, server: Server) -> None:
    """The bones that are sent are those of the graph's nodes, within the steps of 16 bits."""
    wish = Wish(action=action, seconds=3.0, seed=5)
    status, told = asked(SAMPLE, wish.said(), server)
    assert status == 200, told
    moves, _, fps = performed(wish.request("photo").motion.resolve(), body)
    quats = np.frombuffer(base64.b64decode(told["bones"]), "<i2").reshape(len(moves), -1, 4)
    assert (told["fps"], told["frames"]) == (fps, wish.frames)
    sent = quat_to_rotmat(quats[..., [3, 0, 1, 2]] / QUATS)
    world = np.asarray(moves, np.float64)
    chain = np.empty_like(sent)
    for bone, parent in enumerate(body.bone_parents.tolist()):
        chain[:, bone] = sent[:, bone] if parent < 0 else chain[:, parent] @ sent[:, bone]
    assert np.abs(chain - world[..., :3, :3]).max() < 2e-3
    assert np.allclose(np.reshape(told["place"], (-1, 3)), world[:, 0, :3, 3], atol=1e-4)
    assert told["face"]["eyeBlinkLeft"]


@pytest.mark.parametrize("action", ["Wave", "Walk", "eat_pie_burger"])
def test_the_beginning_is_that_of_the_whole(action: str, body: Body) -> None:
    resolved = Wish(action=action, seconds=4.0).request("photo").motion.resolve()
    whole, blinks, fps = performed(resolved, body)
    first, faces, rate = performed(resolved, body, first=True)
    assert (len(first), rate) == (round(FIRST_SECONDS * fps), fps)
    assert np.median(np.abs(first - whole[: len(first)])[..., :3, 3].max((1, 2))) < 0.05
    assert all(np.array_equal(row, blinks[name][: len(row)]) for name, row in faces.items())


def test_words_of_the_page_for_a_part_are_kept() -> None:
    steps = plan_motion(
        "Walk at 1.5 x speed mirrored for 3 s, then Salsa at 0.5 x speed for 2 s"
    ).steps
    assert [(step.speed, step.wishes.mirror, step.seconds) for step in steps] == [
        (1.5, True, 3.0),
        (0.5, False, 2.0),
    ]


def test_a_part_of_the_page_has_a_take_of_its_own(body: Body) -> None:
    said = "Wave take 3 at 1.5 x speed mirrored for 1 s, then Bow for 1 s, then Walk take 2 for 1 s"
    assert [(step.action, step.seed) for step in plan_motion(said).steps] == [
        ("Wave", 2),
        ("Bow", None),
        ("Walk", 1),
    ]
    assert [step.seed for step in plan_motion("take 2 steps back, then take 3 bows").steps] == [
        None,
        None,
    ]

    def bones(action: str, seed: int) -> str:
        wish = Wish.of({"action": action, "seconds": 1.0, "seed": seed}).said()
        return str(play({"folder": "", "clip": None, "cache": None, "wish": wish})["bones"])

    for action in ("Wave", "Walk"):  # a clip, and an action of a model
        assert bones(f"{action} take 3", 0) == bones(f"{action} take 3", 7) == bones(action, 2)
        assert bones(f"{action} take 3", 0) != bones(action, 0)


def test_seed_mirror_and_tempo_change_what_is_played(body: Body) -> None:
    def bones(**how: object) -> str:
        wish = Wish.of({"action": "Wave", "seconds": 1.0, **how}).said()
        return str(play({"folder": "", "clip": None, "cache": None, "wish": wish})["bones"])

    found = [bones(), bones(seed=1), bones(mirror=True), bones(speed=2.0)]
    assert len(set(found)) == len(found)
    assert bones() == found[0]


def test_a_person_of_a_photo_acts_too(server: Server) -> None:
    (photo,) = server.state()["photos"]
    wish = {"action": "Jump", "seconds": 1}
    assert asked(photo["id"], wish, server)[1] == asked(SAMPLE, wish, server)[1]


def test_hostile_requests_to_act_are_refused(server: Server) -> None:
    for wish in (None, [], {"action": "xyzzy plugh"}, {"action": "Walk", "seconds": 1e9}):
        assert asked(SAMPLE, wish, server)[0] == 400
    assert asked(SAMPLE, {"action": "x", "clip": True}, server)[0] == 400  # it has no video
    assert asked("nobody", {"action": "Walk"}, server)[0] == 404
    assert asked("..%2f..", {"action": "Walk"}, server)[0] == 404
    for name in ("play", "still", "export"):
        body = json.dumps({"wish": {"action": "Walk"}}).encode()
        headers = {"Origin": "http://elsewhere"}
        assert server.ask(f"api/people/{SAMPLE}/{name}", "POST", body, headers)[0] == 403
        assert server.ask(f"api/people/{SAMPLE}/{name}", "POST", b"[" * 60000)[0] in (400, 404)
    assert 1 <= MAX_PLAYING <= 16


def test_who_is_not_made_cannot_act(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not made yet"):
        body_of(str(tmp_path))


def test_a_shape_is_what_the_page_reads() -> None:
    vertices = np.arange(12, dtype=np.float32).reshape(4, 3)
    faces = np.array([[0, 1, 2], [1, 2, 3]])
    data = packed(vertices, faces, np.full((4, 3), 0.5, np.float32))
    assert np.frombuffer(data, "<u4", 2).tolist() == [4, 2]
    assert np.array_equal(np.frombuffer(data, "<f4", 12, 8).reshape(4, 3), vertices)
    assert np.array_equal(np.frombuffer(data, "<u4", 6, 56).reshape(2, 3), faces)
    assert np.frombuffer(data, np.uint8, 12, 80).tolist() == [128] * 12
