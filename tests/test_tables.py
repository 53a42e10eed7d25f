"""The commands that `make tables` lists exist with their options, models and data sets."""

from __future__ import annotations

import itertools
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from a2v.errors import A2VError
from a2v.motion.model import BUNDLED
from scripts.make_tables import TABLES, TRAININGS
from tests.support.commands import parsed

ROOT = Path(__file__).resolve().parents[1]


def listed(*options: str) -> list[list[str]]:
    """The words of every listed command after "a2v"."""
    done = subprocess.run(
        [sys.executable, "scripts/make_tables.py", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return [shlex.split(line)[1:] for line in done.stdout.splitlines() if line.startswith("a2v ")]


def after(words: list[str], option: str) -> list[str]:
    return [value for name, value in itertools.pairwise(words) if name == option]


def test_every_table_is_listed_and_can_be_made() -> None:
    commands = listed()
    assert len(commands) == len(TABLES)
    for words in commands:
        parsed(words)
        assert set(after(words, "--model")) <= set(BUNDLED)
        (out,) = after(words, "--out")
        assert (ROOT / "docs" / "results" / f"motion_{Path(out).stem}.md").is_file()


def test_every_training_is_listed_and_can_begin() -> None:
    commands = listed("--trainings")
    assert len(commands) == len(TRAININGS)
    for words in commands:
        parsed(words)
    outs = [out for words in commands for out in after(words, "--out")]
    assert len(set(outs)) == len(commands)
    for at, words in enumerate(commands):  # each begins with weights that were trained before
        assert {Path(path).parent.as_posix() for path in after(words, "--initial")} <= set(
            outs[:at]
        )
    vaes = {name for name in BUNDLED if name.endswith(("-plain", "-lie", "-glmi-m", "-glmi-r"))}
    assert len(vaes) == 12
    assert vaes <= {Path(out).name for out in outs}


@pytest.mark.parametrize("more", [["--only", "cmu", "--model", "mine.onnx"], ["--clips", "500"]])
def test_options_reach_the_commands(more: list[str]) -> None:
    (words, *_) = listed(*more)
    assert after(words, more[-2])[-1] == more[-1]
    parsed(words)


def test_an_option_that_does_not_exist_is_found() -> None:
    with pytest.raises((A2VError, SystemExit)):
        parsed([*listed()[0], "--no-such-option", "1"])
