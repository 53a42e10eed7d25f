"""Killed workers and lost schedulers give one line with cause and remedy."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures.process import _ThreadWakeup
from pathlib import Path

import pytest

from a2v.errors import A2VError, InputError
from a2v.io import atomic_path
from pipelines.engine import executors
from pipelines.engine.executors import open_executor
from pipelines.engine.graph import Step
from pipelines.engine.memo import memo
from pipelines.engine.refs import Ref
from pipelines.engine.run import run
from pipelines.engine.store import Store, get
from tests.support.numbers import GRAPH, Numbers, Scale

ROOT = Path(__file__).resolve().parents[2]


@memo()
def doomed(item: Ref[Numbers]) -> Ref[Numbers]:
    """End like a process that ran out of memory."""
    if get(item, Numbers).values[0] >= 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return item


@memo(remember=False)
def slow(item: Ref[Numbers]) -> Ref[Numbers]:
    """Run long enough for a scheduler to die meanwhile."""
    time.sleep(20)
    return item


def go(node, store: Store, executor):
    graph = (*GRAPH[:2], Step(node, node.name, f"item[t] -> {node.name}[t]"))
    return run(
        node.name, graph=graph, store=store, executor=executor, workers=1, length=2, scale=Scale()
    )


def test_a_worker_that_is_killed_every_time_is_explained(tmp_path):
    with pytest.raises(A2VError, match=r"ran out of memory.*fewer --workers") as caught:
        go(doomed, Store(tmp_path), "local")
    assert "\n" not in str(caught.value)


def test_a_worker_of_dask_that_is_killed_every_time_is_explained(tmp_path):
    pytest.importorskip("distributed")
    with pytest.raises(A2VError, match="ran out of memory") as caught:
        go(doomed, Store(tmp_path), "dask")
    assert "\n" not in str(caught.value)


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:{port}", "nonsense://a b", "tcp://nowhere.invalid:80"]
)
def test_an_address_where_no_scheduler_is_takes_one_line(tmp_path, monkeypatch, capfd, address):
    pytest.importorskip("distributed")
    monkeypatch.setattr(executors, "CONNECT_SECONDS", 2.0)
    begun = time.monotonic()
    with (
        pytest.raises(InputError, match="no Dask scheduler answers") as caught,
        open_executor("dask", address=address.format(port=free_port())),
    ):
        pass
    assert "\n" not in str(caught.value)
    assert time.monotonic() - begun < 15
    assert capfd.readouterr().err == ""


def test_a_scheduler_that_dies_is_explained(tmp_path):
    pytest.importorskip("distributed")
    address = f"tcp://127.0.0.1:{free_port()}"
    code = "import sys; from distributed.cli import {0}; {0}.main(sys.argv[1:])"
    begin = {
        "cwd": tmp_path,
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.DEVNULL,
        "env": {**os.environ, "PYTHONPATH": str(ROOT)},
    }
    scheduler = subprocess.Popen(
        [
            sys.executable,
            "-c",
            code.format("dask_scheduler"),
            "--host",
            address,
            "--no-dashboard",
            "--no-show",
        ],
        **begin,
    )
    worker = subprocess.Popen(
        [
            sys.executable,
            "-c",
            code.format("dask_worker"),
            address,
            "--nthreads",
            "1",
            "--no-dashboard",
            "--no-nanny",
        ],
        **begin,
    )
    try:
        threading.Timer(12.0, scheduler.kill).start()
        with (
            pytest.raises(A2VError, match=r"scheduler at .* stopped answering") as caught,
            open_executor("dask", address=address) as executor,
        ):
            go(slow, Store(tmp_path / "store"), executor)
        assert "\n" not in str(caught.value)
    finally:
        for process in (scheduler, worker):
            process.kill()
            process.wait()


def write_for_ever(path: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text("half of it")
        time.sleep(60)


def test_workers_that_are_stopped_leave_nothing_half_written(tmp_path):
    with contextlib.suppress(KeyboardInterrupt), open_executor("local", workers=1) as executor:
        executor.submit(write_for_ever, str(tmp_path / "value.json"))
        while not list(tmp_path.glob(".*")):
            time.sleep(0.05)
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())


def test_no_thread_of_a_stopped_pool_is_left_for_the_interpreters_end(monkeypatch, tmp_path):
    """At its end the interpreter writes to the pipe of a pool's thread, which may be closed."""
    close, before = _ThreadWakeup.close, set(threading.enumerate())

    def slowly(pipe: _ThreadWakeup) -> None:
        time.sleep(0.5)
        close(pipe)

    monkeypatch.setattr(_ThreadWakeup, "close", slowly)
    with contextlib.suppress(KeyboardInterrupt), open_executor("local", workers=1) as executor:
        executor.submit(write_for_ever, str(tmp_path / "value.json"))
        while not list(tmp_path.glob(".*")):
            time.sleep(0.05)
        raise KeyboardInterrupt
    assert not [
        thread
        for thread in threading.enumerate()
        if thread not in before and "Manager" in type(thread).__name__
    ]
