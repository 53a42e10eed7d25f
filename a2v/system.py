"""Differences between Linux, macOS and Windows, all in this module; a test checks that.

Only Linux was tested. Each function documents its behavior on systems without the feature.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

WINDOWS = sys.platform == "win32"
"""Whether this is Windows."""


def lock(handle: int) -> bool:
    """Lock an open file until it is closed or the process ends; False if another process has locked
    it.

    On Windows the first byte of the file is locked.
    """
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def user_number() -> int | None:
    """Return the user's number; None on Windows."""
    return None if sys.platform == "win32" else os.getuid()


def is_own_group(number: int) -> bool:
    """Return whether a group is root's, or the private group that many systems give each user.

    True on Windows, which has no such groups.
    """
    if sys.platform == "win32":
        return True
    import grp
    import pwd

    if number == 0 or number != os.getgid():
        return number == 0
    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.getuid()).pw_name
    except KeyError:  # a number without a name, as in containers
        return True
    return group.gr_name == user and set(group.gr_mem) <= {user}


def file_mask() -> int:
    """Return the process's umask. It can only be read by setting it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def keep_files_private() -> None:
    """Make the files that the process creates from now on private to the user. On Windows the
    folder's rights decide."""
    os.umask(0o077)


def link_folder(link: Path, folder: Path) -> None:
    """Make `link` another name of a folder. On Windows it is a junction, which needs no
    administrator rights."""
    if sys.platform == "win32":
        subprocess.run(
            ["cmd", "/c", "mklink", "/J", str(link), str(folder)], check=True, capture_output=True
        )
    else:
        link.symlink_to(folder, target_is_directory=True)


def core_count() -> int:
    """Return the number of processor cores that this process may use, or the machine's if the
    system does not report it."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def thread_count() -> int:
    """Return the number of threads for native code: OMP_NUM_THREADS if it is set, else
    `core_count`.

    Worker processes are started with OMP_NUM_THREADS=1.
    """
    given = os.environ.get("OMP_NUM_THREADS", "").split(",")[0].strip()
    return max(1, int(given)) if given.isdigit() else core_count()


def start_method() -> str:
    """Return the start method of worker processes: the fork server, or "spawn" where there is none
    (Windows)."""
    return "spawn" if WINDOWS else "forkserver"


def bound_memory(size: int) -> None:
    """Limit the address space of this process to `size` bytes; no effect on Windows.

    Programs that it starts have the same limit, or that of `without_bound`.
    """
    if sys.platform != "win32":
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_AS)
        if most == resource.RLIM_INFINITY or most > size:
            with (
                contextlib.suppress(ValueError, OSError)
                if sys.platform == "darwin"
                else contextlib.nullcontext()
            ):  # macOS may refuse
                resource.setrlimit(resource.RLIMIT_AS, (size, most))


_UNBOUND = (
    "import os, resource as r, sys; most = r.getrlimit(r.RLIMIT_AS)[1]; "
    "r.setrlimit(r.RLIMIT_AS, (most, most)); os.execv(sys.argv[1], sys.argv[1:])"
)


def without_bound(command: Sequence[str]) -> list[str]:
    """Return a command that starts `command`, a program's path and arguments, without the limit of
    `bound_memory`.

    WebAssembly reserves far more addresses than it uses.
    """
    if sys.platform == "win32":
        return [*command]
    import resource

    now, most = resource.getrlimit(resource.RLIMIT_AS)
    return [*command] if now == most else [sys.executable, "-I", "-S", "-c", _UNBOUND, *command]


def end_group(process: int, *, hard: bool) -> None:
    """End a process that was started in its own session, and its child processes.

    Raises
    ------
    ProcessLookupError
        The process has already ended.
    """
    if sys.platform == "win32":
        done = subprocess.run(
            ["taskkill", "/T", "/F", "/PID", str(process)], capture_output=True, check=False
        )
        if done.returncode:
            raise ProcessLookupError(process)
        return
    os.killpg(process, signal.SIGKILL if hard else signal.SIGTERM)


@contextlib.contextmanager
def peak_memory() -> Iterator[Callable[[], int]]:
    """Yield a function that returns the process's highest resident memory, bytes.

    It counts since the call on Linux, and since the process's start elsewhere. It returns 0 on
    Windows, where reading it needs another package.
    """
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text(
            "5", encoding="utf-8"
        )  # Linux: resets the high-water mark

    def peak() -> int:
        try:
            for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
                if line.startswith("VmHWM:"):
                    return int(line.split()[1]) * 1024
        except OSError:
            pass
        if sys.platform == "win32":
            return 0
        import resource

        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return used if sys.platform == "darwin" else used * 1024

    yield peak
