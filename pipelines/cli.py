"""The command ``a2v``: run a subcommand, and turn errors into one line and an exit code.

A command is a module of `pipelines.commands` or `pipelines.lab` with ``HELP`` (one line),
``EXAMPLES`` (text), ``Options`` (a dataclass, see `pipelines.options`) and ``run(options) ->
Answer``. Only the requested module is imported, so that ``a2v --help`` is fast. ``a2v evaluate
reconstruction`` is the module ``evaluate_reconstruction``. A command that only groups such parts
lists them in ``SUBCOMMANDS`` and has no ``Options``.

With ``--json``, standard output is one JSON object, also after a failure (`pipelines.answer`). Text
for people goes to standard error.

Exit codes: 0 done; 1 a defect of a2v (with its traceback); 2 bad input, or something is missing
that the user can add; 130 Ctrl-C; 141 the reader of the output has closed it; 143 terminated.
"""

from __future__ import annotations

import contextlib
import difflib
import errno
import gc
import importlib
import importlib.util
import io
import os
import pkgutil
import signal
import sys
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from types import FrameType, ModuleType
from typing import TYPE_CHECKING, TextIO

from a2v.errors import A2VError, InputError, printable
from a2v.io import say, shorten, user_cache_folder
from a2v.processes import import_folders, safe_children

if TYPE_CHECKING:
    from pipelines.answer import Answer

COMMANDS = {
    "video": "make a video, a rigged character and its motion from a photo and an action",
    "batch": "make the videos of a table of jobs",
    "motion": "generate motion files from an action",
    "follow": "make motion files from the person in a video",
    "motion-page": "write a page that generates motions in the browser",
    "sample": "sample one motion model, for research",
    "character": "make one character file with several actions from a photo",
    "retarget": "add actions to your own character file",
    "reconstruct": "make a rigged, textured 3D character from a photo",
    "serve": "open a page in the browser that makes videos from photos",
    "actions": "list the actions that can be generated",
    "evaluate": "measure models by the protocols of the papers",
    "train": "train a model",
    "data": "check and describe a motion data set",
    "studio": "render synthetic photographs for training the reconstruction",
    "compare": "compare several methods on one photo and motion",
    "survey": "make a user study or analyze its answers",
    "dag": "draw the pipeline",
    "cache": "show or trim the store of cached results",
    "doctor": "check what works on this machine",
    "completion": "print a completion script for a shell",
}
"""Commands by name, with a short description; a command is listed only if its module exists."""
ROOMS = (f"{__package__}.commands", f"{__package__}.lab")
"""Packages with the modules of commands: those of the product and those of the laboratory."""


