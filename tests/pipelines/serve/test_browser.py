"""The page in a real browser: from a photo to files, two users at once, and a restart."""

from __future__ import annotations

import io
import re
import signal
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Request, expect

from a2v.perception import read_corrections
from tests.support.browser import LOCAL, SOFTWARE, calm, chromium
from tests.support.page import CONTRAST, NAMELESS, ROOT, Server

SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"
LONG = 300_000.0
"""Milliseconds for steps that may compute a person first, on a busy machine."""
FIGURE = "document.querySelector('#actions canvas').toDataURL()"

expect.set_options(
    timeout=60_000
)  # The default is five seconds, which a busy machine may need for one poll.


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    running = Server(tmp_path_factory.mktemp("page") / "folder")
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


def upload_sample(page: Page, server: Server) -> str:
    """Upload the sample photo, wait until the page shows its person, and return its id."""
    earlier = {photo["id"] for photo in server.state()["photos"]}
    with page.expect_response(lambda answer: "api/photos?" in answer.url):
        page.locator("#file").set_input_files(SAMPLE)
    (photo,) = {str(one["id"]) for one in server.state()["photos"]} - earlier
    expect(page.locator("#shown")).to_have_attribute("src", f"photos/{photo}/photo.jpg")
    expect(page.locator("#seen-text")).to_contain_text("Found the person", timeout=120_000)
    return photo


def order(page: Page, words: str, seconds: str = "1") -> str:
    """Request a video of twelve frames per second; return the job's id."""
    page.locator("#model").select_option("cmu")
    page.locator("#action").fill(words)
    page.locator("#seconds").fill(seconds)
    page.locator("#size").select_option("128")
    for name in ("back", "left", "right"):
        page.locator(f"#views input[value={name}]").uncheck()
    if not page.locator("#spp").is_visible():
        page.locator("summary", has_text="More").click()
    page.locator("#spp").fill("1")
    page.locator("#fps").select_option("12")
    with page.expect_response(lambda answer: answer.url.endswith("api/jobs")) as answered:
        page.get_by_role("button", name="Make the video").click()
    return str(answered.value.json()["id"])


def wait_for_pictures(page: Page, number: int) -> None:
    """Wait until the first figure of the gallery was seen in this number of poses."""
    pictures: set[str] = set()
    deadline = time.monotonic() + 60
    while len(pictures) < number:
        pictures.add(page.evaluate(FIGURE))
        assert time.monotonic() < deadline
        page.wait_for_timeout(100)


def test_the_page_is_light_readable_and_named(visit: Callable[..., Page], server: Server) -> None:
    for scheme in ("light", "dark"):
        page = visit(viewport={"width": 360, "height": 740}, color_scheme=scheme)
        for summary in page.locator(
            "main summary"
        ).all():  # those inside of others become visible one after another
            if summary.is_visible():
                summary.click()
        assert page.evaluate("document.scrollingElement.scrollWidth") <= 360
        assert page.evaluate(CONTRAST) == []
        assert page.evaluate(NAMELESS) == []
    blocking = [
        server.ask(path) for path in ("", "page/style.css")
    ]  # all that the first paint waits for; scripts are modules
    assert sum(len(body) for _, _, body in blocking) < 40_000


def test_it_works_by_keyboard_alone(visit: Callable[..., Page]) -> None:
    page = visit()
    order_of_focus = []
    for _ in range(30):
        page.keyboard.press("Tab")
        order_of_focus.append(page.evaluate("document.activeElement.id"))
        if order_of_focus[-1] == "make":
            break
    wanted = ["file", "camera", "action", "model", "seconds", "size", "make"]
    assert [name for name in order_of_focus if name in wanted] == wanted
    page.keyboard.press("Enter")
    expect(page.locator("#make-problem")).to_have_text("Choose a photo first.")
    assert page.evaluate("document.activeElement.id") == "file"


