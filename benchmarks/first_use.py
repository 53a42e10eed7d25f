"""Use the page of `a2v serve` as a new user does: measure time from a photo to the moving person.

    python -m benchmarks.first_use [--photo P] [--cache FOLDER]

The user opens the page, chooses a photo, waits until the person is alive, and presses an action.
Without --cache nothing is remembered. Only this machine is contacted.

The targets, on two idle cores: one gesture, and the person moves within 36 s.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil
from playwright.sync_api import Page, sync_playwright

from tests.support.page import find_browser

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"
FLAGS = (
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)
LIMIT = 3600.0
"""Seconds after which the use of the page is given up."""
POLL_MILLISECONDS = 200
CHOOSING_MILLISECONDS = 5000
"""Time in which a person finds a file in the dialog."""
MADE = "body[data-person]:not([data-person=sample])"
"""Selector: the person of the photo stands on the stage."""
COUNT_CLICKS = """addEventListener("pointerdown", event => {
  if (event.isTrusted) sessionStorage.clicks = Number(sessionStorage.clicks || 0) + 1;
}, true);"""
"""Script that counts presses of the mouse; a label hands its click on to its input, which would
count twice."""


@dataclass(frozen=True)
class Event:
    """A state of the page that the user has seen.

    Attributes
    ----------
    name : str
    clicks : number of clicks until then
    seconds : wall-clock time since the page was opened
    processor : seconds of all processes of the server
    """

    name: str
    clicks: int
    seconds: float
    processor: float


def processor_seconds(process: psutil.Process) -> float:
    """Return user and system time of a process and all its descendants."""
    total = 0.0
    for one in [process, *process.children(recursive=True)]:
        with contextlib.suppress(psutil.NoSuchProcess):
            times = one.cpu_times()
            total += times.user + times.system + times.children_user + times.children_system
    return total


@contextlib.contextmanager
def serving(folder: Path, cache: str | None) -> Iterator[tuple[str, psutil.Process]]:
    """Run `a2v serve`; give its address and process."""
    command = [sys.executable, "-m", "pipelines", "serve", "--folder", str(folder), "--port", "0"]
    process = subprocess.Popen(
        command + (["--cache", cache] if cache else []),
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        yield process.stdout.readline().strip(), psutil.Process(process.pid)
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(60)


def use(
    page: Page,
    address: str,
    server: psutil.Process,
    photo: Path,
    watch: Callable[[str], None] = lambda _: None,
) -> list[Event]:
    """Go from the address to the person of the photo who acts.

    `watch` is called with the current action several times per second while the page works.
    """
    page.add_init_script(COUNT_CLICKS)
    started, before = time.perf_counter(), processor_seconds(server)
    found: list[Event] = []

    def note(name: str) -> None:
        clicks = int(page.evaluate("Number(sessionStorage.clicks || 0)"))
        spent = processor_seconds(server) - before
        found.append(Event(name, clicks, time.perf_counter() - started, spent))
        watch(name)

    def until(selector: str, doing: str) -> None:
        while not page.locator(selector).count():
            if time.perf_counter() - started > LIMIT:
                raise TimeoutError(f"{doing}: nothing after {LIMIT:.0f} s")
            watch(doing)
            page.wait_for_timeout(POLL_MILLISECONDS)

    page.goto(address)
    page.locator("body[data-ready=yes]").wait_for()
    page.locator("body[data-person=sample]").wait_for()
    note("sample person moves")
    with page.expect_file_chooser() as chooser:
        page.locator("label[for=file]").click()
    page.wait_for_timeout(CHOOSING_MILLISECONDS)
    chooser.value.set_files(photo)
    until("#shown[src]", "sending")
    note("photo is shown")
    until("#mask[src]", "looking")
    note("outline")
    for count, stage in enumerate(("body", "surface", "textured"), 2):
        until(f"#making-stages li.made:nth-child({count}), {MADE}", stage)
        note(stage)
    until(MADE, "moving")
    note("person is alive")
    page.locator("#actions button").nth(1).click()
    until("#chips .chip", "acting")
    until("body[data-acts]", "acting")
    note("person acts")
    return found


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--photo", type=Path, default=SAMPLE)
    parser.add_argument("--cache")
    given = parser.parse_args()
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(Path(folder) / "page", given.cache or f"{folder}/store") as (address, server),
        sync_playwright() as engine,
    ):
        browser = engine.chromium.launch(executable_path=find_browser(), args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(1000 * LIMIT)
        for event in use(page, address, server, given.photo):
            print(
                f"{event.name:<18} {event.clicks} clicks, {event.seconds:6.1f} s by the clock, "
                f"{event.processor:6.1f} s of processors",
                flush=True,
            )
        browser.close()
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