JSON = "--json"
"""Option that requests one JSON object, anywhere after ``a2v``."""
TERMINATED = 143
"""The exit code after SIGTERM."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return the exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    as_json = JSON in arguments and not {"-h", "--help", "--help-all", "--help-lab"} & set(
        arguments
    )
    arguments = [argument for argument in arguments if argument != JSON]
    if (
        not sys.warnoptions and argv is None
    ):  # Warnings of libraries are for developers; python -W default shows them.
        warnings.simplefilter("ignore")
        os.environ.setdefault("PYTHONWARNINGS", "ignore")  # Also in worker processes.
    before = signal.signal(signal.SIGTERM, _terminate) if argv is None else None
    try:
        with _only_json(whole=argv is None) if as_json else contextlib.nullcontext():
            answer = _run(arguments) if argv is not None else _run_as_program(arguments)
        _say(answer, arguments, as_json)
        return answer.code
    except BrokenPipeError:
        sys.stderr.close()
        return 141
    except SystemExit as end:
        if as_json and end.code == TERMINATED:
            print(
                _failure(
                    arguments,
                    "terminated; what was finished is remembered, the same command goes on from "
                    "there",
                    TERMINATED,
                )
            )
        raise
    except (Exception, KeyboardInterrupt) as error:
        if told := _sentence(error):
            return _fail(*told, arguments, as_json)
        if as_json:
            print(_failure(arguments, f"a defect of a2v: {type(error).__name__}: {error}", 1))
        raise
    finally:
        if before is not None:
            signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def _only_json(*, whole: bool) -> Iterator[None]:
    """Send the output of the block to standard error.

    If this is the `whole` program, the output of libraries and child processes is included.
    """
    if not whole:
        with contextlib.redirect_stdout(sys.stderr):
            yield
        return
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)


def _say(answer: Answer, arguments: Sequence[str], as_json: bool) -> None:
    for text in answer.notes:
        say(f"note: {text}")
    text = answer.as_json(_command_name(arguments)) if as_json else printable(answer.for_people())
    if text:
        print(text)


def _sentence(error: BaseException) -> tuple[str, int] | None:
    """Return the message and the exit code of an error that the user can fix; None for a defect."""
    if isinstance(error, A2VError):
        return str(error), 2
    if isinstance(error, KeyboardInterrupt):
        return (
            "interrupted; finished results are kept; the same command resumes",
            130,
        )
    if not isinstance(error, OSError):
        return None
    place = f" ({shorten(str(error.filename))})" if error.filename else ""
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES):
        return (
            f"cannot write: {error.strerror}{place}; free some space or choose another --out, "
            "--cache or TMPDIR",
            2,
        )
    return (f"{error.strerror}{place}; give another name or folder", 2) if error.filename else None


def _run_as_program(arguments: list[str]) -> Answer:
    """Set up a program of its own: it and its children run no code of the working folder.

    Files that this process creates belong to its user.
    """
    sys.path[:] = import_folders()
    for stream in (
        sys.stdout,
        sys.stderr,
    ):  # Characters that the terminal's encoding lacks are written as escapes.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        Path.cwd()
    except OSError as error:  # Libraries would end the process.
        raise InputError(
            f"the working folder cannot be used ({error.strerror}); change to one that exists"
        ) from None
    if Path(
        ".numba_config.yaml"
    ).exists():  # It may name the folder of a cache, and Numba unpickles what it finds there.
        raise InputError(
            "the working folder holds a .numba_config.yaml, by which Numba could run code from "
            "there; remove it or start in another folder"
        )
    if folder := user_cache_folder():
        os.environ.setdefault("MPLCONFIGDIR", str(folder / "matplotlib"))
    with safe_children(), contextlib.redirect_stdout(_Printable(sys.stdout)):
        try:
            return _run(arguments)
        finally:
            # The interpreter's end does not search the objects of all libraries for cycles.
            gc.freeze()


class _Printable(io.TextIOBase):
    """Standard output without terminal control codes.

    Names of actions, joints and files come from outside.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write the text with unprintable characters escaped."""
        self._stream.write(printable(text))
        return len(text)

    def flush(self) -> None:
        """Flush the wrapped stream."""
        self._stream.flush()

    def isatty(self) -> bool:
        """Return whether the wrapped stream is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Return the file descriptor of the wrapped stream."""
        return self._stream.fileno()


def _terminate(number: int, frame: FrameType | None) -> None:
    raise SystemExit(TERMINATED)


_LONGEST = 1200
"""Maximum number of characters of a message."""


def _fail(message: str, code: int, arguments: Sequence[str], as_json: bool) -> int:
    sentence = printable(" ".join(message.split()))
    if len(sentence) > _LONGEST:  # It begins with the input and ends with the advice.
        sentence = f"{sentence[: _LONGEST // 2]} … {sentence[-_LONGEST // 2 :]}"
    say(f"a2v: {sentence}")
    if as_json:
        print(_failure(arguments, sentence, code))
    return code


def _failure(arguments: Sequence[str], sentence: str, code: int) -> str:
    from pipelines.answer import failure_as_json

    return failure_as_json(_command_name(arguments), sentence, code)


def _command_name(arguments: Sequence[str]) -> str:
    """Return the requested command: "video", "train flow"; empty if there is none."""
    return (
        _own_command(arguments[0], arguments[1:]) if arguments and arguments[0] in COMMANDS else ""
    )


def available() -> dict[str, str]:
    """Return the installed commands and their descriptions."""
    return {name: text for name, text in COMMANDS.items() if module_of(name)}


def file_of(command: str) -> str:
    """Return the name of the file of a command such as "motion-page" or "train flow"."""
    return command.translate(str.maketrans(" -", "__"))


def module_of(command: str) -> str:
    """Return the module of a command such as "video" or "train flow"; "" if there is none."""
    names = (f"{room}.{file_of(command)}" for room in ROOMS)
    return next((name for name in names if importlib.util.find_spec(name)), "")


def every_command() -> tuple[str, ...]:
    """Return all commands, including those of two words such as "train flow"."""
    stems = (
        one.name
        for room in ROOMS
        for one in pkgutil.iter_modules(importlib.import_module(room).__path__)
    )
    whole = {file_of(name): name for name in COMMANDS}
    return tuple(
        sorted(
            whole.get(stem, stem.replace("_", " "))
            for stem in stems
            if stem.partition("_")[0] in COMMANDS
        )
    )


def load_command(command: str) -> ModuleType:
    """Import the module of a command such as "video" or "train flow"."""
    return importlib.import_module(module_of(command))


def _run(arguments: list[str]) -> Answer:
    from pipelines.answer import Answer

    commands = available()
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        return Answer(
            text=_overview(commands),
            code=0 if arguments else 2,
            error="" if arguments else "no command; a2v --help lists them",
        )
    if arguments[0] in ("-V", "--version"):
        from a2v.version import __version__

        return Answer(text=f"a2v {__version__}", facts={"version": __version__})
    name = arguments[0]
    if name not in commands:
        raise _unknown("command", name, commands)
    own = _own_command(name, arguments[1:])
    command = load_command(own)
    rest = arguments[own.count(" ") + 1 :]
    if hasattr(command, "SUBCOMMANDS"):
        return _choose_subcommand(own, command, rest)
    from pipelines.moved import refuse_moved
    from pipelines.options import parse

    if own == "motion":
        refuse_moved(rest)
    answer: Answer = command.run(
        parse(command.Options, rest, command=own, about=command.HELP, examples=command.EXAMPLES)
    )
    return answer


def _own_command(name: str, arguments: Sequence[str]) -> str:
    """Return the name of the command whose options apply.

    That is "name part" if the first argument is a part with a module ``name_part``, such as
    "train flow", and else `name`.
    """
    what = arguments[0] if arguments else ""
    part = f"{name} {what}"
    return part if what.isidentifier() and part in every_command() else name


def _choose_subcommand(name: str, command: ModuleType, arguments: Sequence[str]) -> Answer:
    """Show the parts of the command; refuse any other part."""
    from pipelines.answer import Answer

    if arguments and arguments[0] not in ("-h", "--help", "--help-all", "--help-lab"):
        raise _unknown(f"a2v {name}", arguments[0], command.SUBCOMMANDS)
    usage = (
        f"usage: a2v {name} WHAT [options]        (a2v {name} WHAT --help describes one of them)"
    )
    text = f"{usage}\n\n{command.HELP}\n\n{_listed(command.SUBCOMMANDS)}\n\n{command.EXAMPLES}"
    if arguments:
        print(text)
        raise SystemExit(0)  # as every command's help ends
    return Answer(
        text=text, code=2, error=f"a2v {name} what? choose from {', '.join(command.SUBCOMMANDS)}"
    )


def _unknown(what: str, name: str, known: Collection[str]) -> InputError:
    near = difflib.get_close_matches(name, known, n=2, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else f"choose from {', '.join(known)}"
    return InputError(f"unknown {what} '{name}'; {hint}")


def _listed(commands: Mapping[str, str]) -> str:
    width = max(map(len, commands))
    return "\n".join(f"  {name:<{width}}  {text}" for name, text in commands.items())


def _overview(commands: Mapping[str, str]) -> str:
    return f"""usage: a2v COMMAND [options]        (a2v COMMAND --help describes one command)

Make a 3D video of a person from one photo and the name of an action.

{_listed(commands)}

Every command takes --json: one JSON object on standard output, for scripts. Exit codes: 0 done, 2 bad input, 1 a defect (docs/pipeline.md).

examples:
  a2v actions --model cmu
  a2v video --photo me.jpg --action Walk --out out/walk"""  # noqa: E501
