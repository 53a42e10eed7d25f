"""The examples that pages and ``--help`` show."""

from __future__ import annotations

import re
from pathlib import Path

from pipelines.cli import every_command, load_command

ROOT = Path(__file__).resolve().parents[2]


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a page in `language` ("" for those without a name)."""
    found = re.findall(
        r"^```(\w*)\n(.*?)^```$", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    return [text for name, text in found if name == language]


def command_lines(text: str) -> list[str]:
    """Command lines of a2v in a page's code: in blocks, and in a line of the text."""
    text = re.sub(r"\s*\\\n\s*", " ", text)
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    found = [
        line.strip().removeprefix("$ ")
        for kind, block in blocks
        if kind != "python"
        for line in block.splitlines()
    ]
    found += re.findall(
        r"`(a2v [^`\n]+)`", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    )
    return [line for line in found if re.match(r"a2v \w", line)]


def prose(notebook: Path) -> str:
    """The text of a notebook's cells of Markdown, by its source in Python."""
    cells = re.split(r"^# %%", notebook.read_text(encoding="utf-8"), flags=re.MULTILINE)
    told = [cell for cell in cells if cell.startswith(" [markdown]")]
    lines = "\n".join(told).splitlines()
    return "\n".join(re.sub("^# ?", "", line) for line in lines)


def examples_of(name: str) -> list[str]:
    return [
        line.strip()
        for line in load_command(name).EXAMPLES.splitlines()
        if line.startswith("  a2v ")
    ]


PAGES = {
    path.relative_to(ROOT).as_posix(): command_lines(path.read_text())
    for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/**/*.md"))
}
PAGES |= {f"a2v {name} --help": examples_of(name) for name in every_command()}
