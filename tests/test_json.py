"""``--json`` prints one object for success and failure of every command; and the exit codes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import typing
from pathlib import Path
from typing import Any

import pytest

from pipelines.answer import Answer, plain
from pipelines.cli import every_command, load_command, main
from pipelines.options import actions_of

ROOT = Path(__file__).resolve().parents[1]
MODULES = [name.replace(" ", "_") for name in every_command()]
COMMANDS = [name for name in MODULES if not hasattr(load_command(name), "SUBCOMMANDS")]
LEARNING = ("--dataset cmu --data text --out runs", "--dataset nothing --data text --out runs")
REFUSED = {
    "actions": ("--model nothing",),
    "batch": ("none.csv --out out", "text --out out"),
    "cache": ("--trim lots",),
    "character": (
        "--photo none.jpg --actions Walk --out c.glb",
        "--photo text --actions Walk --out c.xyz",
    ),
    "compare": (
        "--photo none.jpg --action Walk --out c.html",
        "--photo none.jpg --action Walk --methods magic --out c.html",
    ),
    "completion": ("tcsh",),
    "dag": ("--out dag.docx",),
    "data": ("cmu --data text", "nothing --data text"),
    "doctor": ("--cache text/below",),
    "evaluate": (
        "--dataset cmu --data text --model cmu --out t.md",
        "--dataset cmu --data text --model cmu --out t.docx",
        "--dataset cmu --data text --protocol actor --actions Walk --out t.md",
        "--dataset cmu --data text --labels each --out t.md",
    ),
    "evaluate_clips": (
        "--data none --out t.md",
        "--data text --out t.md",
        "--data text --films 0 --out t.md",
    ),
    "evaluate_moved": (
        "--data none --out t.md",
        "--data text --out t.md",
        "--data text --photos 0 --out t.md",
    ),
    "evaluate_photos": (
        "none --out o",
        "text --out o",
        ". --grades text --out o",
    ),
    "evaluate_reconstruction": (
        "--data text --studio none --out t.md",
        "--data text --studio none --methods magic --out t.md",
    ),
    "motion": (
        "--action Walk --out w.xyz",
        "--action Qwxz --out w.npz",
        "--action Walk --path none.csv --out w.npz",
        "--page p.html",
        "--from-video text --out w.npz",
    ),
    "motion-page": ("--out p.txt", "--out p.html --model nothing"),
    "follow": (
        "--video none.mp4 --out w.npz",
        "--video text --out w.npz",
        "--video . --out w",
    ),
    "sample": (
        "--action Walk --native --out w.bvh",
        "--action Walk --start none.npz --out w.npz",
        "--action Walk,Bow --interpolate 3 --out w.npz",
    ),
    "reconstruct": (
        "--photo none.jpg --out r.glb",
        "--photo text --out r.glb",
        "--photo text --out r.stl",
    ),
    "retarget": (
        "--character none.glb --action Walk --out w.glb",
        "--character text --action Walk --out w.glb",
        "--character none.fbx --action Walk --out w.fbx",
        "--character none.glb --out w.glb",
        "--character none.vrm --action Walk --out w.glb",
    ),
    "serve": ("--port 70000", "--workers 0", "--folder text"),
    "studio": ("--data text --out views --training 1",),
    "survey": ("", "--model nothing --out s.html", "--analyze text --key none.json --out r.md"),
    "train_baseline": (*LEARNING, "--name magic --dataset cmu --data text --out runs"),
    "train_classifier": LEARNING,
    "train_bodymap": ("--data text --out runs", "--data text --out runs --studio.people nobody"),
    "train_flow": LEARNING,
    "train_motion": LEARNING,
    "train_reconstruction": ("--data text --out runs",),
    "video": (
        "--photo none.jpg --action Walk --out out",
        "--photo text --action Walk --out out",
        "--photo text --motion none.bvh --out out",
    ),
}
"""Arguments that each command refuses, in a folder that holds a file `text`."""


@pytest.fixture(autouse=True)
def _own_store(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(tmp_path_factory.mktemp("cache")))


def told(capsys, *words: object, code: int = 0) -> dict[str, Any]:
    """Return the output of a command with --json."""
    assert main([*map(str, words), "--json"]) == code
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert found["exit_code"] == code
    return found


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_gives_an_answer(name):
    command = load_command(name)
    assert typing.get_type_hints(command.run)["return"] is Answer
    known = {
        spelling for action in actions_of(command.Options) for spelling in action.option_strings
    }
    assert "--json" in known


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_fails_in_one_object(name, capsys, tmp_path, monkeypatch):
    """An option that there is none of, and each thing that the command itself refuses: exit code 2,
    its name and a sentence."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text").write_text("no folder, no picture\n")
    words = name.split("_")
    for wrong in (
        [*words, "--no-such-option"],
        *([*words, *line.split()] for line in REFUSED[name]),
    ):
        found = told(capsys, *wrong, code=2)
        assert found["command"] == " ".join(words), wrong
        assert len(found["error"]) > 20, wrong
        assert "\n" not in found["error"], wrong


