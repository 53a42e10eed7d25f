"""`scripts/setup.sh`: one line a step, everything else in a log; versions with hashes for uv."""

from __future__ import annotations

import functools
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import psutil
import pytest

from scripts.requirements import locked, requirements

ROOT = Path(__file__).resolve().parents[1]


def script_of(folder: Path, *lines: str) -> Path:
    """Write steps with the functions of the script, in a folder of their own."""
    text = (ROOT / "scripts" / "setup.sh").read_text(encoding="utf-8")
    head = text[: text.index("# A stamp inside .venv")]
    (folder / "scripts").mkdir()
    (folder / ".a2v").mkdir()
    shutil.copy(ROOT / "constraints.txt", folder)
    script = folder / "scripts" / "setup.sh"
    script.write_text("\n".join([head.replace("pause=10", "pause=1"), *lines, ""]))
    return script


def steps(folder: Path, *lines: str) -> subprocess.CompletedProcess[str]:
    """Run steps."""
    command = ["bash", str(script_of(folder, *lines))]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def test_a_step_is_one_line_with_its_share_and_seconds(tmp_path: Path) -> None:
    loud = "bash -c 'echo noise; echo more >&2; sleep 2.5'"
    done = steps(tmp_path, f'step "packages" 10 50 {loud}', 'step "a2v" 50 60 true')
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    first, second = done.stderr.splitlines()
    assert re.fullmatch(r"setup: packages( \d+%)+ 50%, \d s", first)
    shares = [int(share) for share in re.findall(r"(\d+)%", first)]
    assert shares == sorted(shares)
    assert 10 <= shares[0] <= 50
    assert re.fullmatch(r"setup: a2v( \d+%)* 60%, \d s", second)
    assert (tmp_path / ".a2v" / "setup.log").read_text().split() == ["noise", "more"]


def test_a_step_that_fails_tells_its_end_and_the_log(tmp_path: Path) -> None:
    bad = """bash -c 'seq 100; echo "no such package"; exit 3'"""
    done = steps(tmp_path, f'step "packages" 10 50 {bad}', 'step "a2v" 50 60 true')
    assert done.returncode == 1
    lines = done.stderr.splitlines()
    assert "no such package" in lines
    assert lines[-1].startswith("setup: packages failed; everything that was printed is in /")
    assert lines[-1].endswith("/.a2v/setup.log")
    assert len(lines) < 8


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_setup_leaves_nothing_running(tmp_path: Path, number: int) -> None:
    waits = 'slow() { echo "$BASHPID" > pid; sleep 60; echo late; }'
    script = script_of(tmp_path, waits, 'step "packages" 10 50 slow')
    listen = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    process = subprocess.Popen(["bash", str(script)], stderr=subprocess.PIPE, preexec_fn=listen)
    deadline = time.monotonic() + 30
    while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text().strip():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    child = psutil.Process(int((tmp_path / "pid").read_text()))
    family = [child, *child.children()]
    process.send_signal(number)
    assert process.wait(30) == 128 + number
    psutil.wait_procs(family, timeout=30)
    assert not [one for one in family if one.is_running() and one.status() != "zombie"]


def test_every_requirement_has_a_locked_version_for_uv() -> None:
    tomllib = pytest.importorskip("tomllib")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = requirements(project, ["dev", "dask"])
    entries = locked(wanted, (ROOT / "constraints.lock").read_text())
    plain = re.compile(r"[\w.-]+")
    names = {plain.match(line)[0].lower().replace("_", "-") for line in wanted}
    assert {plain.match(entry)[0].lower().replace("_", "-") for entry in entries} == names
    for entry in entries:
        assert re.match(r"[\w.-]+==[\w.+]+", entry)
        assert "--hash=sha256:" in entry
