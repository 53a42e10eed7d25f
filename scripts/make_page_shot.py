"""``docs/images/page.webp``: the page of ``a2v serve`` with the sample person and a finished video,
as Chromium shows it.

    python scripts/make_page_shot.py [--folder FOLDER] [--cache FOLDER] [--out
    docs/images/page.webp]

A folder of an earlier run is taken as it is; otherwise the sample person is made (minutes).
"""

from __future__ import annotations

import argparse
import io
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.support.page import find_browser  # noqa: E402

WIDTH, HEIGHT = 1240, 1050
LONG = 3_600_000


def prepared(page: Page) -> None:
    """Put the sample person and a video of two views on the page."""
    if not page.locator("#photos button").count():
        page.get_by_role("button", name="Sample person").click()
    page.locator("#seen-text").filter(has_text="Found the person").wait_for(timeout=LONG)
    if not page.locator(".badge.done").count():
        page.locator("#action").fill("walk, then wave")
        page.locator("#seconds").fill("2")
        page.locator("summary", has_text="More").last.click()
        page.locator("#fps").select_option("12")
        page.locator("summary", has_text="More").last.click()
        for name in ("back", "right"):
            page.locator(f"#views input[value={name}]").uncheck()
        page.get_by_role("button", name="Make the video").click()
    page.locator(".badge.done").first.wait_for(timeout=LONG)


def main() -> None:
    """Make the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--cache")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images" / "page.webp")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as other:
        command = [
            sys.executable,
            "-m",
            "pipelines",
            "serve",
            "--folder",
            str(given.folder or other),
            "--port",
            "0",
        ]
        process = subprocess.Popen(
            command + (["--cache", given.cache] if given.cache else []),
            cwd=ROOT,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout is not None
            with sync_playwright() as engine:
                flags = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
                page = engine.chromium.launch(executable_path=find_browser(), args=flags).new_page(
                    viewport={"width": WIDTH, "height": HEIGHT}
                )
                page.set_default_timeout(120_000)
                page.goto(process.stdout.readline().strip())
                page.locator("body[data-ready=yes]").wait_for()
                prepared(page)
                page.get_by_role("tab", name="Character").first.click()
                page.frame_locator(".panel iframe").first.locator(
                    "body[data-state=ready]"
                ).wait_for()
                page.evaluate("scrollTo(0, 0)")
                page.wait_for_timeout(3000)
                with Image.open(io.BytesIO(page.screenshot())) as shot:
                    shot.convert("RGB").save(given.out, "webp", quality=80)
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(60)
    print(given.out)


if __name__ == "__main__":  # worker processes import this file again
    main()
