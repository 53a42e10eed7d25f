"""Only `a2v.system` uses what not every system has."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from a2v import system

ROOT = Path(__file__).resolve().parents[1]
HERE = "a2v/system.py"
ALONE = {"export/sample.py"}
"""Files that import nothing of a2v, and so read the umask themselves; Windows has it too."""

MODULES = {
    "fcntl",
    "resource",
    "pwd",
    "grp",
    "termios",
    "tty",
    "pty",
    "syslog",
    "msvcrt",
    "winreg",
    "posix",
    "nt",
}
NAMES = {
    "os": {
        "fork",
        "forkpty",
        "getuid",
        "geteuid",
        "getgid",
        "getegid",
        "getgroups",
        "killpg",
        "setsid",
        "setpgid",
        "getpgid",
        "umask",
        "nice",
        "sched_getaffinity",
        "sched_setaffinity",
        "mkfifo",
        "chown",
        "lchown",
        "sysconf",
        "wait",
        "waitpid",
        "uname",
        "posix_spawn",
        "sendfile",
        "memfd_create",
        "getloadavg",
        "chroot",
        "ttyname",
        "statvfs",
    },
    "signal": {
        "SIGKILL",
        "SIGALRM",
        "SIGHUP",
        "SIGUSR1",
        "SIGUSR2",
        "SIGPIPE",
        "SIGCHLD",
        "SIGQUIT",
        "SIGSTOP",
        "alarm",
        "setitimer",
        "pause",
    },
    "socket": {"AF_UNIX"},
    "multiprocessing": {"set_start_method"},
}
METHODS = {"add_signal_handler", "symlink_to"}
PATHS = ("/proc/", "/dev/shm", "/sys/", "/etc/", "/usr/", "/var/")
WORDS = {"preexec_fn", "pass_fds"}


def found_in(source: str) -> set[str]:
    """What a text of Python uses that not every system has."""
    used = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            used |= {item.name for item in node.names if item.name.split(".")[0] in MODULES}
        elif isinstance(node, ast.ImportFrom) and node.module:
            used |= {node.module} if node.module.split(".")[0] in MODULES else set()
            used |= {
                f"{node.module}.{item.name}"
                for item in node.names
                if item.name in NAMES.get(node.module, ())
            }
        elif isinstance(node, ast.Attribute):
            if isinstance(node.value, ast.Name) and node.attr in NAMES.get(node.value.id, ()):
                used.add(f"{node.value.id}.{node.attr}")
            used |= {node.attr} & METHODS
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and node.value.startswith(PATHS)
        ):
            used.add(node.value)
        elif isinstance(node, ast.keyword) and node.arg in WORDS:
            used.add(node.arg)
        elif isinstance(node, ast.Call) and any(
            isinstance(word, ast.Constant) and word.value in ("forkserver", "fork")
            for word in node.args
        ):
            used.add("get_context")
    return used


def test_only_one_module_knows_the_system() -> None:
    used = {}
    for folder in ("a2v", "pipelines", "export"):
        for path in (ROOT / folder).rglob("*.py"):
            name = path.relative_to(ROOT).as_posix()
            if (
                name != HERE
                and name not in ALONE
                and (found := found_in(path.read_text(encoding="utf-8")))
            ):
                used[name] = found
    assert not used
    assert {"fcntl", "resource", "os.killpg", "/proc/self/status"} <= found_in(
        (ROOT / HERE).read_text(encoding="utf-8")
    )  # it is looked for


def test_it_does_what_it_says(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    path.write_text("x")
    code = f"import os; from a2v.system import lock; print(lock(os.open({str(path)!r}, os.O_RDWR)))"
    first = os.open(path, os.O_RDWR)
    assert system.lock(first)
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert told.stdout.strip() == "False"
    os.close(first)
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert told.stdout.strip() == "True"
    assert system.core_count() >= 1
    before = system.file_mask()
    assert system.file_mask() == before
    with system.peak_memory() as peak:
        block = bytearray(64 << 20)
        assert len(block) == 64 << 20
        assert system.WINDOWS or peak() > 64 << 20


def test_windows_gets_what_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """As far as visible from another system, nothing that Windows lacks is used."""
    monkeypatch.setattr(system.sys, "platform", "win32")
    for name in ("getuid", "getgid", "killpg", "sched_getaffinity"):
        monkeypatch.delattr(os, name, raising=False)
    assert system.user_number() is None
    assert system.is_own_group(5)
    assert system.core_count() >= 1
    system.bound_memory(1)
    ended = []
    monkeypatch.setattr(
        system.subprocess,
        "run",
        lambda words, **_: ended.append(words) or subprocess.CompletedProcess(words, 0),
    )
    system.end_group(7, hard=False)
    system.link_folder(Path("a"), Path("b"))
    assert ended == [["taskkill", "/T", "/F", "/PID", "7"], ["cmd", "/c", "mklink", "/J", "a", "b"]]


@pytest.mark.parametrize(("given", "expected"), [("1", 1), ("3", 3), ("2,1", 2), ("0", 1)])
def test_threads_as_the_environment_gives_them(monkeypatch, given, expected):
    monkeypatch.setenv("OMP_NUM_THREADS", given)
    assert system.thread_count() == expected


@pytest.mark.parametrize("given", ["", "many"])
def test_threads_without_a_number_are_the_cores(monkeypatch, given):
    monkeypatch.setenv("OMP_NUM_THREADS", given)
    assert system.thread_count() == system.core_count()
