"""The page in a real browser: from a photo to files, two users at once, and a restart."""

from __future__ import annotations

import base64
import io
import json
import re
import shutil
import signal
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page, Request, expect

from a2v.formats.bvh import write_bvh
from a2v.perception import read_corrections
from tests.support.browser import LOCAL, SOFTWARE, calm, chromium
from tests.support.motions import person
from tests.support.page import CONTRAST, NAMELESS, ROOT, Server
from tests.support.whole_run import whole_run

SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"
LONG = 300_000.0
"""Milliseconds for steps that may compute a person first, on a busy machine."""
FIRST_BYTES = 900_000
"""Largest size of all that the page loads before the person."""

expect.set_options(
    timeout=60_000
)  # The default is five seconds, which a busy machine may need for one poll.


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """Its store knows the sample's person but for `colored_surface`, the cheapest stage, so that it
    does not matter what other tests have left in the common store."""
    base = tmp_path_factory.mktemp("page")
    store = Path(shutil.copytree(whole_run().store, base / "store"))
    shutil.rmtree(store / "calls" / "colored_surface")
    running = Server(base / "folder", cache=store)
    yield running
    running.end()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    camera = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream")
    with chromium(*SOFTWARE, *camera, exclude=LOCAL) as opened:
        yield opened


@pytest.fixture
def visit(browser: Browser, server: Server) -> Iterator[Callable[..., Page]]:
    """Open the page in a separate browser; only the server is requested, and nothing fails."""
    contexts: list[BrowserContext] = []
    asked: list[Request] = []
    errors: list[str] = []

    def opened(**how: Any) -> Page:
        context = browser.new_context(**how)
        calm(context)
        contexts.append(context)
        page = context.new_page()
        page.on("request", lambda request: asked.append(request))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on(
            "console",
            lambda line: (
                errors.append(line.text) if "Content Security Policy" in line.text else None
            ),
        )
        page.set_default_timeout(60_000)
        page.goto(server.address)
        expect(page.locator("body[data-ready=yes]")).to_be_visible(timeout=60_000)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert [
        one.url for one in asked if not one.url.startswith((server.address, "blob:", "data:"))
    ] == []
    assert errors == []


def on_stage(page: Page, person: str, timeout: float = LONG) -> None:
    """Wait until a person stands on the stage."""
    page.locator(f"body[data-person='{person}']").wait_for(timeout=timeout)


def upload_sample(page: Page, server: Server) -> str:
    """Upload the sample photo, wait until the page shows its person, and return its id."""
    earlier = {photo["id"] for photo in server.state()["photos"]}
    with page.expect_response(lambda answer: "api/photos?" in answer.url):
        page.locator("#file").set_input_files(SAMPLE)
    (photo,) = {str(one["id"]) for one in server.state()["photos"]} - earlier
    on_stage(page, photo)
    return photo


def unfold_person(page: Page) -> None:
    """Open what is known about the photo."""
    page.locator("#person").evaluate("item => { item.open = true; }")


def order(page: Page, words: str, seconds: str = "1") -> str:
    """Request a small film of twelve frames per second; return the job's id."""
    with page.expect_response(lambda answer: answer.url.endswith("api/words")):
        page.locator("#action").fill(words)
    expect(page.locator("#doing")).to_have_text(re.compile(words[:4], re.IGNORECASE))
    page.locator("#chips .chip").first.click()
    page.get_by_label(re.compile("^Seconds of")).fill(seconds)
    page.keyboard.press("Tab")
    page.locator("#export").click()
    page.get_by_role("tab", name="Film").click()
    page.locator("#exporting summary").click()
    page.get_by_label("Size").select_option("256")
    page.get_by_label("Grain").select_option("4")
    page.get_by_label("Frames a second").select_option("12")
    with page.expect_response(lambda answer: answer.url.endswith("api/jobs")) as answered:
        page.get_by_role("button", name="Make the film").click()
    return str(answered.value.json()["id"])


