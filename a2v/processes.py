"""Child interpreters that import nothing from the working folder.

``python -c``, and with it every process that `multiprocessing` starts, puts the folder in which it
begins before the standard library: a ``socket.py`` beside somebody's photos would run. Python 3.11
and later leave it out where PYTHONSAFEPATH is set; on 3.10 the code that the child runs first takes
it away.
"""

from __future__ import annotations

import contextlib
import multiprocessing.util
import os
import sys
import sysconfig
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from a2v.system import start_method

VARIABLE = "PYTHONSAFEPATH"
OLD_PYTHON = sys.version_info[:2] < (3, 11)
"""Whether this Python does not know PYTHONSAFEPATH."""


def import_folders() -> list[str]:
    """`sys.path` without the working folder and with the folder that holds this package, even where
    that is the same."""
    home = str(Path(__file__).resolve().parents[1])
    folders = [
        folder
        for folder in sys.path
        if folder and (folder == home or not _is_working_folder(folder))
    ]
    return folders if home in folders else [*folders, home]


def _is_working_folder(folder: str) -> bool:
    try:
        same = Path(folder).samefile(os.curdir)
    except OSError:  # a zip's inside, or a working folder that was removed
        return False
    return same and not Path(folder).is_relative_to(sysconfig.get_path("stdlib"))


def python_command(code: str, *arguments: str) -> list[str]:
    """Command line of a child interpreter that runs `code`, imports from `import_folders` and finds
    `arguments` in ``sys.argv[1:]``."""
    return [sys.executable, "-c", _guarded(code), *arguments]


def _guarded(code: str) -> str:
    return f"import sys; sys.path[:] = {import_folders()!r}\n{code}"


@contextlib.contextmanager
def safe_children() -> Iterator[None]:
    """Keep interpreters that are started in the block from importing from the working folder.

    This includes the workers of `multiprocessing`.

    A worker of `multiprocessing` takes over the parent's `sys.path` before it imports what it is to
    run.
    """
    if OLD_PYTHON:
        start = multiprocessing.util.spawnv_passfds

        def guarded(path: Any, arguments: Sequence[Any], descriptors: Sequence[int]) -> int:
            words = list(arguments)
            code = words.index("-c") + 1
            words[code] = _guarded(words[code])
            return start(path, words, descriptors)

        multiprocessing.util.spawnv_passfds = guarded  # type: ignore[assignment]
        try:
            yield
        finally:
            multiprocessing.util.spawnv_passfds = start
        return
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(VARIABLE, None)
        else:
            os.environ[VARIABLE] = before


def start_fork_server() -> None:
    """Start `multiprocessing`'s fork server, if it does not run yet, so that neither it nor its
    workers import from the working folder."""
    if start_method() != "forkserver":
        return
    from multiprocessing import forkserver

    with safe_children():
        forkserver.ensure_running()
