"""Measure the page of `a2v serve` in Chromium: first paints, and a small video of a known
character.

    python -m benchmarks.page [--repeats 5] [--photo P] [--cache FOLDER]

The targets, on an idle machine: first contentful paint within 1 s, and 12 frames of one view, 256
px, within 10 s. The photo's character is made first if the store does not have it (minutes). Only
this machine is contacted. A new photo is measured by `benchmarks.first_use`.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

from benchmarks.first_use import FLAGS, SAMPLE, processor_seconds, serving
from tests.support.page import find_browser

PAINTS = """() => new Promise(done => {
  const paints = {};
  new PerformanceObserver(list => { for (const entry of list.getEntries()) paints.largest = entry.startTime / 1000; })
    .observe({type: "largest-contentful-paint", buffered: true});
  setTimeout(() => { for (const entry of performance.getEntriesByType("paint")) paints[entry.name] = entry.startTime / 1000; done(paints); }, 1000);
})"""


def paints(browser: Browser, address: str, repeats: int) -> None:
    """Print when something, and the largest thing, is first painted, each time with an empty cache."""
    seen = []
    for _ in range(repeats):
        context = browser.new_context(viewport={"width": 1280, "height": 900})
        page = context.new_page()
        page.goto(address)
        page.wait_for_selector("body[data-ready=yes]", timeout=60_000)
        seen.append(page.evaluate(PAINTS))
        context.close()
    for name in ("first-contentful-paint", "largest"):
        times = [one[name] for one in seen]
        print(
            f"{name:<24} {statistics.median(times):6.2f} s median, {max(times):.2f} s most of "
            f"{repeats} (bar: 1 s)"
        )


def ask_for(page: Page, action: str) -> str:
    """Request 12 frames of one view; return the id of the job's card."""
    page.locator("#model").select_option("cmu")
    page.locator("#action").fill(action)
    page.locator("#seconds").fill("1")
    page.locator("#size").select_option("256")
    for name in ("back", "left", "right"):
        page.locator(f"#views input[value={name}]").uncheck()
    if not page.locator("#fps").is_visible():
        page.locator("summary", has_text="More").click()
    page.locator("#fps").select_option("12")
    page.locator("#seed").fill(str(time.time_ns() % 10**6))  # a motion that no store remembers
    with page.expect_response(lambda answer: answer.url.endswith("api/jobs")) as answered:
        page.get_by_role("button", name="Make the video").click()
    return f"#job-{answered.value.json()['id']}"


def video(page: Page, action: str, limit: float) -> float:
    """Return the seconds from the request until the card reports that the video is done."""
    started = time.perf_counter()
    page.locator(f"{ask_for(page, action)} .badge").filter(has_text="done").wait_for(
        timeout=1000 * limit
    )
    return time.perf_counter() - started


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--photo", type=Path, default=SAMPLE)
    parser.add_argument("--cache")
    given = parser.parse_args()
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(Path(folder) / "page", given.cache) as (address, server),
        sync_playwright() as engine,
    ):
        browser = engine.chromium.launch(executable_path=find_browser(), args=list(FLAGS))
        paints(browser, address, given.repeats)
        page = browser.new_page()
        page.goto(address)
        page.locator("body[data-ready=yes]").wait_for(timeout=60_000)
        page.locator("#file").set_input_files(given.photo)
        page.locator("#seen-text").filter(has_text="Found the person").wait_for(timeout=600_000)
        for name, action in (
            ("first after the start", "Walk"),
            ("another action", "Jump"),
            ("another action", "Dance"),
        ):
            before = processor_seconds(server)
            seconds = video(page, action, 3600)
            print(
                f"{name + ', ' + action:<30} {seconds:6.1f} s by the clock (bar: 10 s), "
                f"{processor_seconds(server) - before:.1f} s of processors"
            )
        browser.close()
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
