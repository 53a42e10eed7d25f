"""A running ``a2v serve`` and a browser to look at it with."""

from __future__ import annotations

import http.client
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

from pipelines.engine.forget import ref_of
from pipelines.nodes.values import Blob
from pipelines.serve.library import Library
from pipelines.serve.records import PERSON, Photo
from pipelines.serve.talk import ORIGINAL
from tests.support.uploads import picture

ROOT = Path(__file__).resolve().parents[2]
BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "msedge",
)

CONTRAST = """() => {
  const parse = text => text.match(/[\\d.]+/g).map(Number);
  const light = color => color.slice(0, 3).map(v => v / 255).map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = item => {
    for (let at = item; at; at = at.parentElement) {
      const color = parse(getComputedStyle(at).backgroundColor);
      if (color.length < 4 || color[3] > 0.99) return color;
    }
    return [255, 255, 255];
  };
  const bad = [];
  for (const item of document.querySelectorAll("body *")) {
    const own = [...item.childNodes].some(node => node.nodeType === 3 && node.textContent.trim());
    if (!own || !item.checkVisibility() || item.closest(":disabled, svg, option, .skip")) continue;
    const [a, b] = [light(parse(getComputedStyle(item).color)), light(behind(item))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) bad.push(`${item.tagName} ${item.textContent.trim().slice(0, 30)}: ${ratio.toFixed(2)}`);
  }
  return bad;
}"""
"""Script: texts of a page with too little contrast (WCAG AA: 4.5)."""
NAMELESS = """() => [...document.querySelectorAll("input, select, button, a, video, iframe, progress")]
  .filter(item => item.checkVisibility())
  .filter(item => !(item.labels && item.labels.length) && !item.getAttribute("aria-label") && !item.textContent.trim() && !item.title)
  .map(item => item.outerHTML)"""
"""Script: controls of a page without a name."""


def find_browser() -> str:
    """The browser's program; the test is skipped without one."""
    found = os.environ.get("CHROME") or next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(f"no browser found (looked for $CHROME, {', '.join(BROWSERS)})")
    return found


def arrived(library: Library, data: bytes, title: str, **facts: Any) -> Photo:
    """Add a photo to a library as if it had been sent and opened."""
    folder = library.arriving()
    (folder / ORIGINAL).write_bytes(data)
    return library.add_photo(
        folder,
        title,
        {"width": 160, "height": 200, "digest": ref_of(Blob.of(data)).digest, **facts},
    )


def ready(library: Library) -> Photo:
    """A photo whose person is made; nothing was computed."""
    photo = arrived(library, picture(), "somebody")
    photo.status, photo.known = "ready", True
    (library.place(photo) / PERSON).write_bytes(b"glTF")
    library.keep(photo)
    return photo


class Server:
    """``a2v serve`` in a process of its own; with the common store unless `cache` is given."""

    def __init__(self, folder: Path, port: int = 0, cache: Path | None = None) -> None:
        self.folder, self.cache = folder, cache
        command = [
            sys.executable,
            "-m",
            "pipelines",
            "serve",
            "--folder",
            str(folder),
            "--port",
            str(port),
            "--workers",
            "2",
            *(["--cache", str(cache)] if cache else []),
        ]
        self.process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        assert self.address.startswith("http://127.0.0.1:"), self.address
        self.port = urlsplit(self.address).port
        self.token = urlsplit(self.address).path.strip("/")

    def end(self, number: int = signal.SIGTERM) -> int:
        """Send a signal and wait for the end; the exit code."""
        self.process.send_signal(number)
        code = self.process.wait(30)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return code

    def ask(
        self,
        path: str = "",
        method: str = "GET",
        body: bytes | None = None,
        headers: Mapping[str, str] | None = None,
        *,
        whole: bool = False,
    ) -> tuple[int, dict[str, str], bytes]:
        """Send a request below the token, or of a `whole` path.

        Returns status, headers by lower-case name, and body.
        """
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            target = path if whole else f"/{self.token}/{path}"
            connection.putrequest(
                method, target, skip_host="host" in {name.lower() for name in headers or {}}
            )
            for name, value in (headers or {}).items():
                connection.putheader(name, value)
            if body is not None and "content-length" not in {
                name.lower() for name in headers or {}
            }:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            return (
                answer.status,
                {name.lower(): value for name, value in answer.getheaders()},
                answer.read(),
            )
        finally:
            connection.close()

    def say(self, path: str, value: object, method: str = "POST") -> tuple[int, dict[str, Any]]:
        """Send JSON; return the status and the answer."""
        status, _, body = self.ask(path, method, json.dumps(value).encode())
        return status, json.loads(body)

    def state(self) -> dict[str, Any]:
        """Photos and jobs."""
        found: dict[str, Any] = json.loads(self.ask("api/state")[2])
        return found


def opened(browser: str, page: Path, out: Path, query: str) -> np.ndarray:
    """Return the page as a browser shows it, (600, 1000, 3); it must use no network."""
    flags = [
        "--headless=new",
        "--no-sandbox",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--hide-scrollbars",
    ]
    flags += [
        "--window-size=1000,600",
        "--virtual-time-budget=10000",
        f"--user-data-dir={out / 'profile'}",
        "--host-resolver-rules=MAP * ~NOTFOUND",
    ]
    picture = out / "shot.png"
    command = [browser, *flags, f"--screenshot={picture}", f"{page.as_uri()}#{query}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    if not picture.exists():
        pytest.skip(f"the browser made no picture: {done.stderr.strip()[-200:]}")
    with Image.open(picture) as image:
        return np.asarray(image.convert("RGB")).astype(int)
