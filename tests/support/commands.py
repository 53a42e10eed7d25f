"""Run commands in this process, or only parse them."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence

import pytest

from a2v.errors import A2VError
from pipelines.cli import load_command, main, module_of
from pipelines.options import parse


def end(words: list[str]) -> None:
    """Run a command in a separate folder; it succeeds or prints one sentence."""
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        code = main(words)
    assert code in (0, 2)
    if code:
        raise A2VError(said.getvalue().strip().split("\n")[-1])


def without_readings(said: str) -> str:
    """Return standard error without the interpretation of an action."""
    return "".join(line for line in said.splitlines(keepends=True) if " is taken for " not in line)


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """Run the command and return its only message; the exit code is 2.

    The interpretation of the action may be printed as well.
    """
    assert main([str(word) for word in words]) == 2
    error = without_readings(capsys.readouterr().err)
    assert error.count("\n") == 1
    return error


def parsed(words: Sequence[str]) -> object:
    """The options of a command by its words after "a2v"; unknown ones end the process (SystemExit)
    or raise an InputError."""
    two = "_".join(words[:2])
    sub = bool(two.isidentifier() and module_of(two))
    command = load_command(two if sub else words[0])
    return parse(
        command.Options,
        list(words[2 if sub else 1 :]),
        command=words[0],
        about=command.HELP,
        examples=command.EXAMPLES,
    )