def test_the_sample_person_is_there_first(visit: Callable[..., Page], server: Server) -> None:
    page = visit()
    on_stage(page, "sample")
    drawn = page.locator("#stage").get_attribute("data-frames")
    expect(page.locator("#stage")).not_to_have_attribute("data-frames", str(drawn))
    expect(page.locator("#who")).to_have_text("Sample person")
    names = [path.name for path in (ROOT / "pipelines" / "serve" / "page").iterdir()]
    before = ["", *(f"page/{name}" for name in names if name.endswith((".js", ".css", ".svg")))]
    sizes = {name: len(server.ask(name)[2]) for name in [*before, "page/three.js"]}
    assert sum(sizes.values()) < FIRST_BYTES, sizes
    assert len(server.ask("")[2]) + len(server.ask("page/style.css")[2]) < 40_000  # first paint


def test_every_action_plays_at_once(visit: Callable[..., Page]) -> None:
    page = visit()
    on_stage(page, "sample")
    asked: list[str] = []
    page.on("request", lambda one: asked.append(one.url) if one.url.endswith("/play") else None)
    page.locator("#actions button", has_text="Wave").first.click()
    expect(page.locator("#doing")).to_have_text("Wave")
    page.keyboard.press("Escape")
    page.locator("#stage").focus()
    page.keyboard.press("2")
    expect(page.locator("#doing")).to_have_text("Salsa")
    expect(page.locator("#chips .chip")).to_have_count(1)
    page.keyboard.press("Space")
    expect(page.locator("#play")).to_have_attribute("aria-label", "play")
    page.locator("#action").fill("walk for 2 s, then bow")
    expect(page.locator("#doing")).to_have_text("Walk, then Bow")
    expect(page.locator("#chips small")).to_have_text(["2 s", "4 s"])
    expect(page.locator("#play")).to_have_attribute("aria-label", "pause")
    page.locator("#chips .chip").first.click()
    page.get_by_role("button", name="Later").click()
    expect(page.locator("#doing")).to_have_text("Bow, then Walk")
    page.locator("#mirror").click()
    expect(page.locator("#mirror")).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="Undo").click()
    page.get_by_role("button", name="Undo").click()
    expect(page.locator("#doing")).to_have_text("Walk, then Bow")
    page.get_by_role("button", name="Stand still").click()
    expect(page.locator("#chips .none")).to_be_visible()
    assert len(asked) >= 4
    page.locator("#action").fill("xyzzy plugh")
    expect(page.locator("#understood.bad")).to_be_visible()


def test_a_part_has_its_own_tempo_and_takes_are_compared(visit: Callable[..., Page]) -> None:
    page = visit()
    on_stage(page, "sample")
    wishes: list[dict] = []
    page.on(
        "request",
        lambda one: (
            wishes.append(json.loads(one.post_data or "")) if one.url.endswith("/play") else None
        ),
    )
    page.locator("#actions button", has_text="Wave").first.click()
    page.locator("#chips .chip").first.click()
    page.get_by_label("Its tempo").select_option("faster")
    page.get_by_role("button", name="Mirror it").click()
    expect(page.locator("#chips small")).to_have_text("4 s, faster, mirrored")
    expect(page.locator("#stage")).not_to_have_attribute("aria-busy", "true")
    assert wishes[-1]["wish"]["action"] == "Wave at 1.5 x speed mirrored"
    page.get_by_role("button", name="Another take of it").click()
    expect(page.locator("#chips small")).to_have_text("4 s, faster, mirrored, take 2")
    expect(page.locator("#stage")).not_to_have_attribute("aria-busy", "true")
    assert wishes[-1]["wish"]["action"] == "Wave take 2 at 1.5 x speed mirrored"
    page.locator("#undo").click()
    page.locator("#compare").click()
    expect(page.locator("#takes button")).to_have_count(4)
    assert {one["wish"]["seed"] for one in wishes} == {0, 1, 2, 3}
    count = len(wishes)
    page.locator("#takes button").nth(2).click()
    expect(page.locator("#takes")).to_be_hidden()
    expect(page.locator("#take")).to_have_text("Another take (3)")
    assert len(wishes) == count  # it is known
    page.locator("#undo").click()
    expect(page.locator("#take")).to_have_text("Another take")


