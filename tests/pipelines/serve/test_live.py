"""The live mode: frames of a camera drive a character."""

from __future__ import annotations

import base64
import http.client
import json
import re
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from playwright.sync_api import expect

from a2v.errors import InputError
from a2v.formats.registry import read_motion
from pipelines.serve.live import MAX_FRAME
from pipelines.serve.live_child import MOST_SIDE, Session, decoded, serve
from tests.support.browser import LOCAL, SOFTWARE, calm, chromium
from tests.support.footage import picture
from tests.support.live import TOKEN, jpeg, live_server, plain_character, write_camera

STUB = """
from pipelines.serve.talk import answer
def work(task, tell):
    if task["task"] == "frame" and task["time"] < 0:
        raise ValueError("broken")
    return {"state": "nobody", "task": task["task"], "vmc": task.get("vmc")}
answer(work)
"""
"""A child process that answers without computing."""


def ask(address: str, path: str, method: str, body: bytes = b"", **headers: str) -> tuple[int, Any]:
    place = urlsplit(address)
    connection = http.client.HTTPConnection("127.0.0.1", place.port, timeout=60)
    try:
        connection.request(method, f"/{TOKEN}/{path}", body, headers)
        answer = connection.getresponse()
        return answer.status, json.loads(answer.read())
    finally:
        connection.close()


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str]]:
    with live_server(tmp_path_factory.mktemp("live"), STUB, 39539) as found:
        yield found


def test_a_session_answers_frames_and_ends(quick: tuple[str, str]) -> None:
    address, photo = quick
    status, told = ask(address, f"api/people/{photo}/live", "POST")
    assert (status, told["vmc"]) == (201, 39539)
    own = f"api/live/{told['session']}"
    assert ask(address, f"{own}/frame?time=0.1", "POST", b"x")[1]["task"] == "frame"
    assert ask(address, f"{own}/record", "POST", b'{"on": true}')[0] == 200
    assert ask(address, own, "DELETE")[0] == 200
    status, told = ask(address, f"{own}/frame?time=0.2", "POST", b"x")
    assert (status, told["problem"]) == (404, "this live session has ended; start it again")


def test_bad_frames_are_refused(quick: tuple[str, str]) -> None:
    address, photo = quick
    own = f"api/live/{ask(address, f'api/people/{photo}/live', 'POST')[1]['session']}"
    assert ask(address, f"{own}/frame?time=0", "POST", bytes(MAX_FRAME + 1))[0] == 413
    assert ask(address, f"{own}/frame?time=now", "POST", b"x")[0] == 400
    assert ask(address, f"{own}/frame?time=-1", "POST", b"x")[0] == 400
    assert ask(address, "api/live/other/frame?time=0", "POST", b"x")[0] == 404
    status, told = ask(address, f"{own}/frame?time=0", "POST", b"x", Origin="http://elsewhere")
    assert (status, told["problem"]) == (403, "requests from other pages are refused")
    assert ask(address, "api/people/nothing/live", "POST")[0] == 404


def test_frames_are_checked_before_they_are_decoded() -> None:
    assert decoded(jpeg(np.zeros((80, 100, 3), np.uint8))).shape == (80, 100, 3)
    for data in (
        b"",
        b"\xff\xd8\xff",
        b"\x89PNG\r\n\x1a\n",
        jpeg(np.zeros((80, 100, 3), np.uint8))[:60],
    ):
        with pytest.raises(InputError, match="not a JPEG"):
            decoded(data)
    for size in ((80, MOST_SIDE + 1), (20, 100)):
        with pytest.raises(InputError, match="expected 64 to"):
            decoded(jpeg(np.zeros((*size, 3), np.uint8)))


def test_frames_move_the_character_and_are_recorded(tmp_path: Path) -> None:
    """The process's own functions: a person walks through the picture; VMC arrives."""
    pytest.importorskip("pythonosc")
    from pythonosc.osc_bundle import OscBundle

    sessions: list[Session] = []

    def do(**task: Any) -> Any:
        return serve(task, lambda _: None, sessions, lambda _: plain_character())

    with pytest.raises(InputError, match="not open"):
        do(task="record")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as heard:
        heard.bind(("127.0.0.1", 0))
        heard.settimeout(5)
        do(task="open", folder=str(tmp_path), vmc=heard.getsockname()[1])
        do(task="record")
        with pytest.raises(InputError, match="0 poses"):
            do(task="keep")
        do(task="record")
        states, told = [], {}
        for number in range(16):
            frame = base64.b64encode(jpeg(picture(110 + 6 * number))).decode()
            told = do(task="frame", jpeg=frame, time=number / 10)
            states.append(told["state"])
        assert states[0] == "warming"
        assert states[-1] == "driven"
        bones = np.array(told["bones"]).reshape(-1, 4)
        assert len(bones) == len(plain_character().body.bone_names)
        assert np.allclose(np.linalg.norm(bones, axis=1), 1, atol=1e-3)
        assert do(task="frame", jpeg=frame, time=0.3)["state"] == "late"
        bundle = OscBundle(heard.recv(65_535))
        names = [bundle.content(i).params[0] for i in range(2, bundle.num_contents)]
        assert names[:2] == ["root", "Hips"]
        assert "RightLowerLeg" in names
    files = do(task="keep")["files"]
    assert set(files) == {"live/live-1.bvh", "live/live-1.glb"}
    motion = read_motion(tmp_path / "live" / "live-1.bvh")
    assert motion.frames >= 15


@pytest.mark.slow
def test_the_button_moves_the_person(tmp_path: Path) -> None:
    """A browser with a camera that shows a person; the recording is among the files."""
    camera = tmp_path / "camera.mjpeg"
    write_camera(camera, [picture(110 + 60 * np.sin(step / 8)) for step in range(50)])
    flags = (
        "--use-fake-device-for-media-stream",
        "--use-fake-ui-for-media-stream",
        f"--use-file-for-fake-video-capture={camera}",
    )
    (tmp_path / "folder").mkdir()
    with (
        live_server(tmp_path / "folder") as (address, photo),
        chromium(*SOFTWARE, *flags, exclude=LOCAL) as browser,
    ):
        context = browser.new_context(viewport={"width": 320, "height": 500})
        calm(context)
        page = context.new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.set_default_timeout(240_000)
        page.goto(address)
        page.locator("body[data-person]").wait_for()
        page.locator("#people button").last.click()
        page.locator(f"body[data-person='{photo}']").wait_for()
        page.locator("summary", has_text="Copy a motion").click()
        page.get_by_role("button", name="Live camera").click()
        expect(page.locator("p[data-state=driven]")).to_be_attached(timeout=240_000)
        page.get_by_role("button", name="Record").click()
        recorded = re.compile(r"^([6-9]|\d\d+)$")
        expect(page.locator("p[data-state]")).to_have_attribute(
            "data-recorded", recorded, timeout=240_000
        )
        page.get_by_role("button", name="Keep the recording").click()
        expect(page.get_by_text("among the files")).to_be_visible(timeout=240_000)
        page.wait_for_timeout(3000)  # the page has asked for the files, and the camera goes on
        expect(page.get_by_text("among the files")).to_be_visible()
        expect(page.locator("p[data-state=driven]")).to_be_attached()
        page.get_by_role("button", name="Stop", exact=True).click()
        page.locator("summary", has_text="The photo and the person").click()
        expect(page.get_by_role("link", name="Recorded with the camera: GLB")).to_be_visible()
        assert errors == []
