"""Our pages with hostile names of photos, actions, jobs and folders run no script of theirs."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, expect

from a2v.errors import MissingDependencyError
from a2v.lab.evaluation.survey import SurveySettings, write_survey
from a2v.motion import MotionModel
from a2v.motion.page import write_motion_page
from a2v.rendering.page import page_of
from pipelines.batch.results import write_tables
from pipelines.serve.library import Library
from pipelines.serve.wishes import Wish
from tests.support.browser import LOCAL, SOFTWARE, calm, chromium
from tests.support.glb import glb
from tests.support.motions import person
from tests.support.page import Server, arrived
from tests.support.uploads import picture

RUN = "window.theirs=1"
NAMES = (
    f'"><script>{RUN}</script>',
    f"</script><script>{RUN}</script>",
    f"</title></style></textarea><svg onload={RUN}>",
    f"javascript:{RUN}",
    f'"><img src=x onerror={RUN}>',
    f"' onmouseover='{RUN}",
    f"<!--<script>{RUN}",
    "${data} $title {{x}} \\u003cscript>",
    "\u202eabc\u2066\u200f",
    "z" * 5000,
    "\x00\x1b[2J\u2028",
)
"""Names, titles and problems."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium(SOFTWARE[0], exclude=LOCAL) as opened:
        yield opened


@pytest.fixture
def look(browser: Browser) -> Callable[[str, str], list[str]]:
    """Return the errors of a page until a selector appears; no name may have run."""

    def opened(address: str, selector: str) -> list[str]:
        context = browser.new_context()
        calm(context)
        page, errors = context.new_page(), list[str]()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("dialog", lambda box: errors.append(box.message))
        page.goto(address)
        expect(page.locator(selector).first).to_be_attached(timeout=60_000)
        page.mouse.move(200, 200)
        if page.evaluate("() => window.theirs"):
            errors.append("a name has run")
        context.close()
        return errors

    return opened


@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_previews(look, tmp_path, name):
    path = tmp_path / "page.html"
    path.write_text(
        page_of(glb({"scenes": [{"nodes": []}], "scene": 0}), title=name),
        encoding="utf-8",
        errors="replace",
    )
    assert [
        error
        for error in look(path.as_uri(), "body")
        if "theirs" in error or "has run" in error or "Unexpected" in error
    ] == []


def test_the_table_of_a_batch(look, tmp_path):
    for number, name in enumerate(NAMES):
        folder = tmp_path / (name[:80].replace("/", "_").replace("\0", "") or "x")
        folder.mkdir()
        record = {
            "name": name,
            "photo": name,
            "action": name,
            "seed": name,
            "frames": 1,
            "views": name,
            "problem": name,
            "files": {},
        }
        (folder / "job.json").write_text(
            json.dumps(
                {**record, "folder": folder.name, "status": "failed" if number % 2 else "done"}
            )
        )
    counts = write_tables(tmp_path)
    assert sum(counts.values()) == len(NAMES)
    assert look((tmp_path / "index.html").as_uri(), f"tbody tr:nth-child({len(NAMES)})") == []


def test_surveys(look, tmp_path):
    for number, name in enumerate(NAMES):
        made = {
            source: {name: [person(frames=3, step=0.1 * step)]}
            for step, source in enumerate(("real", "ours", "theirs"))
        }
        path = tmp_path / f"{number}.html"
        write_survey(path, made, SurveySettings(preference=1, real_or_fake=1, size=32, title=name))
        assert look(path.as_uri(), "h1") == []


def test_pages_that_make_motions(look, tmp_path):
    path = tmp_path / "page.html"
    for name in NAMES[:3]:
        try:
            write_motion_page(path, MotionModel.load("humanact12"), title=name)
        except MissingDependencyError as error:
            pytest.skip(str(error))
        assert look(path.as_uri(), "body") == []


def test_the_page(look, tmp_path):
    library = Library(tmp_path)
    for name in NAMES:
        photo = arrived(library, picture(), name[:100].replace("\0", ""))
        job = library.add_job(photo, Wish(action=name[:100].replace("\0", "")))
        job.status, job.problem, job.notes = "failed", name, [name]
        library.keep(job)
        photo.status, photo.problem = "unusable", name
        library.keep(photo)
    server = Server(tmp_path)
    try:
        assert len(server.state()["photos"]) == len(NAMES)
        assert look(server.address, "body[data-ready=yes]") == []
    finally:
        server.end()
