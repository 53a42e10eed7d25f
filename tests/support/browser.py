"""Scripts with packages of npm, run by a browser without network."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.support.npm import npm_folder
from tests.support.page import find_browser

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

LOCAL = ", EXCLUDE 127.0.0.1"
"""Rule for `chromium` with which pages of this machine's server are found."""
SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Flags with which WebGL runs without a graphics card."""
CALM = """(() => {
  const own = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = draw => own(() => setTimeout(() => draw(performance.now()), 700));
})()"""
"""Script: pages draw about once a second; WebGL without a graphics card takes all cores."""
THREE_VRM = (
    "three@0.187.0",
    "@pixiv/three-vrm@3.5.5",
    "@pixiv/three-vrm-animation@3.5.5",
    "esbuild@0.28.2",
)
"""Packages that read avatars of both editions of VRM."""


def bundled(script: Path, folder_name: str, *packages: str) -> str:
    """A script with the npm packages that it imports, as one text.

    The test is skipped without node or the packages.
    """
    if shutil.which("node") is None:
        pytest.skip(f"{script.name} needs node; it is not installed")
    folder = npm_folder(folder_name, *packages)
    source, out = folder / script.name, folder / f"{script.stem}.bundle.js"  # beside its packages
    source.write_bytes(script.read_bytes())
    program = str(folder / "node_modules" / ".bin" / "esbuild")
    options = [
        "--bundle",
        "--format=iife",
        '--define:import.meta.url="file:///"',
        f"--outfile={out}",
        "--log-level=error",
    ]
    subprocess.run([program, str(source), *options], check=True, timeout=120)
    return out.read_text(encoding="utf-8")


@contextmanager
def chromium(*flags: str, exclude: str = "") -> Iterator[Browser]:
    """A browser that resolves no host but those that the rule `exclude` names."""
    from playwright.sync_api import sync_playwright

    rules = f"--host-resolver-rules=MAP * ~NOTFOUND{exclude}"
    with sync_playwright() as engine:
        opened = engine.chromium.launch(executable_path=find_browser(), args=[*flags, rules])
        yield opened
        opened.close()


def calm(opened: Page | BrowserContext) -> None:
    """Let the pages of a context, and the frames within them, draw seldom."""
    opened.add_init_script(CALM)


def told_by(script: str, given: dict[str, Any]) -> Any:
    """What the promise `window.told` of a script, which sees `window.given`, becomes."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as engine:
        flags = [
            "--disable-gpu",
            "--autoplay-policy=no-user-gesture-required",
            "--host-resolver-rules=MAP * ~NOTFOUND",
        ]
        browser = engine.chromium.launch(
            executable_path=find_browser(), args=flags, chromium_sandbox=False
        )
        page = browser.new_page()
        page.set_default_timeout(180_000)
        page.evaluate("given => { window.given = given; }", given)
        page.add_script_tag(content=script)
        told = page.evaluate("() => window.told")
        browser.close()
    return told
