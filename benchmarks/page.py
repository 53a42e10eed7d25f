"""Measure the page of `a2v serve` in Chromium: first paints, and a small video of a known
character.

python -m benchmarks.page [--repeats 5] [--photo P] [--cache FOLDER] measures until the finished
card. python -m benchmarks.page --new measures from a new photo to the character that moves on the
page.

The targets, on an idle machine: first contentful paint within 1 s, 12 frames of one view, 256 px,
within 10 s, and with --new the moving character within 40 s of the photo. Without --new the photo's
character is made first if the store does not have it (minutes). Only this machine is contacted.
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
    """Return user and system time of a process and all its descendants."""
    total = 0.0
    for one in [process, *process.children(recursive=True)]:
        times = one.cpu_times()
        total += times.user + times.system
    return total


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


def moving(page: Page, photo: Path, server: psutil.Process) -> None:
    """Print when each stage of a new person is shown, in seconds and processor seconds.

    Time counts from sending the photo; the last stage is the character that moves.
    """
    started, before = time.perf_counter(), processor_seconds(server)

    def seen(what: str) -> None:
        print(
            f"{what:<30} {time.perf_counter() - started:6.1f} s by the clock, "
            f"{processor_seconds(server) - before:.1f} s of processors",
            flush=True,
        )

    page.locator("#file").set_input_files(photo)
    page.locator("#shown[src]").wait_for(timeout=600_000)
    card = ask_for(page, "Walk")
    page.locator("#seen-text").filter(has_text="Found the person").wait_for(timeout=600_000)
    seen("outline")
    for stage in ("body", "surface", "textured"):
        page.locator(f"{card} .now img[src*=stage_{stage}]").wait_for(timeout=3_600_000)
        seen(stage)
    page.frame_locator(f"{card} .now iframe").locator("body[data-state=ready]").wait_for(
        timeout=3_600_000
    )
    seen("moving (bar: 40 s)")


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--photo", type=Path, default=ROOT / "a2v" / "samples" / "person.jpg")
    parser.add_argument("--cache")
    parser.add_argument(
        "--new",
        action="store_true",
        help="nothing of the photo is remembered; the cache is an empty folder",
    )
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "pipelines",
            "serve",
            "--folder",
            f"{folder}/page",
            "--port",
            "0",
        ]
        cache = f"{folder}/store" if given.new else given.cache
        command += ["--cache", cache] if cache else []
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            address = process.stdout.readline().strip()
            with sync_playwright() as engine:
                browser = engine.chromium.launch(
                    executable_path=find_browser(),
                    args=[
                        "--use-angle=swiftshader",
                        "--enable-unsafe-swiftshader",
                        "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
                    ],
                )
                if not given.new:
                    paints(browser, address, given.repeats)
                page = browser.new_page()
                page.goto(address)
                page.locator("body[data-ready=yes]").wait_for(timeout=60_000)
                if given.new:
                    moving(page, given.photo, psutil.Process(process.pid))
                    return 0
                page.locator("#file").set_input_files(given.photo)
                page.locator("#seen-text").filter(has_text="Found the person").wait_for(
                    timeout=600_000
                )
                server = psutil.Process(process.pid)
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
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(60)
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
