"""Make ``docs/images/page.webp``: the page of ``a2v serve`` at work.

    python scripts/make_page_film.py [--photo P] [--cache FOLDER] [--folder KEEP]

Chromium uses the page as `benchmarks.first_use` does: it opens the page, chooses the photo of the
sample person and presses an action. ``page.webp`` shows the page during that time, faster than it
was. Without remembered results it takes minutes. The photo is rendered from an avatar: nobody real.
"""

from __future__ import annotations

import argparse
import io
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from a2v.rendering import write_webp  # noqa: E402
from a2v.types import ByteArray  # noqa: E402
from benchmarks.first_use import FLAGS, LIMIT, SAMPLE, serving, use  # noqa: E402
from tests.support.page import find_browser  # noqa: E402

IMAGES = ROOT / "docs" / "images"
MAX_BYTES = 1_500_000
"""Largest size of a picture."""
WINDOW = (1240, 860)
"""Width and height of the browser's window in pixels."""
WIDTH = 760
"""Width of ``page.webp`` in pixels."""
FPS = 5.0
"""Frames per second of ``page.webp``."""
HELD = {"sample person moves": 7, "photo is shown": 3, "person is alive": 5, "person acts": 0}
"""Number of frames for which ``page.webp`` holds each new state of the page."""
SHARE = {"looking": 4, "body": 5, "surface": 5, "textured": 5, "moving": 5, "acting": 3}
"""Number of frames of ``page.webp`` for each wait."""
AFTER = 14
"""Number of frames at the end: the person acts."""
ARROW = ((0, 0), (0, 26), (7, 20), (12, 31), (17, 29), (12, 18), (21, 18))
"""Outline of the drawn mouse pointer, in pixels of the window."""


@dataclass
class Film:
    """Screenshots of a page, by the action of the page."""

    page: Page
    seen: list[tuple[str, ByteArray]] = field(default_factory=list)
    last: float = 0.0

    def watch(self, doing: str) -> None:
        """Take a screenshot if the last one is a while ago."""
        often = 0.35
        if doing in HELD or time.perf_counter() - self.last > often:
            with Image.open(io.BytesIO(self.page.screenshot())) as shot:
                self.seen.append((doing, np.asarray(shot.convert("RGB"))))
            self.last = time.perf_counter()

    def frames(self, clicks: dict[str, tuple[float, float]]) -> list[ByteArray]:
        """Return the frames of the film; the pointer goes to each click before it is done."""
        found: list[ByteArray] = []
        names = list(dict.fromkeys(name for name, _ in self.seen))
        at = (0.6 * WINDOW[0], 0.7 * WINDOW[1])
        for name in names:
            shots = [shot for other, shot in self.seen if other == name]
            count = HELD.get(name, min(SHARE.get(name, AFTER), len(shots)))
            chosen = [shots[i] for i in np.linspace(0, len(shots) - 1, count).round().astype(int)]
            goal = clicks.get(name, at)
            for step, shot in enumerate(chosen):
                way = min(1.0, (step + 1) / max(count - 2, 1))
                place = (at[0] + way * (goal[0] - at[0]), at[1] + way * (goal[1] - at[1]))
                found.append(_pointed(shot, place, pressed=name in clicks and step == count - 1))
            at = goal
        return found


def _pointed(shot: ByteArray, place: tuple[float, float], *, pressed: bool) -> ByteArray:
    """Draw the mouse pointer and shrink the picture."""
    image = Image.fromarray(shot)
    draw = ImageDraw.Draw(image, "RGBA")
    x, y = place
    if pressed:
        draw.ellipse((x - 24, y - 24, x + 24, y + 24), fill=(31, 95, 191, 90))
    draw.polygon([(x + u, y + v) for u, v in ARROW], fill=(20, 24, 28), outline=(255, 255, 255))
    size = (WIDTH, round(WIDTH * WINDOW[1] / WINDOW[0]))
    return np.asarray(image.resize(size, Image.Resampling.LANCZOS))


def write_small(path: Path, frames: list[ByteArray], fps: float) -> None:
    """Write an animated picture of at most `MAX_BYTES`, and print its size."""
    for quality in range(80, 20, -10):
        write_webp(path, frames, fps, quality=quality)
        if path.stat().st_size <= MAX_BYTES:
            break
    else:
        raise SystemExit(f"{path} is larger than {MAX_BYTES / 1e6:g} MB at any quality")
    print(f"{path}: {len(frames)} frames, {path.stat().st_size / 1e6:.2f} MB, quality {quality}")


def center(page: Page, selector: str) -> tuple[float, float]:
    """Return the middle of an element in pixels of the window."""
    box = page.locator(selector).bounding_box()
    if box is None:
        raise SystemExit(f"the page has no visible {selector}")
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def main() -> None:
    """Use the page, write the picture, and print the measurements."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--photo", type=Path, default=SAMPLE)
    parser.add_argument("--cache")
    parser.add_argument("--folder", type=Path, help="folder of the page, to be kept")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as other:
        folder = given.folder or Path(other) / "page"
        with (
            serving(folder, given.cache or f"{other}/store") as (address, server),
            sync_playwright() as engine,
        ):
            browser = engine.chromium.launch(executable_path=find_browser(), args=list(FLAGS))
            page = browser.new_page(viewport={"width": WINDOW[0], "height": WINDOW[1]})
            page.set_default_timeout(1000 * LIMIT)
            film, clicks = Film(page), {}

            def watch(doing: str) -> None:
                film.watch(doing)
                if doing == "sample person moves":
                    clicks[doing] = center(page, "label[for=file]")
                if doing == "person is alive":
                    clicks[doing] = center(page, "#actions button >> nth=1")

            for event in use(page, address, server, given.photo, watch):
                print(event)
            for _ in range(AFTER):
                film.last = 0.0
                film.watch("playing")
                page.wait_for_timeout(150)
            browser.close()
        write_small(IMAGES / "page.webp", film.frames(clicks), FPS)


if __name__ == "__main__":  # worker processes import this file again
    main()
