"""The command ``a2v``: finds the module of the command, runs it, and turns errors into one line and an exit code.

A command is a module of `pipelines.commands` with ``HELP`` (one line), ``EXAMPLES`` (text), ``Options`` (a dataclass, see `pipelines.options`)
and ``run(options) -> int``; only the module that is asked for is imported, so that ``a2v --help`` is quick. ``a2v evaluate reconstruction``
is the module ``evaluate_reconstruction``; a command that only has such parts names them in ``SUBCOMMANDS`` instead of having ``Options``.

Exit codes: 0 done; 1 a defect of a2v (with its traceback); 2 bad input; 130 Ctrl-C; 143 terminated.
"""

from __future__ import annotations

import contextlib
import difflib
import errno
import importlib
import importlib.util
import io
import os
import signal
import sys
import warnings
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import FrameType, ModuleType
from typing import TextIO

from a2v.errors import A2VError, InputError
from a2v.io import printable, shorten, user_cache_folder
from a2v.processes import import_folders, safe_children

COMMANDS = {
    "video": "a photo and an action to a video, a rigged character and its motion",
    "batch": "a table of jobs to videos",
    "motion": "an action to motion files",
    "character": "a photo and several actions to one GLB, USD or web page",
    "reconstruct": "a photo to a rigged, textured 3D character",
    "actions": "list what a motion model can do",
    "evaluate": "measure models as the papers do",
    "train": "train a model",
    "data": "check and describe a data set",
    "studio": "make synthetic photographs to train the reconstruction on",
    "survey": "make a user study, or analyse its answers",
    "dag": "draw the pipeline",
    "cache": "show or trim what is remembered",
}
"""Commands by name, and what they do; one is there when its module is."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not sys.warnoptions and argv is None:  # libraries' warnings are for developers: python -W default shows them
        warnings.simplefilter("ignore")
        os.environ.setdefault("PYTHONWARNINGS", "ignore")  # in worker processes too
    before = signal.signal(signal.SIGTERM, _terminate) if argv is None else None
    try:
        return _run(arguments) if argv is not None else _run_as_program(arguments)
    except A2VError as error:
        return _fail(str(error), 2)
    except KeyboardInterrupt:
        return _fail("interrupted; what was finished is remembered, the same command goes on from there", 130)
    except BrokenPipeError:
        sys.stderr.close()
        return 141
    except OSError as error:
        place = f" ({shorten(str(error.filename))})" if error.filename else ""
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES):
            return _fail(f"cannot write: {error.strerror}{place}; free some space or choose another --out, --cache or TMPDIR", 2)
        if error.filename:
            return _fail(f"{error.strerror}{place}; give another name or folder", 2)
        raise
    finally:
        if before is not None:
            signal.signal(signal.SIGTERM, before)


def _run_as_program(arguments: list[str]) -> int:
    """Run in a process of our own: nothing in the working folder is executed, here or in children, and caches stay with ours."""
    sys.path[:] = import_folders()
    if Path(".numba_config.yaml").exists():  # it may name the folder of a cache, and Numba unpickles what is there
        raise InputError(
            "the working folder holds a .numba_config.yaml, by which Numba could run code from there; remove it or start in another folder"
        )
    if folder := user_cache_folder():
        os.environ.setdefault("MPLCONFIGDIR", str(folder / "matplotlib"))
    with safe_children(), contextlib.redirect_stdout(_Printable(sys.stdout)):
        return _run(arguments)


class _Printable(io.TextIOBase):
    """Standard output without what steers a terminal: names of actions, joints and files come from outside."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write the text in its printable form."""
        self._stream.write(printable(text))
        return len(text)

    def flush(self) -> None:
        """Flush what stands behind."""
        self._stream.flush()

    def isatty(self) -> bool:
        """Whether a terminal stands behind."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """The file descriptor."""
        return self._stream.fileno()


def _terminate(number: int, frame: FrameType | None) -> None:
    raise SystemExit(143)


def _fail(message: str, code: int) -> int:
    print(printable(f"a2v: {' '.join(message.split())}"), file=sys.stderr)
    return code


def available() -> dict[str, str]:
    """The commands of this installation and what they do."""
    return {name: text for name, text in COMMANDS.items() if importlib.util.find_spec(f"pipelines.commands.{name}")}


def _run(arguments: list[str]) -> int:
    commands = available()
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(_overview(commands))
        return 0 if arguments else 2
    if arguments[0] in ("-V", "--version"):
        from a2v import __version__

        print(f"a2v {__version__}")
        return 0
    name = arguments[0]
    if name not in commands:
        raise _unknown("command", name, commands)
    own = _own_command(name, arguments[1:])
    command = importlib.import_module(f"pipelines.commands.{own.replace(' ', '_')}")
    rest = arguments[own.count(" ") + 1 :]
    if hasattr(command, "SUBCOMMANDS"):
        return _choose_subcommand(own, command, rest)
    from pipelines.options import parse

    return int(command.run(parse(command.Options, rest, command=own, about=command.HELP, examples=command.EXAMPLES)))


def _own_command(name: str, arguments: Sequence[str]) -> str:
    """The command, or "command what" where what is asked for has options of its own (the module ``command_what``)."""
    what = arguments[0] if arguments else ""
    if what.isidentifier() and importlib.util.find_spec(f"pipelines.commands.{name}_{what}"):
        return f"{name} {what}"
    return name


def _choose_subcommand(name: str, command: ModuleType, arguments: Sequence[str]) -> int:
    """Show what the command consists of; an error if something else was asked for."""
    if arguments and arguments[0] not in ("-h", "--help", "--help-all"):
        raise _unknown(f"a2v {name}", arguments[0], command.SUBCOMMANDS)
    print(f"usage: a2v {name} WHAT [options]        (a2v {name} WHAT --help tells more)\n\n{command.HELP}\n")
    print(f"{_listed(command.SUBCOMMANDS)}\n\n{command.EXAMPLES}")
    if arguments:
        raise SystemExit(0)  # as every command's help ends
    return 2


def _unknown(what: str, name: str, known: Collection[str]) -> InputError:
    near = difflib.get_close_matches(name, known, n=2, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else f"choose from {', '.join(known)}"
    return InputError(f"unknown {what} '{name}'; {hint}")


def _listed(commands: Mapping[str, str]) -> str:
    width = max(map(len, commands))
    return "\n".join(f"  {name:<{width}}  {text}" for name, text in commands.items())


def _overview(commands: Mapping[str, str]) -> str:
    return f"""usage: a2v COMMAND [options]        (a2v COMMAND --help tells more)

From an action's name and one photograph to a video of that person doing the action, in 3D.

{_listed(commands)}

examples:
  a2v actions --model cmu
  a2v video --photo me.jpg --action Walk --out out/walk"""
