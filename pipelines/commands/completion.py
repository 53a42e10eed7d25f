"""``a2v completion``: scripts that complete commands and options in a shell."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from pipelines.answer import Answer
from pipelines.cli import available, every_command, load_command
from pipelines.options import actions_of, option

HELP = "Print a script that completes a2v's commands, options and files in a shell."
SHELLS = ("bash", "zsh", "fish")
EXAMPLES = """examples:
  a2v completion bash > ~/.local/share/bash-completion/completions/a2v
  a2v completion zsh > ~/.zfunc/_a2v                 with ~/.zfunc in $fpath, before compinit
  a2v completion fish > ~/.config/fish/completions/a2v.fish"""

FILES = ("photo", "out", "data", "studio", "jobs", "config")
"""Options that take files although their help does not say so."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    shell: str = option("bash, zsh or fish", names=("shell",), choices=SHELLS)


def run(options: Options) -> Answer:
    """Write the script for the shell."""
    import shtab

    script = shtab.complete(command_line(), options.shell)
    return Answer(text=script.rstrip("\n"), facts={"shell": options.shell, "script": script})


def command_line() -> argparse.ArgumentParser:
    """Return all commands with their options as a parser of argparse."""
    parser = argparse.ArgumentParser(prog="a2v")
    parser.add_argument("--version", action="store_true", help="print the version")
    commands = parser.add_subparsers()
    for name, about in available().items():
        command = load_command(name)
        own = commands.add_parser(name, help=_plain(about), description=_plain(about))
        _fill(own, command)
        parts = _parts(name)
        if parts:
            below = own.add_subparsers()
            for part, module in parts.items():
                _fill(
                    below.add_parser(
                        part, help=_plain(module.HELP), description=_plain(module.HELP)
                    ),
                    module,
                )
    return parser


def _parts(name: str) -> Mapping[str, ModuleType]:
    """Return the subcommands of a command (``name part``), keyed by the name of the part."""
    return {
        own.removeprefix(f"{name} "): load_command(own)
        for own in every_command()
        if own.startswith(f"{name} ")
    }


def _fill(parser: argparse.ArgumentParser, command: ModuleType) -> None:
    if hasattr(command, "SUBCOMMANDS"):
        return
    for action in actions_of(command.Options):
        how: dict[str, Any] = {"help": _plain(action.help or "")}
        if action.nargs == 0:
            how["action"] = "store_true"
        elif action.choices is not None:
            how["choices"] = list(action.choices)
        elif not action.option_strings:
            how["nargs"] = action.nargs
        added = parser.add_argument(*(action.option_strings or [action.dest]), **how)
        if action.nargs != 0 and action.choices is None:
            _complete_paths(added, str(action.metavar or ""))


def _complete_paths(action: argparse.Action, metavar: str) -> None:
    """Complete files and folders for the options that take them."""
    import shtab

    if metavar == "FOLDER":
        action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]  # where shtab looks for it
    elif metavar == "FILE" or action.dest in FILES:
        action.complete = shtab.FILE  # type: ignore[attr-defined]


def _plain(text: str) -> str:
    return text.replace("%", "%%")
