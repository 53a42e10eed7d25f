"""Child interpreters and the working folder."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from a2v.processes import import_folders, python_command
from tests.support.traps import set_traps

ROOT = Path(__file__).resolve().parents[1]

LOCAL = "from pipelines.engine.executors import open_executor as start; options = dict(name='local', workers=2)"
DASK = "from pipelines.engine.executors import open_executor as start; options = dict(name='dask', workers=1)"
POOL = """
    import contextlib, multiprocessing
    from concurrent.futures import ProcessPoolExecutor
    from a2v.processes import safe_children
    @contextlib.contextmanager
    def start():
        with safe_children(), ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            yield pool
    options = {}
"""
OLD = """
    import a2v.processes
    a2v.processes.OLD_PYTHON = True
"""


@pytest.fixture
def trapped(tmp_path: Path) -> tuple[Path, Path]:
    """A folder full of traps, and the file that tells which of them ran."""
    set_traps(tmp_path / "here", tmp_path / "marks")
    return tmp_path / "here", tmp_path / "marks"


@pytest.mark.parametrize("old", [False, True], ids=["PYTHONSAFEPATH", "python 3.10"])
@pytest.mark.parametrize("kind", [LOCAL, POOL, DASK], ids=["fork server", "spawn", "dask"])
def test_workers_import_nothing_from_the_working_folder(trapped, tmp_path, kind, old):
    if kind is DASK:
        pytest.importorskip("distributed")
    here, marks = trapped
    body = "".join(
        map(
            textwrap.dedent,
            (
                (OLD if old else ""),
                kind,
                "\nwith start(**options) as pool: print(pool.submit(os.getcwd).result())\n",
            ),
        )
    )
    script = tmp_path / "elsewhere" / "job.py"
    script.parent.mkdir()
    script.write_text("import os\nif __name__ == '__main__':\n" + textwrap.indent(body, "    "))
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=here,
        env={**clean, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert not marks.exists(), marks.read_text()
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(here)  # workers do work there


def test_a_command_imports_what_its_parent_does_but_nothing_from_the_working_folder(
    trapped, monkeypatch
):
    here, marks = trapped
    monkeypatch.chdir(here)
    monkeypatch.setattr(sys, "path", ["", str(here), *sys.path])
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    code = "import json, socket, sys, a2v; print(a2v.__file__, sys.argv[1:])"
    done = subprocess.run(
        python_command(code, "a word"), capture_output=True, text=True, timeout=60
    )
    assert done.stdout.strip() == f"{ROOT / 'a2v' / '__init__.py'} ['a word']", done.stderr
    assert not marks.exists(), marks.read_text()


def test_a_checkout_that_is_the_working_folder_stays_importable(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "path", ["", str(ROOT), "/elsewhere"])
    assert import_folders() == [str(ROOT), "/elsewhere"]


def test_a_working_folder_that_was_removed_is_no_obstacle(tmp_path, monkeypatch):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert "" not in import_folders()
