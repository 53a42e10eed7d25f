"""Checks of a page's accessibility in a browser: axe-core of npm, and the keyboard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from playwright.sync_api import Page

from tests.support.npm import npm_folder

PACKAGE = "axe-core@4.14.1"
WIDTHS = (320, 768, 1280)
LOOKS = {320: "light", 1280: "dark"}
"""Color schemes by the width at which axe looks at them: colors do not depend on the width."""
SERIOUS = ("serious", "critical")
_RUN = """async () => (await axe.run(document, {iframes: false})).violations
  .map(found => [found.impact, found.id, found.nodes.map(node => `${node.html.slice(0, 160)} ${node.any.map(one => one.message).join("; ")}`).join(" | ")])"""
_FOCUSABLE = """() => {
  const kinds = "a[href], button, input, select, textarea, summary, video[controls], [tabindex]";
  const root = document.querySelector("dialog[open]") || document;
  return [...root.querySelectorAll(kinds)].filter(item =>
    item.checkVisibility() && !item.disabled && item.tabIndex >= 0 && item.getClientRects().length
    && !(item.type === "radio" && !item.checked))
    .map(item => { item.dataset.wanted = "yes"; return item.outerHTML.slice(0, 120); });
}"""
_MARK = """() => {
  const item = document.activeElement;
  if (!item || item === document.body) return null;
  const shown = ["IFRAME", "VIDEO"].includes(item.tagName) || [item, ...(item.labels || []), item.closest("label, .drop"), item.nextElementSibling].filter(Boolean).some(one => {
    const style = getComputedStyle(one);
    return style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1 || style.strokeWidth === "5px";
  });
  const first = item.dataset.reached !== "yes", still = item === window.lastFocused;
  item.dataset.reached = "yes";
  window.lastFocused = item;
  return [first || still, shown, item.outerHTML.slice(0, 120)];
}"""


def axe_script() -> str:
    """axe-core as a script; the test is skipped where npm does not give it."""
    path = npm_folder("axe", PACKAGE) / "node_modules" / "axe-core" / "axe.min.js"
    return path.read_text(encoding="utf-8")


def findings(page: Page, script: str) -> list[Any]:
    """Impact, rule and elements of each finding of axe-core on a page that allows scripts."""
    if not page.evaluate("typeof window.axe === 'object'"):
        page.evaluate(script)
    found: list[Any] = page.evaluate(_RUN)
    return found


def serious(page: Page, script: str) -> list[Any]:
    """The findings that axe-core calls serious or critical."""
    return [found for found in findings(page, script) if found[0] in SERIOUS]


def keyboard_faults(page: Page, most: int = 400) -> list[str]:
    """Controls that Tab does not reach, and controls that show no focus.

    Controls inside of videos and frames are the browser's, or those of another page.
    """
    wanted = page.evaluate(_FOCUSABLE)
    page.evaluate("document.activeElement.blur()")
    faults = []
    for _ in range(most):
        page.keyboard.press("Tab")
        seen = page.evaluate(_MARK)
        if seen is None:
            continue
        first, shown, what = seen
        if not first:
            break
        if not shown:
            faults.append(f"no visible focus: {what}")
    missed = page.evaluate(
        "[...document.querySelectorAll('[data-wanted]:not([data-reached])')]"
        ".map(item => item.outerHTML.slice(0, 120))"
    )
    assert wanted
    return faults + [f"not reached: {what}" for what in missed]


def saved(page: Page, path: Path) -> None:
    """Write a picture of the whole page."""
    path.parent.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=path, full_page=True)
