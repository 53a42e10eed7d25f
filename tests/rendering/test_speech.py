"""Speech in the page of one file: a real browser types a line, and the face's shapes are read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from a2v import Character
from a2v.formats import write_glb
from a2v.rendering import write_page
from tests.support.browser import SOFTWARE, chromium

pytestmark = pytest.mark.slow

STEP_SECONDS = 0.025
"""Time between two readings of the face: a quarter of the half-width of a viseme."""
PROBE = """<script>
  const makeReal = makeSpeech;
  makeSpeech = (model, visemes) => { window.model = model; return makeReal(model, visemes); };
</script>
"""
"""Keep the page's model where the test can read it."""
CLOCK = "() => { window.now = performance.now(); performance.now = () => window.now; }"
"""Stop the page's clock, so that a slow machine loses no movement of the mouth."""
READ = """async ([count, step]) => {
  const meshes = [];
  window.model.traverse(node => { if (node.isMesh && node.morphTargetDictionary) meshes.push(node); });
  const value = name => Math.max(...meshes.map(
    one => one.morphTargetInfluences[one.morphTargetDictionary[name]]));
  const frame = () => new Promise(requestAnimationFrame);
  const found = [];
  for (let i = 0; i < count; i++) {
    window.now += 1000 * step;
    await frame();  // the page has requested its own frame earlier, so it has drawn
    found.push([value("jawOpen"), value("mouthPressLeft"), value("mouthPressRight")]);
  }
  return found;
}"""
"""Advance the clock by `count` steps and read jaw and lips after each."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium(*SOFTWARE) as opened:
        yield opened


def preview(
    browser: Browser, character: Character, folder: Path, width: int = 640, height: int = 480
) -> Page:
    """Open the page of a character that stands still, small so that frames are quick."""
    moves = np.repeat(character.body.bone_transforms[None], 2, axis=0)
    write_glb(folder / "c.glb", character, {"stand": (moves, 10.0)})
    write_page(folder / "preview.html", folder / "c.glb")
    text = (folder / "preview.html").read_text()
    mark = '<script id="visemes"'
    assert text.count(mark) == 1
    (folder / "preview.html").write_text(text.replace(mark, PROBE + mark))
    page = browser.new_page(viewport={"width": width, "height": height})
    page.goto((folder / "preview.html").as_uri(), timeout=120_000)  # a busy machine
    expect(page.locator("body[data-state=ready]")).to_be_attached(timeout=60_000)
    return page


def spoken(page: Page, line: str, seconds: float) -> np.ndarray:
    """Type a line and press the button; jawOpen, mouthPressLeft and mouthPressRight, (T, 3)."""
    page.locator("#line").fill(line)
    page.evaluate(CLOCK)
    page.get_by_role("button", name="Say it").click()
    found = page.evaluate(READ, [round(seconds / STEP_SECONDS), STEP_SECONDS])
    return np.asarray(found, float)


def peaks(values: np.ndarray, threshold: float) -> list[int]:
    """Indices of the largest values of all runs above a threshold."""
    above = np.flatnonzero(values > threshold)
    runs = np.split(above, np.flatnonzero(np.diff(above) > 1) + 1)
    return [int(run[values[run].argmax()]) for run in runs if len(run)]


def test_the_character_speaks_typed_lines(
    browser: Browser, expressive: Character, tmp_path: Path
) -> None:
    """The jaw opens at each vowel, the lips press at each m, p and b only, and in the end all
    rest."""
    page = preview(browser, expressive, tmp_path)
    jaw, *lips = spoken(page, "mapaba", 1.3).T
    opened = peaks(jaw, 0.2)
    assert len(opened) == 3
    assert jaw.max() == pytest.approx(0.6, abs=0.05)
    for side in lips:
        pressed = peaks(side, 0.2)
        assert len(pressed) == 3
        assert side[pressed] == pytest.approx(0.5, abs=0.05)
        assert (jaw[pressed] < 0.1).all()  # pressed lips need a closed jaw
        assert (np.diff(np.ravel(np.column_stack([pressed, opened]))) > 0).all()  # alternating
        assert side[-1] == 0
    assert jaw[-1] == 0
    expect(page.locator("body[data-speaking]")).to_have_count(0)
    jaw, *lips = spoken(page, "ka", 0.8).T
    assert jaw.max() > 0.2
    assert np.max(lips) == 0
    assert jaw[-1] == 0
    page.close()  # drawing takes most of a processor


COVERED = """() => [...document.querySelectorAll("footer button, footer input, footer select")]
  .filter(item => item.checkVisibility())
  .filter(item => {
    item.scrollIntoView();
    const { left, top, width, height } = item.getBoundingClientRect();
    return document.elementFromPoint(left + width / 2, top + height / 2) !== item;
  }).map(item => item.id || item.textContent)"""
"""Script: controls that a click in their middle does not reach."""


def test_no_control_is_covered_on_a_small_screen(
    browser: Browser, expressive: Character, tmp_path: Path
) -> None:
    page = preview(browser, expressive, tmp_path, 320, 300)
    assert page.locator("#speak").is_visible()
    assert page.evaluate(COVERED) == []
    assert page.evaluate("document.scrollingElement.scrollWidth") <= 320
    stage = page.locator("#stage").bounding_box()
    assert stage is not None
    assert stage["height"] >= 240
