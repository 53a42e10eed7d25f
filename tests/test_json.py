"""``--json``: one object on standard output, of success and of failure, for every command; and the exit codes."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import typing
from pathlib import Path
from typing import Any

import pytest

from pipelines.answer import Answer, plain
from pipelines.cli import main

ROOT = Path(__file__).resolve().parents[1]
MODULES = sorted(path.stem for path in (ROOT / "pipelines" / "commands").glob("[a-z]*.py"))


@pytest.fixture(autouse=True)
def _own_store(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(tmp_path_factory.mktemp("cache")))


def told(capsys, *words: object, code: int = 0) -> dict[str, Any]:
    """What a command says with --json."""
    assert main([*map(str, words), "--json"]) == code
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert found["exit_code"] == code
    return found


@pytest.mark.parametrize("name", MODULES)
def test_every_command_gives_an_answer(name):
    command = importlib.import_module(f"pipelines.commands.{name}")
    if not hasattr(command, "SUBCOMMANDS"):
        assert typing.get_type_hints(command.run)["return"] is Answer


def test_what_was_found_out(capsys, tmp_path):
    assert told(capsys, "--version")["version"]
    assert told(capsys, "actions", "--model", "cmu")["actions"][:2] == ["Walk", "Wash"]
    assert told(capsys, "cache", "--cache", tmp_path / "store")["store"] == str(tmp_path / "store")
    out = tmp_path / "walk.bvh"
    found = told(capsys, "motion", "--action", "Walk", "--frames", "8", "--count", "2", "--out", out)
    assert found["command"] == "motion"
    assert [Path(path).name for path in found["files"]] == ["walk_000.bvh", "walk_001.bvh"]
    assert all(Path(path).exists() for path in found["files"])
    assert (found["frames"], found["action"]) == (8, "Walk")
    assert main(["--json", "dag", "--out", str(tmp_path / "dag.dot")]) == 0  # before the command as well
    assert json.loads(capsys.readouterr().out)["files"] == [str(tmp_path / "dag.dot")]


def test_failures_are_objects_too(capsys, tmp_path):
    assert "did you mean video?" in told(capsys, "vidoe", code=2)["error"]
    found = told(capsys, "motion", "--action", "Qwxz", "--out", tmp_path / "w.npz", code=2)
    assert found["command"] == "motion"
    assert "Qwxz" in found["error"]
    assert told(capsys, "train", "flow", "--dataset", "cmu", code=2)["command"] == "train flow"
    told(capsys, code=2)
    told(capsys, "train", code=2)


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (ZeroDivisionError("a bug"), 1), (OSError(28, "full", "f"), 2)])
def test_exit_codes(capsys, monkeypatch, error, code):
    def run(_: object) -> Answer:
        raise error

    monkeypatch.setattr("pipelines.commands.dag.run", run)
    if code == 1:  # with its traceback
        with pytest.raises(ZeroDivisionError):
            main(["dag", "--json"])
    else:
        assert main(["dag", "--json"]) == code
    assert json.loads(capsys.readouterr().out)["exit_code"] == code


def test_help_stays_text_and_a_file_cannot_ask_for_json(capsys, tmp_path):
    with pytest.raises(SystemExit):
        main(["dag", "--json", "--help"])
    assert "examples:" in capsys.readouterr().out
    (tmp_path / "c.yaml").write_text("json: true\n")
    assert "--json" in told(capsys, "dag", "--config", tmp_path / "c.yaml", code=2)["error"]


def test_what_libraries_print_stays_out():
    code = (
        "import os, sys, pipelines.commands.actions as c; real = c.run\n"
        "def run(o): print('stray'); os.write(1, b'noise\\n'); return real(o)\n"
        "c.run = run; sys.argv[1:] = ['actions', '--json']; from pipelines.cli import main; sys.exit(main())"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, env=dict(os.environ), check=True)
    assert "Walk" in json.loads(done.stdout)["actions"]
    assert "stray" in done.stderr
    assert "noise" in done.stderr


def test_numbers_that_json_has_not():
    import numpy as np

    assert plain({"a": float("nan"), "b": np.int64(3), "c": np.float32(0.5), "d": (Path("x"), True)}) == {
        "a": None,
        "b": 3,
        "c": 0.5,
        "d": ["x", True],
    }
