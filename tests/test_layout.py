"""Rules for the tests themselves."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent


def imported_modules(path: Path) -> set[str]:
    """Full names of all modules that a file may import, also within functions."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = (
                path.relative_to(FOLDER.parent).with_suffix("").parts[: -node.level]
                if node.level
                else ()
            )
            module = ".".join((*above, *(node.module or "").split("."))).rstrip(".")
            found |= {module, *(f"{module}.{name.name}" for name in node.names)}
    return found


def test_no_test_imports_from_another_test_module():
    for path in FOLDER.rglob("*.py"):
        parts = {part for name in imported_modules(path) for part in name.split(".")}
        taken = parts & {"conftest", *(other.stem for other in FOLDER.rglob("test_*.py"))}
        assert not taken, (
            f"{path.relative_to(FOLDER)} imports {', '.join(taken)}; what tests share belongs to "
            "tests/support"
        )


def test_shared_makers_rely_on_the_library_and_on_each_other_alone():
    for path in (FOLDER / "support").glob("*.py"):
        assert not [
            name
            for name in imported_modules(path)
            if name.split(".")[0] == "tests" and name.split(".")[1:2] != ["support"]
        ], path


def test_commands_of_the_laboratory_are_tested_in_its_folder():
    """`make test-product` leaves out folders, so that no list can go stale."""
    commands = {path.stem for path in (FOLDER.parent / "pipelines" / "lab").glob("*.py")}
    assert not [
        path.name
        for path in FOLDER.glob("test_*_command.py")
        if path.stem.removeprefix("test_").removesuffix("_command") in commands
    ]
    make = (FOLDER.parent / "Makefile").read_text(encoding="utf-8")
    assert "--ignore=tests/lab --ignore=tests/export" in make


def test_the_slow_files_begin():
    """Workers take files in this order."""
    slow = (FOLDER / "slow.txt").read_text(encoding="utf-8")
    names = [line.split()[0] for line in slow.splitlines() if not line.startswith("#")]
    assert [name for name in names if not (FOLDER.parent / name).exists()] == []
    files = ["tests/test_digest.py", "tests/test_docs.py"]
    assert [name in names for name in files] == [False, True]
    command = [sys.executable, "-m", "pytest", "--collect-only", "-o", "addopts=-q", *files]
    done = subprocess.run(command, cwd=FOLDER.parent, capture_output=True, text=True, timeout=120)
    found = [line.split(":")[0] for line in done.stdout.splitlines() if "::" in line]
    assert list(dict.fromkeys(found)) == files[::-1], done.stdout + done.stderr
