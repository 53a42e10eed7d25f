"""Stores with object stores: what is sent, what is fetched, and what is trusted."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import A2VError, InputError, MissingDependencyError
from pipelines.engine import remote
from pipelines.engine.remote import Remote
from pipelines.engine.run import run
from pipelines.engine.store import LostObjectError, Store
from tests.support.numbers import GRAPH, Numbers, Scale, expected

ROOT = Path(__file__).resolve().parents[2]
VIEWS = (10, 20)


@pytest.fixture
def machines(tmp_path: Path, monkeypatch):
    """``machines("a")``: the store as machine "a" sees it, with a folder of its own."""

    def make(name: str, private: tuple[str, ...] = ()) -> Store:
        monkeypatch.setenv("A2V_CACHE", str(tmp_path / name))
        return Store(f"file://{tmp_path}/objects", private)

    return make


def go(store: Store, **options):
    options.setdefault("executor", "serial")
    return run(
        "total", graph=GRAPH, store=store, length=3, scale=Scale(), views=VIEWS, wait=0.0, **options
    )


def test_what_one_machine_made_the_other_has(machines):
    first = go(machines("a"))
    second = go(machines("b"))
    assert all(stats.cached == stats.calls for stats in second.nodes.values())
    assert float(second.get("total", Numbers).values[0]) == expected(3, 2.0, VIEWS)
    assert first.values["total"] == second.values["total"]
    assert not list((first.store.folder.parents[2] / "objects").rglob(".*"))


def test_private_results_stay_where_they_were_made(machines):
    first = go(machines("a", ("square", "cell")))
    second = go(machines("b"))
    assert {name for name, stats in second.nodes.items() if stats.cached < stats.calls} == {
        "square",
        "cell",
    }
    assert first.values["total"] == second.values["total"]
    assert go(machines("a", ("square", "cell"))).nodes["cell"].cached == 6


@pytest.mark.parametrize("damage", ["flip", "truncate", "remove"])
def test_a_damaged_object_is_never_believed_and_made_again(machines, tmp_path, damage):
    first = go(machines("a"))
    ref = first.values["total"]
    path = next((tmp_path / "objects").rglob(f"{ref.digest[2:]}.npz"))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.unlink() if damage == "remove" else path.write_bytes(
        data if damage == "flip" else data[:40]
    )
    store = machines("b")
    with pytest.raises(LostObjectError):
        store.get(ref, Numbers)
    assert go(store).values["total"] == ref
    assert machines("c").get(ref, Numbers).values[0] == expected(3, 2.0, VIEWS)


def test_failures_that_pass_are_waited_out_and_others_told(machines, monkeypatch, tmp_path):
    monkeypatch.setattr(remote, "FIRST_WAIT", 0.001)
    files = Remote(f"file://{tmp_path}/objects")._place[0]
    real, left = type(files).pipe_file, [3]

    def flaky(self, *arguments, **options):
        left[0] -= 1
        if left[0] >= 0:
            raise ConnectionError("503")
        return real(self, *arguments, **options)

    monkeypatch.setattr(type(files), "pipe_file", flaky)
    ref = machines("a").put(Numbers(values=np.arange(3)))
    machines("a").share([ref])
    assert np.array_equal(machines("b").get(ref, Numbers).values, np.arange(3))
    left[0] = 10**6
    other = machines("a").put(Numbers(values=np.arange(4)))
    with pytest.raises(A2VError, match="fails") as caught:
        machines("a").share([other])
    assert "\n" not in str(caught.value)


def test_an_address_that_is_none_is_told():
    with pytest.raises((InputError, MissingDependencyError), match="nonsense"):
        Remote("nonsense://x").exists("y")


def test_stores_travel_to_other_processes(machines):
    import pickle

    store = machines("a", ("cell",))
    again = pickle.loads(pickle.dumps(store))
    assert (again.address, again.private, again.folder) == (
        store.address,
        store.private,
        store.folder,
    )


# --- workers with folders of their own


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture
def dask(tmp_path: Path) -> Iterator[str]:
    """The address of a scheduler with two workers that share neither store nor folder."""
    pytest.importorskip("distributed")
    address = f"tcp://127.0.0.1:{free_port()}"
    code = "import sys; from distributed.cli import {0}; {0}.main(sys.argv[1:])"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    begin = [
        [
            sys.executable,
            "-c",
            code.format("dask_scheduler"),
            "--host",
            address,
            "--no-dashboard",
            "--no-show",
        ]
    ]
    for name in ("w1", "w2"):
        begin.append(
            [
                sys.executable,
                "-c",
                code.format("dask_worker"),
                address,
                "--nthreads",
                "1",
                "--no-dashboard",
                "--no-nanny",
                "--name",
                name,
            ]
        )
    processes = []
    for place, words in enumerate(begin):
        folder = tmp_path / f"machine{place}"
        folder.mkdir()
        processes.append(
            subprocess.Popen(
                words,
                cwd=folder,
                env={**os.environ, "PYTHONPATH": str(ROOT), "A2V_CACHE": str(folder / "cache")},
                **quiet,
            )
        )
    try:
        yield address
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_workers_without_a_shared_folder_give_the_same(machines, dask, tmp_path):
    store = machines("driver")
    outcome = go(store, executor="dask", address=dask)
    assert float(outcome.get("total", Numbers).values[0]) == expected(3, 2.0, VIEWS)
    assert any((tmp_path / f"machine{place}" / "cache").is_dir() for place in (1, 2))
    assert outcome.values["total"] == go(Store(tmp_path / "alone")).values["total"]


def test_a_worker_with_other_code_says_so(tmp_path):
    from pipelines.engine.memo import Bound
    from tests.support import numbers

    with pytest.raises(A2VError, match="other code for 'base'"):
        Bound(numbers.base, Store(tmp_path), "", "0" * 40)(3, Scale())


# --- an S3 server, where one is installed (pip install 'moto[s3,server]' in an environment of its
# own, on the PATH) with a2v[objects]


@pytest.fixture
def s3(monkeypatch) -> Iterator[str]:
    pytest.importorskip("obstore", reason="needs a2v[objects]")
    server = shutil.which("moto_server")
    if server is None:
        pytest.skip("needs moto_server on the PATH")
    port = free_port()
    process = subprocess.Popen(
        [server, "-H", "127.0.0.1", "-p", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    for name, value in {
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
        "AWS_ALLOW_HTTP": "true",
        "AWS_ACCESS_KEY_ID": "x",
        "AWS_SECRET_ACCESS_KEY": "y",
        "AWS_REGION": "us-east-1",
    }.items():
        monkeypatch.setenv(name, value)
    try:
        import urllib.request

        for _ in range(100):
            try:
                urllib.request.urlopen(
                    urllib.request.Request(f"http://127.0.0.1:{port}/bucket", method="PUT"),
                    timeout=5,
                ).close()
                break
            except OSError:
                time.sleep(0.2)
        yield "s3://bucket/a2v"
    finally:
        process.kill()
        process.wait()


def test_s3_keeps_what_machines_share(s3, tmp_path, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(tmp_path / "a"))
    first = go(Store(s3))
    monkeypatch.setenv("A2V_CACHE", str(tmp_path / "b"))
    second = go(Store(s3))
    assert all(stats.cached == stats.calls for stats in second.nodes.values())
    assert second.get("total", Numbers).values[0] == expected(3, 2.0, VIEWS)
    assert first.values["total"] == second.values["total"]