def test_what_was_found_out(capsys, tmp_path):
    assert told(capsys, "--version")["version"]
    assert told(capsys, "actions", "--model", "cmu")["actions"][:2] == ["Walk", "Wash"]
    assert told(capsys, "cache", "--cache", tmp_path / "store")["store"] == str(tmp_path / "store")
    out = tmp_path / "walk.bvh"
    found = told(
        capsys, "motion", "--action", "Walk", "--frames", "8", "--count", "2", "--out", out
    )
    assert found["command"] == "motion"
    assert [Path(path).name for path in found["files"]] == ["walk_000.bvh", "walk_001.bvh"]
    assert all(Path(path).exists() for path in found["files"])
    assert (found["frames"], found["action"]) == (8, "Walk")
    assert (
        main(["--json", "dag", "--out", str(tmp_path / "dag.dot")]) == 0
    )  # before the command as well
    assert json.loads(capsys.readouterr().out)["files"] == [str(tmp_path / "dag.dot")]


def test_failures_are_objects_too(capsys, tmp_path):
    assert "did you mean video?" in told(capsys, "vidoe", code=2)["error"]
    found = told(capsys, "motion", "--action", "Qwxz", "--out", tmp_path / "w.npz", code=2)
    assert found["command"] == "motion"
    assert "Qwxz" in found["error"]
    assert told(capsys, "train", "flow", "--dataset", "cmu", code=2)["command"] == "train flow"
    assert "--help" in told(capsys, code=2)["error"]
    assert "flow" in told(capsys, "train", code=2)["error"]


@pytest.mark.parametrize(
    ("error", "code"),
    [(KeyboardInterrupt(), 130), (ZeroDivisionError("a bug"), 1), (OSError(28, "full", "f"), 2)],
)
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


def test_a_command_that_is_terminated_says_so():
    code = (
        "import os, signal, time, pipelines.commands.dag as c\n"
        "c.run = lambda options: (os.kill(os.getpid(), signal.SIGTERM), time.sleep(60))\n"
        "import sys; sys.argv[1:] = ['dag', '--json']; from pipelines.cli import main; "
        "sys.exit(main())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env=dict(os.environ),
        check=False,
    )
    assert done.returncode == 143
    assert json.loads(done.stdout)["exit_code"] == 143


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
        "c.run = run; sys.argv[1:] = ['actions', '--json']; from pipelines.cli import main; "
        "sys.exit(main())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env=dict(os.environ),
        check=True,
    )
    assert "Walk" in json.loads(done.stdout)["actions"]
    assert "stray" in done.stderr
    assert "noise" in done.stderr


def test_numbers_that_json_has_not():
    import numpy as np

    assert plain(
        {"a": float("nan"), "b": np.int64(3), "c": np.float32(0.5), "d": (Path("x"), True)}
    ) == {
        "a": None,
        "b": 3,
        "c": 0.5,
        "d": ["x", True],
    }
