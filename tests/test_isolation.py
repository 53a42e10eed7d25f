"""A whole `a2v video` in a folder of traps: what it executes, opens and writes."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from a2v.io import cache_folders
from tests.support.traps import set_traps

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = Path(sys.executable).with_name("a2v")


@dataclass
class Watched:
    """Results of a run: its folders, executed traps, and every system call about sockets."""

    home: Path
    temporary: Path
    here: Path
    marks: Path
    calls: str | None
    done: subprocess.CompletedProcess[str]
    before: set[Path]


def strace_works() -> bool:
    return (
        shutil.which("strace") is not None
        and subprocess.run(
            ["strace", "-qq", "-o", os.devnull, "true"], capture_output=True
        ).returncode
        == 0
    )


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


def installed_here() -> bool:
    """Whether the command ``a2v`` beside this interpreter runs this checkout."""
    code = "import pipelines; print(pipelines.__file__)"
    found = subprocess.run(
        [sys.executable, "-I", "-c", code], capture_output=True, text=True
    ).stdout.strip()
    return PROGRAM.exists() and found == str(ROOT / "pipelines" / "__init__.py")


@pytest.fixture(scope="module")
def watched(tmp_path_factory) -> Watched:
    if not installed_here():
        pytest.skip(
            "the command a2v of this environment is not that of this checkout; run: pip install -e "
            "."
        )
    base = tmp_path_factory.mktemp("isolation")
    set_traps(base / "here", base / "marks")
    clean = environment(base)
    before = set(base.rglob("*"))
    words = [
        "video",
        "--photo",
        ROOT / "a2v" / "samples" / "person.jpg",
        "--action",
        "Walk",
        "--out",
        "out",
        "--frames",
        2,
        "--views",
        "front",
    ]
    command = [str(PROGRAM), *map(str, [*words, "--size", 64, "--spp", 1, "--workers", 2])]
    trace = base / "trace"
    traced = strace_works()
    if traced:
        command = [
            "strace",
            "-f",
            "--seccomp-bpf",
            "-qq",
            "-o",
            str(trace),
            "-e",
            "trace=%network",
            *command,
        ]
    done = subprocess.run(
        command, cwd=base / "here", env=clean, capture_output=True, text=True, timeout=600
    )
    return Watched(
        base / "home",
        base / "temporary",
        base / "here",
        base / "marks",
        trace.read_text(errors="replace") if traced else None,
        done,
        before,
    )


@pytest.mark.slow
def test_nothing_of_the_working_folder_is_executed(watched):
    assert not watched.marks.exists(), watched.marks.read_text()
    assert watched.done.returncode == 0, watched.done.stderr
    assert (watched.here / "out" / "video.mp4").is_file()


@pytest.mark.slow
def test_no_socket_but_local_ones(watched):
    """A library may test for IPv6 by binding to ::1; nothing is looked up, connected to or sent."""
    if watched.calls is None:
        pytest.skip("strace is not installed, or may not trace here")
    calls = re.findall(r"^\d+ +(\w+)\((.*)$", watched.calls, re.MULTILINE)
    assert any(
        name == "socket" and "AF_UNIX" in rest for name, rest in calls
    )  # the watch works: the fork server has one
    abroad = [
        f"{name}({rest}"
        for name, rest in calls
        if "AF_INET" in rest and name not in ("socket", "bind", "getsockname")
    ]
    bound = [
        rest
        for name, rest in calls
        if name == "bind" and "AF_INET" in rest and not re.search(r'"::1"|"127\.0\.0\.1"', rest)
    ]
    datagrams = [
        rest
        for name, rest in calls
        if name == "socket" and "AF_INET" in rest and "SOCK_DGRAM" in rest
    ]
    assert abroad == bound == datagrams == []


@pytest.mark.slow
def test_nothing_is_written_outside_of_out_the_store_and_temporary_files(watched):
    new = {
        path for path in (*watched.home.rglob("*"), *watched.here.rglob("*")) if path.is_file()
    } - watched.before
    allowed = (watched.home / ".cache" / "a2v", watched.here / "out")
    assert [
        path for path in new if not any(path.is_relative_to(folder) for folder in allowed)
    ] == []
    left = [path for path in watched.temporary.rglob("*") if path.is_file()]
    assert left == []


@pytest.mark.parametrize(
    "words",
    [
        ["actions", "--model", "cmu"],
        ["motion", "--action", "Walk", "--frames", "4", "--out", "out.bvh"],
        ["cache"],
        ["dag", "--out", "dag.dot"],
    ],
)
def test_other_commands_execute_nothing_of_the_working_folder(tmp_path, words):
    if not installed_here():
        pytest.skip(
            "the command a2v of this environment is not that of this checkout; run: pip install -e "
            "."
        )
    set_traps(tmp_path / "here", tmp_path / "marks")
    done = subprocess.run(
        [PROGRAM, *words],
        cwd=tmp_path / "here",
        env=environment(tmp_path),
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert not (tmp_path / "marks").exists(), (tmp_path / "marks").read_text()
    assert done.returncode == 0, done.stderr


def test_settings_by_which_numba_would_unpickle_from_the_working_folder_are_refused(tmp_path):
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: here\n")
    done = subprocess.run(
        [sys.executable, "-m", "pipelines", "actions"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 2
    assert ".numba_config.yaml" in done.stderr
    assert done.stderr.count("\n") == 1


def test_onnxruntime_is_told_to_report_nothing(tmp_path):
    for code in (
        "import a2v",
        f"import sys; sys.path.insert(0, {str(ROOT / 'export')!r}); import sample; "
        "sample.Model('missing')",
    ):
        clean = {name: value for name, value in os.environ.items() if not name.startswith("ORT_")}
        code = f"import os\ntry: {code}\nexcept Exception: pass\nprint(os.environ.get('ORT_DISABLE_TELEMETRY'))"
        assert (
            subprocess.run(
                [sys.executable, "-c", code], cwd=ROOT, env=clean, capture_output=True, text=True
            ).stdout.strip()
            == "1"
        )
