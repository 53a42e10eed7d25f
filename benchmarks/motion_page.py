"""Measure the page of `a2v motion-page` in Chromium: the time from opening to the first clip, and
from a click on Another to the next one.

    python -m benchmarks.motion_page [--repeats 5] [--clips 9] [--character me.glb]

The bars, on an idle machine: the first clip (5 s long) within 3 s, later ones within 200 ms. On a
busy machine look at the processor time of the browser until the first clip: on an idle machine the
first clip takes less than that by the clock.
"""

from __future__ import annotations

import argparse
import re
import statistics
import sys
import tempfile
from pathlib import Path

import psutil
from playwright.sync_api import Browser, sync_playwright

from a2v.motion import MotionModel
from a2v.motion.page import write_motion_page
from benchmarks.first_use import processor_seconds
from tests.support.page import find_browser

FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND",
]


def opened(browser: Browser, path: Path, clips: int) -> tuple[float, float, list[float]]:
    """Return seconds from opening to the first clip by the clock, the browser's processor seconds
    until then, and milliseconds of each of `clips` more.

    The browser has an empty cache.
    """
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    before = processor_seconds(psutil.Process())
    page.goto(path.as_uri())
    page.wait_for_selector("body[data-ready]", timeout=120_000)
    spent = processor_seconds(psutil.Process()) - before
    first = float(page.locator("body").get_attribute("data-ready") or "nan") / 1000
    page.locator(
        "#play"
    ).click()  # without movement: drawing by the processor would be measured too
    taken = []
    for _ in range(clips):
        seed = page.locator("#seed").input_value()
        page.locator("#another").click()
        page.wait_for_function("seed => document.getElementById('seed').value !== seed", arg=seed)
        wanted = page.locator("#seed").input_value()
        page.wait_for_function(
            "seed => document.getElementById('told').textContent.includes(`--seed ${seed} `)",
            arg=wanted,
        )
        taken.append(float(re.search(r"made in (\d+) ms", page.locator("#told").inner_text())[1]))  # type: ignore[index]
    context.close()
    return first, spent, taken


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--clips", type=int, default=9)
    parser.add_argument("--character", help="a .glb who plays them")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as engine:
        path = Path(folder) / "motions.html"
        write_motion_page(
            path,
            MotionModel.load("cmu-fine"),
            given.character,
            action="Walk",
            seed=0,
            seconds=5.0,
            title="a2v",
        )
        print(f"{path.stat().st_size / 1e6:.1f} MB")
        browser = engine.chromium.launch(executable_path=find_browser(), args=FLAGS)
        results = [opened(browser, path, given.clips) for _ in range(given.repeats)]
        browser.close()
    first = [seconds for seconds, _, _ in results]
    spent = [seconds for _, seconds, _ in results]
    later = [milliseconds for _, _, taken in results for milliseconds in taken]
    print(
        f"first clip {statistics.median(first):6.2f} s median, {max(first):.2f} s most of "
        f"{len(first)} (bar: 3 s)"
    )
    print(f"   processor {statistics.median(spent):6.2f} s median, {max(spent):.2f} s most")
    print(
        f"later ones {statistics.median(later):6.0f} ms median, {max(later):.0f} ms most of "
        f"{len(later)} (bar: 200 ms)"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
