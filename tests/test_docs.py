"""Pages name only existing links, names, imports and options; the architecture is current."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest

from tests.support.commands import parsed
from tests.support.examples import blocks

ROOT = Path(__file__).resolve().parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "CHANGELOG.md",
    ROOT / "a2v" / "weights" / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]


def each_page(pages: list[Path] = PAGES) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("page", pages, ids=lambda path: str(path.relative_to(ROOT)))


def find(name: str) -> object:
    """A module, or what a module holds, by its full name."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        module = ".".join(parts[:count])
        if importlib.util.find_spec(parts[0]) and _is_module(module):
            value: object = importlib.import_module(module)
            for part in parts[count:]:
                value = getattr(value, part)
            return value
    raise ModuleNotFoundError(name)


def _is_module(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:
        return False


def commands(page: Path) -> list[list[str]]:
    """The words of every whole command ``a2v ...`` on a page, in blocks and in the text."""
    lines = [
        line.strip()
        for block in blocks(page, "")
        for line in block.replace("\\\n", " ").splitlines()
    ]
    lines += re.findall(
        r"`(a2v [^`]*--[^`]*)`",
        re.sub(
            r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
        ),
    )
    found = [
        shlex.split(line.removeprefix(".venv/bin/")[4:], comments=True)
        for line in lines
        if re.match(r"(\.venv/bin/)?a2v ", line)
    ]
    found = [
        words[: words.index(">")] if ">" in words else words for words in found
    ]  # what the shell takes for itself
    return [
        words for words in found if not {"...", "--help", "--help-all", "--help-lab"} & set(words)
    ]


@each_page()
def test_commands_on_the_page_have_these_options(page):
    for words in commands(page):
        parsed(words)


@each_page()
def test_links_lead_somewhere(page):
    text = re.sub(
        r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    targets = [
        target.split("#")[0]
        for target in re.findall(r"\]\(([^)\s]+)\)", text)
        if not re.match(r"[a-z]+:", target)
    ]
    broken = [target for target in targets if target and not (page.parent / target).exists()]
    assert not broken, f"{page.relative_to(ROOT)} links to {', '.join(broken)}, which is not there"


def test_the_readmes_pictures_are_small_and_every_picture_of_the_docs_is_shown():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    shown = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert shown
    assert not [name for name in shown if (ROOT / name).stat().st_size > 300_000]
    pictures = {path.name for path in (ROOT / "docs" / "images").iterdir()}
    assert {name for name in pictures if name not in text} == set()


@each_page()
def test_names_in_the_text_exist(page):
    names = re.findall(
        r"`((?:a2v|pipelines|export)(?:\.\w+)+)(?:\([^`]*\))?`", page.read_text(encoding="utf-8")
    )
    for name in sorted(set(names)):
        assert name.endswith((".py", ".md")) or find(name) is not None, name


@each_page()
def test_files_in_the_text_exist(page):
    text = page.read_text(encoding="utf-8")
    names = re.findall(
        r"[`(\s]((?:a2v|pipelines|export|scripts|benchmarks|tests|notebooks|docs)/[\w./-]*\.(?:py|sh|md|onnx|jpg|ipynb))\b",
        text,
    )
    missing = sorted({name for name in names if not (ROOT / name).exists()})
    assert not missing, f"{page.relative_to(ROOT)} names {', '.join(missing)}, which is not there"


@each_page()
def test_python_on_the_page_is_python_and_imports_what_there_is(page):
    for block in blocks(page, "python"):
        for node in ast.walk(ast.parse(block)):
            if (
                isinstance(node, ast.ImportFrom)
                and node.module
                and node.module.split(".")[0] in ("a2v", "pipelines", "export")
            ):
                module: ModuleType = importlib.import_module(node.module)
                assert not [name.name for name in node.names if not hasattr(module, name.name)], (
                    ast.unparse(node)
                )


def test_every_page_is_reached_from_the_index():
    folder = ROOT / "docs"
    reached, waiting = set(), [folder / "index.md"]
    while waiting:
        page = waiting.pop()
        if page not in reached and page.suffix == ".md":
            reached.add(page)
            links = re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
            waiting += [
                path
                for link in links
                if (path := (page.parent / link).resolve()).is_relative_to(folder)
                and path.is_file()
            ]
    assert {page.name for page in set(folder.rglob("*.md")) - reached} == set()


def test_the_picture_of_the_architecture_is_todays():
    drawing = importlib.import_module("scripts.draw_architecture")
    text = drawing.PAGE.read_text(encoding="utf-8")
    assert "a2v.types -> a2v.camera, a2v.errors" in text
    assert drawing.page(text) == text, (
        "the architecture has changed: run python scripts/draw_architecture.py and commit what it "
        "writes"
    )
    assert drawing.picture() == drawing.PICTURE.read_text(encoding="utf-8"), (
        "run python scripts/draw_architecture.py"
    )