DROP = """([data, name]) => {
  const bytes = Uint8Array.from(atob(data), letter => letter.charCodeAt(0)), moved = new DataTransfer();
  moved.items.add(new File([bytes], name));
  document.dispatchEvent(new DragEvent("drop", { dataTransfer: moved, bubbles: true, cancelable: true }));
}"""
"""Script: a file is dropped on the page."""


def test_a_motion_file_is_played_by_who_is_on_the_stage(
    visit: Callable[..., Page], tmp_path: Path
) -> None:
    write_bvh(tmp_path / "my dance.bvh", person(frames=45))
    data = base64.b64encode((tmp_path / "my dance.bvh").read_bytes()).decode()
    page = visit()
    on_stage(page, "sample")
    with page.expect_response(lambda one: one.url.endswith("/play")) as answered:
        page.evaluate(DROP, [data, "my dance.bvh"])
    assert len(answered.value.request.post_data_json["wish"]["motion"]) == 16
    expect(page.locator("#doing")).to_have_text("my dance")
    expect(page.locator("#chips")).to_contain_text("my dance")
    expect(page.locator("#who")).to_have_text("Sample person")
    page.get_by_role("button", name="Stand still").click()
    expect(page.locator("#chips .none")).to_be_visible()
    page.locator("summary", has_text="Copy a motion").click()
    page.get_by_role("button", name=re.compile("^my dance")).click()
    expect(page.locator("#doing")).to_have_text("my dance")
    page.locator("#motion-file").set_input_files(
        {"name": "broken.bvh", "mimeType": "", "buffer": b"HIERARCHY"}
    )
    expect(page.locator("#motion-problem")).to_contain_text("Line 1")
    expect(page.locator("#doing")).to_have_text("my dance")
    page.get_by_role("button", name="Remove my dance").click()
    expect(page.locator("#motions li")).to_have_count(0)


def test_the_wishes_of_words_are_played_and_told(visit: Callable[..., Page]) -> None:
    page = visit()
    on_stage(page, "sample")
    typed = "kick with the left leg three times, then sit twice"
    with page.expect_request(lambda one: one.url.endswith("/play")) as asked:
        page.locator("#action").fill(typed)
    assert asked.value.post_data_json["wish"]["action"] == typed
    expect(page.locator("#understood")).to_have_text(
        "Understood: Kick, 3 times, left side; then Sit"
    )
    expect(page.locator("#unkept")).to_contain_text("Not kept: 2 times (Sit has no end")
    page.locator("#chips .chip").last.click()
    # the rest of the typed motion, after its beginning, may be asked for at the same time
    with page.expect_request(
        lambda one: one.url.endswith("/play") and one.post_data_json["wish"]["action"] != typed
    ) as asked:
        page.get_by_role("button", name="Remove", exact=True).click()
    action = asked.value.post_data_json["wish"]["action"]
    assert action == "kick with the left leg three times"  # a wish outlives changes of the row
    page.locator("#action").fill("walk")
    expect(page.locator("#unkept")).to_be_hidden()


def test_an_action_is_tried_under_the_pointer(visit: Callable[..., Page]) -> None:
    page = visit()
    on_stage(page, "sample")
    with page.expect_response(lambda one: one.url.endswith("/play")) as answered:
        page.locator("#actions button", has_text="Bow").first.hover()
    assert answered.value.ok
    expect(page.locator("#chips .none")).to_be_visible()  # nothing was chosen


def test_a_path_is_drawn_on_the_ground(visit: Callable[..., Page]) -> None:
    page = visit(viewport={"width": 1280, "height": 900})
    on_stage(page, "sample")
    page.locator("#actions button", has_text="Walk").first.click()
    expect(page.locator("#doing")).to_have_text("Walk")
    page.get_by_role("button", name="Draw a path").click()
    box = page.locator("#stage").bounding_box()
    assert box is not None
    page.wait_for_timeout(1500)  # the camera goes up
    page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + box["height"] * 0.6)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.8, box["y"] + box["height"] * 0.75, steps=8)
    with page.expect_request(lambda one: one.url.endswith("/play")) as asked:
        page.mouse.up()
    wish = asked.value.post_data_json["wish"]
    assert len(wish["path"].split()) >= 2
    expect(page.locator("#draw")).to_have_text("Draw another path")


