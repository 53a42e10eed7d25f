"""Every page of a2v by axe-core of npm, at three widths, light and dark, and by the keyboard."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from a2v.lab.evaluation.comparison import write_comparison
from a2v.lab.evaluation.survey import REAL, SurveySettings, write_survey
from a2v.motion import MotionModel
from a2v.motion.page import PACKAGES, write_motion_page
from pipelines.batch.results import write_tables
from tests.support.axe import LOOKS, WIDTHS, axe_script, keyboard_faults, serious
from tests.support.browser import LOCAL, SOFTWARE, calm, chromium
from tests.support.motions import person
from tests.support.npm import npm_folder
from tests.support.page import Server
from tests.support.screens import SCREENS, Screens, show

KEYBOARD = ("unfolded", "acting", "correct", "camera", "films", "film", "character")
"""Screens that have a control which no other screen has."""


@pytest.fixture(scope="module")
def script() -> str:
    return axe_script()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    camera = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream")
    with chromium("--no-sandbox", *SOFTWARE, *camera, exclude=LOCAL) as opened:
        yield opened


@pytest.fixture(scope="module")
def screens(tmp_path_factory: pytest.TempPathFactory) -> Screens:
    return Screens(tmp_path_factory.mktemp("screens"))


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    running = Server(tmp_path_factory.mktemp("page") / "folder")
    yield running.address
    running.end()


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[[], Page]]:
    """Open a page; scripts of tests are allowed."""
    contexts = []

    def opened() -> Page:
        context = browser.new_context(viewport={"width": 1280, "height": 900}, bypass_csp=True)
        calm(context)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(120_000)  # a busy machine
        return page

    yield opened
    for context in contexts:
        context.close()


def all_faults(page: Page, script: str) -> dict[str, list[str]]:
    """What is wrong with an open page: serious findings by width and color scheme, and the widths
    at which it scrolls sideways."""
    found = {}
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 900})
        wide = page.evaluate("document.scrollingElement.scrollWidth")
        found[f"{width}"] = [f"{wide} px wide"] if wide > width else []
        if width in LOOKS:
            page.emulate_media(color_scheme=LOOKS[width])
            found[f"{width} {LOOKS[width]}"] = [*map(str, serious(page, script))]
    return {how: bad for how, bad in found.items() if bad}


@pytest.mark.parametrize("name", SCREENS)
def test_no_screen_has_a_serious_finding(
    name: str, script: str, screens: Screens, address: str, visit: Callable[[], Page]
) -> None:
    page = visit()
    show(page, screens, address, name)
    assert all_faults(page, script) == {}


def test_every_control_is_reached_by_tab_and_shows_its_focus(
    screens: Screens, address: str, visit: Callable[[], Page]
) -> None:
    page, found = visit(), {}
    for name in KEYBOARD:
        show(page, screens, address, name)
        found[name] = keyboard_faults(page)
    assert {name: bad for name, bad in found.items() if bad} == {}


def test_a_fault_is_found(script: str, visit: Callable[[], Page]) -> None:
    page = visit()
    page.set_content(
        "<!DOCTYPE html><html lang=en><title>bad</title><main><h1>bad</h1>"
        "<p style='color: #bbb; width: 400px'>pale</p><button id=b></button>"
        "<input tabindex=3 aria-label=a style='outline: 0'></main></html>"
    )
    found = all_faults(page, script)
    for width, scheme in LOOKS.items():
        for rule in ("color-contrast", "button-name"):
            assert rule in str(found[f"{width} {scheme}"])
    assert found["320"][0].endswith("px wide")
    assert "1280" not in found
    assert any(fault.startswith("no visible focus: <input") for fault in keyboard_faults(page))


def _motion_page(folder: Path) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("A2V_PAGE", str(npm_folder("page", *PACKAGES.packages)))
        write_motion_page(
            folder / "motions.html", MotionModel.load("cmu"), action="Walk", seconds=1.0
        )
    return folder / "motions.html"


def _batch(folder: Path) -> Path:
    for name, status in (("walk", "done"), ("jump", "failed")):
        record = {"folder": name, "status": status, "name": name, "photo": "me.jpg", "files": {}}
        (folder / name).mkdir()
        (folder / name / "job.json").write_text(
            json.dumps(record | {"action": name, "problem": "the photo is damaged"})
        )
    write_tables(folder)
    return folder / "index.html"


def _comparison(folder: Path) -> Path:
    frames = [np.full((64, 64, 3), 90, np.uint8)] * 3
    films = {name: {"front": frames, "back": frames} for name in ("ours", "theirs")}
    write_comparison(folder / "compare.html", films, action="Walk", fps=10.0, about="two methods")
    return folder / "compare.html"


def _survey(folder: Path) -> Path:
    films = {name: {"walk": [person(frames=4)]} for name in (REAL, "ours", "theirs")}
    write_survey(folder / "survey.html", films, SurveySettings(preference=1, size=64))
    return folder / "survey.html"


FILES: dict[str, Callable[[Path], Path]] = {
    "motion page": _motion_page,
    "batch": _batch,
    "comparison": _comparison,
    "survey": _survey,
}


@pytest.mark.parametrize("name", ["preview", "preview with video", *FILES])
def test_no_file_has_a_serious_finding(
    name: str,
    script: str,
    screens: Screens,
    tmp_path: Path,
    visit: Callable[[], Page],
) -> None:
    made = {"preview": "preview.html", "preview with video": "both.html"}
    path = screens.folder / made[name] if name in made else FILES[name](tmp_path)
    page = visit()
    page.goto(path.as_uri())
    if name in made or name == "motion page":
        page.locator("body[data-state=ready]").wait_for()
    assert all_faults(page, script) == {}
    page.set_viewport_size({"width": 320, "height": 900})
    assert keyboard_faults(page) == []
