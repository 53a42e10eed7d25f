"""Measure the page of `a2v serve` in Chromium: first paints, and actions of the sample person.

    python -m benchmarks.page [--repeats 5] [--actions 50]

The targets, on an idle machine: first contentful paint within 0.6 s; from a click to the first
changed frame, five seconds of motion within 0.5 s (p95). Only this machine is contacted. A new
photo is measured by `benchmarks.first_use`.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, sync_playwright

from benchmarks.first_use import FLAGS, serving
from tests.support.page import find_browser

LOOK_MILLISECONDS = 1000
"""Time for which an action is looked at before the next is pressed."""
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
            f"{repeats} (bar: 0.6 s)"
        )


ACT = """name => new Promise(done => {
  const stage = document.querySelector("#stage"), acts = Number(document.body.dataset.acts || 0), begun = performance.now();
  performance.clearResourceTimings();
  [...document.querySelectorAll("#actions button")].find(item => item.textContent === name).click();
  let drawn = 0;
  const look = () => {
    if (!drawn && Number(document.body.dataset.acts || 0) > acts) drawn = Number(stage.dataset.frames);
    if (drawn && Number(stage.dataset.frames) > drawn) {
      const [asked] = performance.getEntriesByType("resource").filter(entry => entry.name.endsWith("/play") && entry.startTime >= begun);
      done([performance.now() - begun, asked ? asked.responseEnd - asked.requestStart : 0]);
    } else if (performance.now() - begun > 60000) done(null);
    else setTimeout(look, 4);
  };
  look();
})"""
"""Script: press an action; milliseconds until the first frame of it, and of the server's answer."""
RATE = """() => new Promise(done => {
  const stage = document.querySelector("#stage"), frames = Number(stage.dataset.frames), begun = performance.now();
  setTimeout(() => done((Number(stage.dataset.frames) - frames) / (performance.now() - begun) * 1000), 4000);
})"""
"""Script: frames a second of the stage."""


def acts(browser: Browser, address: str, count: int) -> None:
    """Print how long actions take from the click; each is pressed once, the first is not counted."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto(address)
    page.wait_for_selector("body[data-person]", timeout=120_000)
    page.wait_for_selector("#actions button", timeout=120_000)
    names = page.locator("#actions button").all_inner_texts()[: count + 1]
    told = []
    for name in names:
        told.append(page.evaluate(ACT, name))
        page.wait_for_timeout(LOOK_MILLISECONDS)
    told = told[1:]
    clicked, answered = np.array([one for one in told if one]).T
    for what, times in (("click to first frame", clicked), ("server's answer", answered)):
        half, most = np.percentile(times, [50, 95])
        print(f"{what:<24} {half:6.0f} ms p50, {most:.0f} ms p95 of {len(times)} (bar: 500 ms)")
    print(f"{'stage, software':<24} {page.evaluate(RATE):6.1f} frames a second (bar: 20)")


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--actions", type=int, default=50)
    given = parser.parse_args()
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(Path(folder), None) as (address, _),
        sync_playwright() as engine,
    ):
        browser = engine.chromium.launch(executable_path=find_browser(), args=list(FLAGS))
        print(f"load {os.getloadavg()[0]:.1f}")
        paints(browser, address, given.repeats)
        acts(browser, address, given.actions)
        print(f"load {os.getloadavg()[0]:.1f}")
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
