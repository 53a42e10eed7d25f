"""Child interpreters that import nothing from the working folder.

``python -c`` and the processes of `multiprocessing` put the working folder in front of the standard
library, so a ``socket.py`` beside somebody's photos would run. Python 3.11 and later leave it out
if PYTHONSAFEPATH is set. On 3.10 the first code of the child removes it.

The workers of `worker_context` and of Dask do not import the user's main module either, so that a
script needs no ``if __name__ == "__main__":``. Ray's never do.
"""

from __future__ import annotations

import contextlib
import multiprocessing.context
import multiprocessing.spawn
import multiprocessing.util
import os
import sys
import sysconfig
import threading
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


_plain: Any = multiprocessing.get_context(start_method())
_prepare = multiprocessing.spawn.get_preparation_data
_starting = threading.local()


_DASK = "Dask Worker process"
"""Begin of the names of Dask's workers, which a thread of Dask starts, at any time."""


def _prepare_child(name: str) -> dict[str, Any]:
    """Return what `multiprocessing` tells a new child; a worker gets no main module."""
    data = _prepare(name)
    if getattr(_starting, "worker", False) or name.startswith(_DASK):
        data = {key: value for key, value in data.items() if not key.startswith("init_main_")}
    return data


multiprocessing.spawn.get_preparation_data = _prepare_child


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    """Keep children that this thread starts in the block from importing the main module."""
    _starting.worker = True
    try:
        yield
    finally:
        _starting.worker = False


class Worker(_plain.Process):  # type: ignore[misc]  # its class depends on the system
    """A child process that imports neither from the working folder nor the user's main module."""

    @staticmethod
    def _Popen(process_obj: Any) -> Any:
        with _without_main():
            return _plain.Process._Popen(process_obj)


class _Workers(type(_plain)):  # type: ignore[misc]
    Process = Worker


def worker_context() -> multiprocessing.context.BaseContext:
    """Return the context of `multiprocessing` whose processes are `Worker`.

    Functions for them are found by the module that defines them, which is not ``__main__``.
    """
    start_fork_server()
    context: multiprocessing.context.BaseContext = _Workers()
    return context


def start_fork_server() -> None:
    """Start the fork server of `multiprocessing` if it does not run yet.

    Neither the server nor its workers then import from the working folder.
    """
    if start_method() != "forkserver":
        return
    from multiprocessing import forkserver

    with safe_children(), _without_main():
        forkserver.ensure_running()
