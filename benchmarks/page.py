"""The page of `a2v serve` in Chromium: first paints, and a small video of a remembered character, from the click to the finished card.

    python -m benchmarks.page [--repeats 5] [--photo P] [--cache FOLDER]

The bars, on an idle machine: first contentful paint within 1 s, and 12 frames of one view, 256 px, within 10 s. The photo's character is
made first where the store does not have it (minutes). Nothing is asked of any machine but this one.
"""

from __future__ import annotations

import argparse
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil
from playwright.sync_api import Browser, Page, sync_playwright

from tests.support.page import find_browser

ROOT = Path(__file__).resolve().parents[1]
PAINTS = """() => new Promise(done => {
  const paints = {};
  new PerformanceObserver(list => { for (const entry of list.getEntries()) paints.largest = entry.startTime / 1000; })
    .observe({type: "largest-contentful-paint", buffered: true});
  setTimeout(() => { for (const entry of performance.getEntriesByType("paint")) paints[entry.name] = entry.startTime / 1000; done(paints); }, 1000);
})"""


def processor_seconds(process: psutil.Process) -> float:
    """User and system time of a process and all below it."""
    total = 0.0
    for one in [process, *process.children(recursive=True)]:
        times = one.cpu_times()
        total += times.user + times.system
    return total


def paints(browser: Browser, address: str, repeats: int) -> None:
    """Print when something, and the largest thing, is first seen, each time in a browser without anything remembered."""
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
        print(f"{name:<24} {statistics.median(times):6.2f} s median, {max(times):.2f} s most of {repeats} (bar: 1 s)")


def video(page: Page, action: str, limit: float) -> float:
    """Seconds from the click on the button until the card says that the video is done."""
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
        started = time.perf_counter()
        page.get_by_role("button", name="Make the video").click()
    badge = page.locator(f"#job-{answered.value.json()['id']} .badge")
    badge.filter(has_text="done").wait_for(timeout=1000 * limit)
    return time.perf_counter() - started


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--photo", type=Path, default=ROOT / "a2v" / "samples" / "person.jpg")
    parser.add_argument("--cache")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pipelines", "serve", "--folder", folder, "--port", "0"]
        command += ["--cache", given.cache] if given.cache else []
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            address = process.stdout.readline().strip()
            with sync_playwright() as engine:
                browser = engine.chromium.launch(
                    executable_path=find_browser(), args=["--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"]
                )
                paints(browser, address, given.repeats)
                page = browser.new_page()
                page.goto(address)
                page.locator("#file").set_input_files(given.photo)
                page.locator("#seen-text").filter(has_text="Found the person").wait_for(timeout=600_000)
                server = psutil.Process(process.pid)
                for name, action in (("first after the start", "Walk"), ("another action", "Jump"), ("another action", "Dance")):
                    before = processor_seconds(server)
                    seconds = video(page, action, 3600)
                    print(
                        f"{name + ', ' + action:<30} {seconds:6.1f} s by the clock (bar: 10 s), {processor_seconds(server) - before:.1f} s of processors"
                    )
                browser.close()
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(60)
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
