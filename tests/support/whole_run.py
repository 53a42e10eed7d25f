"""One whole ``a2v video`` of the sample photo, from an empty store in a folder of traps.

It takes 45 s of processor time, so all tests of a run share it: those of its files, of what it
executes and writes, and of the person that it makes.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from a2v.io import cache_folders
from a2v.system import lock
from tests.support.traps import set_traps

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"
PROGRAM = Path(sys.executable).with_name("a2v")
FRAMES, VIEWS, SIZE = 3, ("front", "left"), 64
OPTIONS = [
    *("--frames", str(FRAMES), "--views", ",".join(VIEWS), "--size", str(SIZE)),
    *("--spp", "1", "--workers", "2"),
]
"""What makes a video small."""


@dataclass(frozen=True)
class WholeRun:
    """The run's folders; the end of `store` is that of a user's default store."""

    base: Path

    @property
    def here(self) -> Path:
        """The working folder, full of traps."""
        return self.base / "here"

    @property
    def out(self) -> Path:
        return self.here / "out"

    @property
    def store(self) -> Path:
        return self.base / "home" / ".cache" / "a2v"

    @property
    def marks(self) -> Path:
        """The file that executed traps write to."""
        return self.base / "marks"

    @property
    def done(self) -> subprocess.CompletedProcess[str]:
        said = json.loads((self.base / "done.json").read_text())
        return subprocess.CompletedProcess([], said["code"], said["stdout"], said["stderr"])

    @property
    def calls(self) -> str | None:
        """Every system call about sockets; None where they cannot be traced."""
        trace = self.base / "trace"
        return trace.read_text(errors="replace") if trace.exists() else None

    def files(self, folder: str) -> set[Path]:
        """The files in a folder of `base` when the run had ended, but not those from before."""
        said = json.loads((self.base / "done.json").read_text())
        return {self.base / name for name in said["new"] if name.startswith(f"{folder}/")}


@cache
def whole_run() -> WholeRun:
    """Return the run, which is made unless another process of these tests has made it."""
    base = Path(os.environ["A2V_CACHE"]) / "whole"
    with alone(base.with_suffix(".lock")):
        if not (base / "done.json").exists():
            _make(base)
    return WholeRun(base)


def environment(base: Path) -> dict[str, str]:
    """A user with an empty home folder whose store holds nothing but the compiled body model."""
    (base / "home" / ".cache" / "a2v").mkdir(parents=True)
    (base / "temporary").mkdir()
    for file in (
        file for folder in cache_folders() if folder.is_dir() for file in folder.glob("anny-*.npz")
    ):
        shutil.copy(file, base / "home" / ".cache" / "a2v")
    dropped = ("A2V_CACHE", "PYTHON", "XDG_", "MPLCONFIGDIR", "DRJIT_CACHE_DIR", "ORT_", "NUMBA_")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(dropped)}
    return {**kept, "HOME": str(base / "home"), "TMPDIR": str(base / "temporary")}


@cache
def installed_here() -> bool:
    """Whether the command ``a2v`` beside this interpreter runs this checkout."""
    code = "import pipelines; print(pipelines.__file__)"
    found = subprocess.run(
        [sys.executable, "-I", "-c", code], capture_output=True, text=True
    ).stdout.strip()
    return PROGRAM.exists() and found == str(ROOT / "pipelines" / "__init__.py")


def _make(base: Path) -> None:
    shutil.rmtree(base, ignore_errors=True)
    set_traps(base / "here", base / "marks")
    clean = environment(base)
    before = _files(base)
    words = ["video", "--photo", str(SAMPLE), "--action", "Walk", *OPTIONS]
    program = [str(PROGRAM)] if installed_here() else [sys.executable, "-m", "pipelines"]
    traced = ["--seccomp-bpf", "-qq", "-e", "trace=%network", "-o"]
    tracer = ["strace", "-f", *traced, str(base / "trace")] if _strace_works() else []
    done = subprocess.run(
        [*tracer, *program, *words, "--out", str(base / "here" / "out")],
        cwd=base / "here" if installed_here() else ROOT,
        env=clean,
        capture_output=True,
        text=True,
        timeout=600,
    )
    said = {"code": done.returncode, "stdout": done.stdout, "stderr": done.stderr}
    new = sorted(_files(base) - before)
    # the common store knows the person from now on
    shutil.copytree(WholeRun(base).store, os.environ["A2V_CACHE"], dirs_exist_ok=True)
    (base / "done.json").write_text(json.dumps({**said, "new": new}))


def _files(base: Path) -> set[str]:
    return {path.relative_to(base).as_posix() for path in base.rglob("*") if path.is_file()}


def _strace_works() -> bool:
    return (
        shutil.which("strace") is not None
        and subprocess.run(
            ["strace", "-qq", "-o", os.devnull, "true"], capture_output=True
        ).returncode
        == 0
    )


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Let no other process into this block."""
    with path.open("w") as stream:
        while not lock(stream.fileno()):
            time.sleep(0.2)
        yield
