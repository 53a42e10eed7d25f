"""Every rule of reading and coloring has a name, a purpose and a measured line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from a2v.errors import InputError
from a2v.reconstruction.coloring import STEPS, ColorSettings
from a2v.reconstruction.reading import READERS, ReadingSettings
from a2v.reconstruction.rules import BAKING, CANVAS, COLORING, READING

ROOT = Path(__file__).resolve().parents[2]
NEEDED = {"show_body", "expect", "label", "continue_materials", "solve"}
"""What cannot be left out, because others work on its result."""


def test_every_step_and_reader_is_a_rule() -> None:
    readers, steps = ({one.__name__ for one in found} for found in (READERS, STEPS))
    assert readers - NEEDED == set(READING)
    assert steps - NEEDED | set(CANVAS) | set(BAKING) == set(COLORING)


def test_every_rule_has_a_measured_line() -> None:
    page = (ROOT / "docs" / "results" / "rules.md").read_text(encoding="utf-8")
    lines = dict(re.findall(r"^\| (\w+) \| (.*) \|$", page, re.MULTILINE))
    assert set(READING) | set(COLORING) == set(lines) - {"rule"}
    for name, purpose in {**READING, **COLORING}.items():
        assert lines[name].startswith(purpose), name
        assert re.search(r"\d", lines[name].removeprefix(purpose)), name


def test_an_unknown_rule_is_refused() -> None:
    with pytest.raises(InputError, match=r"no rule 'x' to leave out; choose from follow_map"):
        ColorSettings(without="delight, x")
    with pytest.raises(InputError, match="no rule 'delight'"):
        ReadingSettings(without="delight")
    names = {one.__name__ for one in ReadingSettings(without="find_gloves,find_skirts").readers}
    assert {one.__name__ for one in READERS} - names == {"find_gloves", "find_skirts"}
