"""A whole `a2v video` in a folder of traps: what it executes, opens and writes."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

from tests.support.traps import set_traps
from tests.support.whole_run import (
    PROGRAM,
    ROOT,
    WholeRun,
    environment,
    installed_here,
    whole_run,
)


@pytest.fixture(scope="module")
def watched() -> WholeRun:
    if not installed_here():
        pytest.skip(
            "the command a2v of this environment is not that of this checkout; run: pip install -e "
            "."
        )
    return whole_run()


@pytest.mark.slow
def test_nothing_of_the_working_folder_is_executed(watched):
    assert not watched.marks.exists(), watched.marks.read_text()
    assert watched.done.returncode == 0, watched.done.stderr
    assert (watched.out / "video.mp4").is_file()


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
    allowed = (watched.store, watched.out)
    new = watched.files("home") | watched.files("here")
    assert [
        path for path in new if not any(path.is_relative_to(folder) for folder in allowed)
    ] == []
    assert new
    assert not watched.files("temporary")


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
