"""No text that the page can show names an option, a path, a node or a class."""

from __future__ import annotations

import html.parser
import importlib.util
import json
import re
import sys
from collections.abc import Iterator

import pytest

from pipelines.graph import video_graph
from pipelines.serve.answers import PAGE
from pipelines.serve.wishes import choices
from pipelines.serve.words import NOTHING, for_page
from pipelines.stages import ACTIONS, WORDS, said, title_of
from tests.support.page import ROOT

OWN = re.compile(
    r"(?<![\w-])--[a-z]|\b[a-z]+_[a-z_]+\b|\b(?:[A-Z][a-z]+){2,}(?:Error|Settings|Options)\b"
    r"|\b\w+\.(?:py|npz|yaml|onnx)\b|(?:^|\s)/(?:[a-z]+/)+|\ba2v (?:video|motion|serve|cache|actions|doctor)\b"
)
"""What a test finds without the filter's own expression."""
PRODUCT = ("a2v", "pipelines")
SHOWN_ATTRIBUTES = ("aria-label", "alt", "title", "placeholder")


class Texts(html.parser.HTMLParser):
    """The texts of a page that people see or hear."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_data(self, data: str) -> None:
        self.found.append(data)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [value or "" for name, value in attrs if name in SHOWN_ATTRIBUTES]


def script_texts() -> Iterator[tuple[str, str]]:
    """Sentences in the page's scripts: literals that hold a space, without their values."""
    literal = re.compile(r'"((?:[^"\\\n]|\\.)*)"|`((?:[^`\\]|\\.)*)`')
    for path in sorted(PAGE.glob("*.js")):
        for line in path.read_text(encoding="utf-8").splitlines():
            code = line.split("//")[0] if "://" not in line else line
            for one in literal.finditer(code):
                text = re.sub(r"\$\{[^{}]*\}", "…", one[1] or one[2] or "")
                if re.search(r"[A-Za-z]{2,} [A-Za-z]{2,}", text):
                    yield path.name, text


def test_the_pages_own_texts() -> None:
    texts = Texts()
    texts.feed((PAGE / "index.html").read_text(encoding="utf-8"))
    assert len(texts.found) > 100
    assert [text for text in texts.found if OWN.search(text)] == []
    scripts = list(script_texts())
    assert len(scripts) > 60
    assert [(name, text) for name, text in scripts if OWN.search(text)] == []


def refusals() -> list[str]:
    """Every message with which the product refuses something, and every note and warning."""
    spec = importlib.util.spec_from_file_location("refusals", ROOT / "scripts" / "list_refusals.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["refusals"] = module
    spec.loader.exec_module(module)
    paths = [
        path
        for folder in PRODUCT
        for path in sorted((ROOT / folder).rglob("*.py"))
        if "lab" not in path.parts
    ]
    own = [text for path in paths for text in module.refusals(path)]
    module.ERRORS = ("note", "append", "remark", "warn")
    return own + [text for path in paths for text in module.refusals(path)]


def test_every_message_of_the_server() -> None:
    messages = refusals()
    assert len(messages) > 600
    told = {text: for_page(text) for text in messages}
    assert {text: kept for text, kept in told.items() if OWN.search(kept)} == {}
    assert sum(kept == NOTHING for kept in told.values()) < 0.05 * len(told)
    assert all(kept.strip() for kept in told.values())


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("no person found; try another photo, or give --mask and --keypoints", "Correct"),
        ("expect a wrong shape; try another photo, or give --mask and --keypoints", "wrong shape"),
        ("'eat_pie_burger' cannot follow a path; choose another --model", "Eating a burger"),
        ("3 people are in the photo; the largest is used (give --mask or --corrections to choose another)", "press another"),
    ],
)  # fmt: skip
def test_a_remedy_is_one_of_the_page(given: str, meant: str) -> None:
    kept = for_page(given)
    assert meant in kept
    assert not OWN.search(kept)


def test_actions_and_stages_have_words() -> None:
    told = choices()["actions"]
    assert len(told) > 200
    assert [
        entry for entry in told if OWN.search(entry["title"]) or OWN.search(entry["note"])
    ] == []
    assert len({entry["title"] for entry in told}) == len(told)
    assert title_of("eat_pie_burger") == "Eating a burger"
    assert said("walk, then eat_pie_burger for 2 s") == "walk, then Eating a burger for 2 s"
    assert set(ACTIONS) >= {entry["name"] for entry in told if "_" in entry["name"]}
    names = {step.node.name for step in video_graph()}
    assert names <= set(WORDS)
    assert not any(OWN.search(word) for word in WORDS.values())
    assert json.dumps(told)