def test_what_is_no_photo_and_whom_the_camera_does_not_see(visit: Callable[..., Page]) -> None:
    page = visit()
    page.locator("#file").set_input_files(
        {"name": "broken.jpg", "mimeType": "image/jpeg", "buffer": SAMPLE.read_bytes()[:3000]}
    )
    expect(page.locator("#photo-problem")).to_have_text(
        re.compile("This file is damaged or truncated")
    )
    page.get_by_role("button", name="Camera").click()
    page.locator("#delay").select_option("0")
    expect(page.locator("#snap")).to_be_enabled()
    page.get_by_role("button", name="Take the photo").click()  # Chromium's own test picture
    expect(page.locator("#photo-problem")).to_contain_text("person", timeout=120_000)
    expect(page.locator("#shutter")).to_be_hidden()
    page.once("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name=re.compile("Delete me")).click()
    expect(page.locator("#chosen")).to_be_hidden()
    expect(page.locator("#forgotten")).to_contain_text("Deleted: the photo")


def test_actions_are_figures_that_move_and_words_are_chips(visit: Callable[..., Page]) -> None:
    page = visit()
    page.locator("#filter").fill("jump")
    figures = page.locator("#actions button")
    expect(figures.first).to_be_visible()
    assert all("jump" in name.lower() for name in figures.all_inner_texts())
    wait_for_pictures(page, 4)  # empty first, then one moment after another
    figures.first.focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate("document.activeElement.textContent") == figures.nth(1).inner_text()
    assert page.locator("#actions button[tabindex='0']").count() == 1
    page.keyboard.press("Enter")
    expect(page.locator("#action")).to_have_value(figures.nth(1).inner_text())
    page.locator("#action").fill("walk, then jump")
    chips = page.locator("#understood > .chip")
    expect(chips).to_have_text(["Walk", "Jump"])
    chips.first.click()
    page.get_by_role("button", name="leave out").locator("visible=true").click()
    expect(chips).to_have_text(["Jump"])


def test_two_clicks_are_enough(visit: Callable[..., Page]) -> None:
    page = visit()
    with page.expect_file_chooser() as chooser:
        page.locator("#drop").click()
    chooser.value.set_files(SAMPLE)
    expect(page.locator("#shown")).to_have_attribute("src", re.compile("photo.jpg"))
    expect(page.locator("#action")).to_have_value("Walk")
    bar = page.locator("#make").bounding_box()  # within sight without scrolling
    assert bar is not None
    assert bar["y"] + bar["height"] <= 720
    with page.expect_response(lambda answer: answer.url.endswith("api/jobs")) as answered:
        page.locator("#make").click()
    assert answered.value.ok
    page.locator(".job").first.get_by_role("button", name="Cancel").click()
    page.once("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name=re.compile("Delete me")).click()
    expect(page.locator("#forgotten")).to_contain_text("Deleted", timeout=120_000)


def test_a_sample_person_in_one_click(visit: Callable[..., Page]) -> None:
    page = visit()
    page.get_by_role("button", name="Sample person").click()
    expect(page.locator("#seen-text")).to_contain_text("Found the person", timeout=300_000)
    expect(page.locator("#action")).to_have_value("Walk")
    page.once("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name=re.compile("Delete me")).click()
    expect(page.locator("#forgotten")).to_contain_text("kept results")


@pytest.mark.slow
def test_from_a_photo_to_the_files(visit: Callable[..., Page], server: Server) -> None:
    page = visit()
    upload_sample(page, server)
    expect(page.locator("#bones circle").nth(25)).to_be_visible()
    page.wait_for_function("document.querySelector('#mask').naturalWidth > 100")
    page.locator("#action").fill("ballet for nobody xyzzy")
    page.locator("#model").select_option("cmu")
    page.locator("#action").fill("walking")
    expect(page.locator("#understood")).to_have_text(re.compile("^Understood: Walk"))
    job = order(page, "walking")
    card = page.locator(f"#job-{job}")
    expect(card.locator(".badge")).to_have_text("being made")
    expect(card.locator("progress")).to_be_visible()
    stands = page.evaluate(FIGURE)
    page.wait_for_timeout(1000)
    assert page.evaluate(FIGURE) == stands  # the processor is left to the video
    page.locator("#actions button").first.focus()
    for key in ("ArrowRight", "ArrowLeft"):
        page.keyboard.press(key)
    wait_for_pictures(page, 3)
    card.scroll_into_view_if_needed()  # a muted video plays while it can be seen
    expect(card.locator(".badge")).to_have_text("being made")
    expect(card.locator(".now img, .now iframe").first).to_be_visible(timeout=LONG)
    expect(card.locator(".left")).to_have_text(
        re.compile(r"about \d+ (s|min|\.\d h) left"), timeout=LONG
    )
    expect(card.locator(".badge")).to_have_text("done", timeout=LONG)

    deadline = time.monotonic() + 60
    while page.evaluate("document.querySelector('.panel video').currentTime") < 0.2:  # it plays
        assert time.monotonic() < deadline
        page.wait_for_timeout(100)
    card.get_by_role("tab", name="Character").click()
    expect(page.frame_locator(".panel iframe").locator("body")).to_have_attribute(
        "data-state", "ready", timeout=120_000
    )
    card.get_by_role("tab", name="Files").click()
    found = {}
    for link in card.locator(".files a").all():
        with page.expect_download() as download:
            link.click()
        found[link.inner_text()] = Path(download.value.path()).read_bytes()
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
        card.get_by_text("Download all").click()
    with zipfile.ZipFile(io.BytesIO(Path(download.value.path()).read_bytes())) as archive:
        assert set(archive.namelist()) == set(found)
        assert archive.testzip() is None


@pytest.mark.slow
def test_two_people_and_a_restart_in_the_middle(visit: Callable[..., Page], server: Server) -> None:
    one, other = visit(), visit()
    upload_sample(one, server)
    upload_sample(other, server)
    jobs = [order(one, "run", "0.5"), order(other, "jump", "0.5")]
    expect(one.locator(f"#job-{jobs[1]} .badge")).to_have_text(
        re.compile("waiting|being made|done")
    )  # each sees both
    expect(other.locator(f"#job-{jobs[0]} .stage-text")).not_to_have_text(
        "Starting", timeout=120_000
    )
    server.end(signal.SIGKILL)
    expect(one.locator("#lost")).to_be_visible(timeout=30_000)
    again = Server(server.folder, server.port)
    server.__dict__.update(again.__dict__)
    expect(other.locator("#lost")).to_be_hidden(timeout=30_000)
    for job in jobs:
        for page in (one, other):
            expect(page.locator(f"#job-{job} .badge")).to_have_text("done", timeout=LONG)
    third = order(other, "dance", "6")  # not done before the other page asks for the state
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
    page.get_by_role("button", name="Correct").click()
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
    now = next(one for one in server.state()["photos"] if one["id"] == photo)
    assert now["landmarks"][15][:2] == pytest.approx(
        [kept.landmarks[0][1] * now["width"], kept.landmarks[0][2] * now["height"]], abs=1
    )
