"""Every note about a result has an entry in docs/troubleshooting.md."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")

SOURCES = {
    "a2v/body/confidence.py": ["doubts"],
    "a2v/body/together.py": ["doubts_of"],
    "a2v/footage/remarks.py": ["unseen_parts", "told_pieces", "told_reel"],
    "a2v/perception/locate.py": ["_search"],
    "a2v/perception/person.py": ["_warn"],
    "a2v/reconstruction/canonical/face.py": [
        "PAINTED_FACE",
        "PAINTED_HEAD",
        "SMALL_FACE",
        "TURNED_FACE",
        "UNCLEAR_FACE",
    ],
    "a2v/reconstruction/remarks.py": ["remarks"],
    "a2v/rendering/variant.py": ["choose_variant"],
    "pipelines/nodes/photos.py": ["joint_fit"],
    "pipelines/nodes/place.py": None,
}
"""Functions (or constants) whose sentences become notes.

None stands for every literal that is given to `note`.
"""

NOTING = {
    "body.py",
    "motion.py",
    "photos.py",
    "place.py",
    "reconstruction.py",
    "rendering.py",
    "subject.py",
}
"""Modules of pipelines/nodes that call `note`: a new one belongs here, and what it says into
`SOURCES` and the page."""


def texts(node: ast.AST) -> list[list[str]]:
    """The constant pieces of each sentence among the literals of `node`."""
    found: list[list[str]] = []
    inside: set[int] = set()
    for part in ast.walk(node):
        if isinstance(part, ast.Raise):
            inside |= {id(child) for child in ast.walk(part)}
        if isinstance(part, ast.JoinedStr):
            inside |= {id(child) for child in ast.walk(part) if child is not part}
    for part in ast.walk(node):
        if id(part) in inside:
            continue
        if isinstance(part, ast.JoinedStr):
            found.append(
                [str(value.value) for value in part.values if isinstance(value, ast.Constant)]
            )
        elif isinstance(part, ast.Constant) and isinstance(part.value, str):
            found.append([part.value])
    return [
        pieces
        for pieces in found
        if any(len(re.findall(r"[a-z]+", piece)) >= 3 for piece in pieces)
    ]


def sentences() -> list[tuple[str, list[str]]]:
    found = []
    for path, names in SOURCES.items():
        tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
        if names is None:
            calls = [
                part
                for part in ast.walk(tree)
                if isinstance(part, ast.Call) and getattr(part.func, "id", "") == "note"
            ]
            found += [(path, pieces) for call in calls for pieces in texts(call)]
            continue
        for part in ast.walk(tree):
            if isinstance(part, ast.FunctionDef) and part.name in names:
                body = part.body[1:] if ast.get_docstring(part) else part.body
                found += [(path, pieces) for line in body for pieces in texts(line)]
            elif isinstance(part, ast.Assign) and getattr(part.targets[0], "id", "") in names:
                found += [(path, pieces) for pieces in texts(part.value)]
    return found


def has_entry(pieces: list[str]) -> bool:
    """Whether three consecutive words of the sentence are within quotation marks on the page."""
    quoted = " ".join(re.findall(r'"([^"]*)"', PAGE))
    for piece in pieces:
        words = piece.replace(":", " ").replace(";", " ").split()
        if any(" ".join(words[at : at + 3]) in quoted for at in range(len(words) - 2)):
            return True
    return False


@pytest.mark.parametrize(("path", "pieces"), sentences())
def test_a_sentence_has_an_entry(path: str, pieces: list[str]) -> None:
    assert has_entry(pieces), f"{path} prints {pieces}; docs/troubleshooting.md does not quote it"


def test_all_places_that_print_are_known() -> None:
    nodes = ROOT / "pipelines" / "nodes"
    assert {
        path.name
        for path in nodes.glob("*.py")
        if re.search(r"\bnote\(", path.read_text(encoding="utf-8"))
    } == NOTING
    assert len(sentences()) > 20


def test_a_sentence_that_is_not_there_is_found() -> None:
    assert not has_entry(["the moon is full: wait"])


def test_every_refusal_is_listed_in_a_page_that_git_ignores(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    listing = importlib.import_module("scripts.list_refusals")
    listing.main(["--out", str(tmp_path / "refusals.md")])
    page = (tmp_path / "refusals.md").read_text(encoding="utf-8")
    listing.main([])
    assert capsys.readouterr().out == page
    assert "- `no person found in the photo (the mask is empty)" in page
    for topic in listing.TOPICS:
        assert f"## {topic.title}\n\n{topic.cause}\n\n- `" in page
    assert "docs/refusals.md" in (ROOT / ".gitignore").read_text().splitlines()


def test_a_refusal_is_found_with_its_values_left_out(tmp_path: Path) -> None:
    listing = importlib.import_module("scripts.list_refusals")
    source = tmp_path / "module.py"
    source.write_text('raise InputError(f"the size is {size}; expected 1 " + "to 9")\n')
    assert list(listing.refusals(source)) == ["the size is …; expected 1 to 9"]