def test_it_works_by_keyboard_alone(visit: Callable[..., Page]) -> None:
    page = visit()
    on_stage(page, "sample")
    order_of_focus = []
    for _ in range(40):
        page.keyboard.press("Tab")
        order_of_focus.append(page.evaluate("document.activeElement.id"))
    wanted = ["file", "camera", "export", "stage", "play", "light", "speed", "mirror", "action"]
    assert [name for name in dict.fromkeys(order_of_focus) if name in wanted] == wanted
    page.locator("#actions button").first.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    expect(page.locator("#chips .chip")).to_have_count(1)


def test_reduced_motion_stands_until_asked(visit: Callable[..., Page]) -> None:
    page = visit(reduced_motion="reduce")
    on_stage(page, "sample")
    expect(page.locator("#play")).to_have_attribute("aria-label", "play")
    page.locator("#actions button").first.hover()
    page.wait_for_timeout(500)
    expect(page.locator("#play")).to_have_attribute("aria-label", "play")


def test_what_is_no_photo_and_whom_the_camera_does_not_see(visit: Callable[..., Page]) -> None:
    page = visit()
    page.locator("#file").set_input_files(
        {"name": "broken.jpg", "mimeType": "image/jpeg", "buffer": SAMPLE.read_bytes()[:3000]}
    )
    expect(page.locator("#problem")).to_have_text(re.compile("This file is damaged or truncated"))
    expect(page.locator("#who")).to_have_text("Sample person")  # nothing of a photo is in sight
    page.get_by_role("button", name="Camera").click()
    page.locator("#delay").select_option("0")
    expect(page.locator("#snap")).to_be_enabled()
    page.get_by_role("button", name="Take the photo").click()  # Chromium's own test picture
    expect(page.locator("#problem")).to_contain_text("person", timeout=120_000)
    expect(page.locator("#problem")).not_to_contain_text("--")
    expect(page.locator("#export")).to_be_disabled()
    expect(page.locator("#shutter")).to_be_hidden()
    page.once("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name=re.compile("Delete me")).click()
    expect(page.locator("#chosen")).to_be_hidden()
    expect(page.locator("#forgotten")).to_contain_text("Deleted: the photo")


@pytest.mark.slow
def test_from_a_photo_to_the_files(visit: Callable[..., Page], server: Server) -> None:
    page = visit()
    page.locator("#file").set_input_files(SAMPLE)
    expect(page.locator("#making-stages li.made").first).to_be_attached(timeout=LONG)
    (photo,) = [one["id"] for one in server.state()["photos"]]
    on_stage(page, photo)
    expect(page.locator("#warnings")).to_contain_text("the back is guessed")
    for name in ("stage_textured.bin", "person.glb"):
        assert len(server.ask(f"photos/{photo}/{name}")[2]) > 100_000
    for name in ("stage_body.bin", "stage_surface.bin"):  # remembered; see test_stages.py
        assert server.ask(f"photos/{photo}/{name}")[0] == 404
    job = order(page, "walking")
    card = page.locator(f"#job-{job}")
    expect(card.locator("progress")).to_be_visible()
    page.locator("#action").fill("wave")  # the stage stays usable
    expect(page.locator("#doing")).to_have_text("Wave")
    expect(card.locator(".badge")).to_have_text("ready", timeout=LONG)
    card.scroll_into_view_if_needed()  # a muted video plays while it can be seen
    deadline = time.monotonic() + 60
    while page.evaluate("document.querySelector('.job video').currentTime") < 0.2:  # it plays
        assert time.monotonic() < deadline
        page.wait_for_timeout(100)
    card.locator("summary").click()
    found = {}
    for link in card.locator(".downloads a").all():
        with page.expect_download() as download:
            link.click()
        found[str(link.get_attribute("download"))] = Path(download.value.path()).read_bytes()
    assert set(found) == {
        "video.mp4",
        "front.mp4",
        "character.glb",
        "motion.bvh",
        "motion.npz",
        "preview.html",
        "report.json",
    }
    assert all(
        data == (server.folder / "jobs" / job / name).read_bytes() for name, data in found.items()
    )
    with page.expect_download() as download:
        card.get_by_text("Download everything").click()
    with zipfile.ZipFile(io.BytesIO(Path(download.value.path()).read_bytes())) as archive:
        assert set(archive.namelist()) == set(found)
        assert archive.testzip() is None
    page.locator("#export").click()
    page.get_by_role("tab", name="Motion").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the motion").click()
    assert Path(download.value.path()).read_bytes().startswith(b"HIERARCHY")
    page.get_by_role("tab", name="Share page").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the page").click()
    assert Path(download.value.path()).read_bytes().startswith(b"<!DOCTYPE html>")


def test_the_back_button_closes_dialogs_and_brings_the_last_person(
    visit: Callable[..., Page],
) -> None:
    page = visit()
    on_stage(page, "sample")
    photo = page.evaluate(
        "async () => (await (await fetch('api/sample', { method: 'POST' })).json()).id"
    )
    face = page.locator(f"#people button:has(img[src*='{photo}'])")  # others may be there already
    expect(face).to_be_visible()
    face.click()
    expect(page.locator("#who")).to_have_text("sample person")
    page.locator("#export").click()
    expect(page.locator("#exporting")).to_be_visible()
    page.go_back()
    expect(page.locator("#exporting")).to_be_hidden()
    expect(page.locator("#who")).to_have_text("sample person")
    page.locator("#camera").click()
    page.locator("#shut").click()  # closed by its own button: nothing is left to go back over
    expect(page.locator("#shutter")).to_be_hidden()
    page.wait_for_function("() => !history.state")
    page.go_back()
    expect(page.locator("#who")).to_have_text("Sample person")
    page.go_forward()
    expect(page.locator("#who")).to_have_text("sample person")
    page.evaluate("id => fetch(`api/photos/${id}`, { method: 'DELETE' })", photo)


@pytest.mark.slow
def test_a_gif_and_sprites_are_made(visit: Callable[..., Page], server: Server) -> None:
    page = visit()
    upload_sample(page, server)
    page.locator("#actions button", has_text="Jump").first.click()
    page.locator("#chips .chip").first.click()
    page.get_by_label(re.compile("^Seconds of")).fill("0.5")
    page.keyboard.press("Tab")
    made = {}
    for tab, button, chosen in (
        ("GIF", "Make the GIF", {}),
        ("Sprites", "Make the sprites", {"Directions": "4", "Size": "64"}),
    ):
        page.locator("#export").click()
        page.get_by_role("tab", name=tab).click()
        for label, value in chosen.items():
            page.get_by_label(label).select_option(value)
        with page.expect_response(lambda answer: answer.url.endswith("api/jobs")) as answered:
            page.get_by_role("button", name=button).click()
        card = page.locator(f"#job-{answered.value.json()['id']}")
        expect(card.locator(".badge")).to_have_text("ready", timeout=LONG)
        expect(card.locator(".result img")).to_be_visible()
        with page.expect_download() as download:
            card.get_by_role("link", name=re.compile("^Download the (GIF|sprites)")).click()
        made[tab] = Image.open(download.value.path())
        if tab == "Sprites":
            card.locator("summary").click()
            with page.expect_download() as download:
                card.get_by_role("link", name=re.compile("places of the sprites")).click()
            facts = json.loads(Path(download.value.path()).read_text())
    assert (made["GIF"].format, made["GIF"].n_frames) == ("GIF", 6)
    assert len(facts["frames"]) == 4 * 4  # directions, frames
    assert facts["meta"]["size"] == dict(zip("wh", made["Sprites"].size, strict=True))
    assert made["Sprites"].getextrema()[3] == (0, 255)


@pytest.mark.slow
def test_a_clip_is_recorded_in_the_browser(visit: Callable[..., Page]) -> None:
    page = visit()
    on_stage(page, "sample")
    page.locator("#export").click()
    page.get_by_role("button", name="Record the clip").click()
    with page.expect_download() as download:
        page.get_by_role("link", name=re.compile("Save the clip")).click()
    assert Path(download.value.path()).stat().st_size > 1000


@pytest.mark.slow
def test_two_people_and_a_restart_in_the_middle(visit: Callable[..., Page], server: Server) -> None:
    one, other = visit(), visit()
    upload_sample(one, server)
    upload_sample(other, server)
    jobs = [order(one, "run", "0.5"), order(other, "jump", "0.5")]
    expect(one.locator(f"#job-{jobs[1]} .badge")).to_have_text(
        re.compile("waiting|being made|ready")
    )  # each sees both
    expect(other.locator(f"#job-{jobs[0]} .stage-text")).not_to_have_text(
        "Starting", timeout=120_000
    )
    server.end(signal.SIGKILL)
    expect(one.locator("#lost")).to_be_visible(timeout=30_000)
    again = Server(server.folder, server.port, server.cache)
    server.__dict__.update(again.__dict__)
    expect(other.locator("#lost")).to_be_hidden(timeout=30_000)
    for job in jobs:
        for page in (one, other):
            expect(page.locator(f"#job-{job} .badge")).to_have_text("ready", timeout=LONG)
    third = order(other, "dance", "12")  # not done before the other page asks for the state
    expect(one.locator(f"#job-{third} .badge")).to_have_text("being made")
    for child in psutil.Process(
        server.process.pid
    ).children():  # as the system does if memory runs out
        child.kill()
    expect(one.locator(f"#job-{third} .problem")).to_contain_text(
        "has ended, most likely because it ran out of memory"
    )
    one.locator(f"#job-{third}").get_by_role("button", name="Try again").click()
    expect(one.locator(f"#job-{third} .badge")).to_have_text("being made")
    one.locator(f"#job-{third}").get_by_role("button", name="Cancel").click()
    expect(other.locator(f"#job-{third} .badge")).to_have_text("cancelled")
    one.once("dialog", lambda dialog: dialog.accept())
    one.locator(f"#job-{third}").get_by_role("button", name="Remove").click()
    expect(other.locator(f"#job-{third}")).to_have_count(0)
    assert not (server.folder / "jobs" / third).exists()


@pytest.mark.slow
def test_what_was_seen_is_corrected(visit: Callable[..., Page], server: Server) -> None:
    page = visit(viewport={"width": 1200, "height": 900})
    photo = upload_sample(page, server)
    unfold_person(page)
    page.locator("#correct").click()
    expect(page.locator("#fix-told")).to_contain_text("Body fitted", timeout=LONG)
    outline = page.locator("#fix-svg path.outline")
    before = outline.get_attribute("d")
    mark = page.locator("[data-mark='15']")  # the left wrist
    box = mark.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + 30, box["y"] - 40, steps=4)
    page.mouse.up()
    expect(outline).not_to_have_attribute("d", str(before), timeout=30_000)  # the body follows
    mark.focus()
    at = float(mark.get_attribute("cx") or 0)
    page.keyboard.press("ArrowRight")
    assert float(mark.get_attribute("cx") or 0) > at
    assert page.evaluate("document.activeElement.dataset.mark") == "15"
    page.locator("summary", has_text="Limbs in front or behind").click()
    limb = page.locator("[data-limb=right_lower_arm]")
    shown = limb.inner_text()
    limb.click()
    expect(limb).to_have_attribute("aria-pressed", "true")
    assert limb.inner_text() != shown
    page.get_by_role("button", name="Paint out").click()
    page.locator("#fix-stage").focus()
    page.keyboard.press("Space")
    assert page.evaluate(CONTRAST) == []
    assert page.evaluate(NAMELESS) == []
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator("#fix-problem")).to_be_empty()
    expect(page.locator("#seen-text")).to_contain_text("Corrected by you", timeout=LONG)
    kept = read_corrections((server.folder / "photos" / photo / "me.yaml").read_bytes(), "me.yaml")
    assert [name for name, _, _ in kept.landmarks] == ["left_wrist"]
    assert [name for name, _ in kept.limbs] == ["right_lower_arm"]
    assert [stroke.add for stroke in kept.strokes] == [False]
    on_stage(page, photo)
    now = next(one for one in server.state()["photos"] if one["id"] == photo)
    assert now["landmarks"][15][:2] == pytest.approx(
        [kept.landmarks[0][1] * now["width"], kept.landmarks[0][2] * now["height"]], abs=1
    )
