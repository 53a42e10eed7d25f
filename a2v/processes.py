"""Child interpreters that import nothing from the working folder.

``python -c`` and the processes of `multiprocessing` put the working folder in front of the standard
library, so a ``socket.py`` beside somebody's photos would run. Python 3.11 and later leave it out
if PYTHONSAFEPATH is set. On 3.10 the first code of the child removes it.
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
"""Whether this Python version ignores PYTHONSAFEPATH."""


def import_folders() -> list[str]:
    """Return `sys.path` without the working folder, and with the folder of this package even if
    both are the same."""
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
    except OSError:  # a path inside a zip, or a removed working folder
        return False
    return same and not Path(folder).is_relative_to(sysconfig.get_path("stdlib"))


def python_command(code: str, *arguments: str) -> list[str]:
    """Return the command line of a child interpreter that runs `code`.

    It imports from `import_folders` and finds `arguments` in ``sys.argv[1:]``.
    """
    return [sys.executable, "-c", _guarded(code), *arguments]


def _guarded(code: str) -> str:
    return f"import sys; sys.path[:] = {import_folders()!r}\n{code}"


@contextlib.contextmanager
def safe_children() -> Iterator[None]:
    """Keep interpreters that are started in the block from importing from the working folder.

    This includes the workers of `multiprocessing`. A worker takes the parent's `sys.path` before it
    imports the code that it runs.
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
    """Start the fork server of `multiprocessing` if it does not run yet.

    Neither the server nor its workers then import from the working folder.
    """
    if start_method() != "forkserver":
        return
    from multiprocessing import forkserver

    with safe_children():
        forkserver.ensure_running()
