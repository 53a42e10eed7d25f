"""The engine on small numeric nodes: caching by content, partial runs, fan-out, resuming."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError, MissingDependencyError
from a2v.system import lock
from pipelines.engine.executors import open_executor
from pipelines.engine.graph import Step, build, downstream_of, inputs_of, needed_for, topological
from pipelines.engine.memo import memo, plain
from pipelines.engine.progress import Update
from pipelines.engine.refs import Ref
from pipelines.engine.run import Outcome, run
from pipelines.engine.store import Store, get, put
from tests.support import numbers
from tests.support.numbers import GRAPH, Numbers, Scale, Words, expected

ROOT = Path(__file__).resolve().parents[2]
VIEWS = (10, 20, 30)


def go(store: Store, target="total", *, length=4, factor=2.0, views=VIEWS, **options) -> Outcome:
    options.setdefault("executor", "serial")
    return run(
        target,
        graph=GRAPH,
        store=store,
        length=length,
        scale=Scale(factor),
        views=views,
        wait=0.0,
        **options,
    )


def computed(outcome: Outcome) -> dict[str, int]:
    """Return how often each node really ran."""
    return {
        name: stats.calls - stats.cached
        for name, stats in outcome.nodes.items()
        if stats.calls > stats.cached
    }


def answer(outcome: Outcome) -> float:
    return float(outcome.get("total", Numbers).values[0])


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "store")


def test_computes_and_then_remembers(store):
    first = go(store)
    assert answer(first) == expected(4, 2.0, VIEWS)
    assert computed(first) == {
        "base": 1,
        "item": 1,
        "square": 4,
        "shift": 1,
        "cell": 12,
        "column": 3,
        "total": 1,
    }
    second = go(store)
    assert computed(second) == {}
    assert second.values["total"] == first.values["total"]
    assert second.nodes["cell"].cached == 12


def test_local_processes_give_the_same(store, tmp_path):
    assert (
        go(store, executor="local", workers=2).values["total"]
        == go(Store(tmp_path / "other")).values["total"]
    )


def test_a_longer_run_keeps_the_finished_frames(store):
    go(store, length=3)
    longer = go(store, length=5)
    assert answer(longer) == expected(5, 2.0, VIEWS)
    assert computed(longer)["cell"] == 2 * len(VIEWS)
    assert computed(longer)["square"] == 2


def test_another_view_costs_only_that_view(store):
    go(store, views=(10, 20))
    assert computed(go(store, views=(20, 40)))["cell"] == 4


def test_equal_content_stops_the_recomputation(store):
    go(store)
    outcome = go(store, factor=-2.0)  # other items, but equal squares from there on
    assert computed(outcome) == {"base": 1, "item": 1, "square": 4}


def test_only_what_the_target_needs_runs(store):
    outcome = go(store, "square")
    assert set(outcome.nodes) == {"base", "item", "square"}
    assert [outcome.store.get(ref, Numbers).values[0] for ref in outcome.values["square"]] == [
        0.0,
        4.0,
        16.0,
        36.0,
    ]


def test_start_computes_a_node_and_what_follows_anew(store):
    go(store)
    assert computed(go(store, start="cell")) == {"cell": 12, "column": 3, "total": 1}
    assert computed(go(store, fresh=["item"])) == {"item": 1}


def test_an_override_replaces_the_steps_that_make_it(store):
    outcome = run(
        "square",
        graph=GRAPH,
        store=store,
        executor="serial",
        overrides={"item": [store.put(Numbers(values=np.array([7.0])))]},
    )
    assert set(outcome.nodes) == {"square"}
    assert outcome.store.get(outcome.values["square"][0], Numbers).values[0] == 49.0


@pytest.mark.parametrize("damage", ["remove", "truncate", "flip"])
def test_a_lost_value_recomputes_only_itself(store, damage):
    go(store)
    path = store.path(go(store).values["cell"][1, 1])  # found intact by this process
    before = path.stat()
    if damage == "remove":
        path.unlink()
    elif damage == "truncate":
        path.write_bytes(path.read_bytes()[:50])
    else:
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 0xFF
        path.write_bytes(bytes(data))
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    outcome = go(store)
    assert answer(outcome) == expected(4, 2.0, VIEWS)
    assert computed(outcome) == {"cell": 1}


def test_a_value_lost_in_the_middle_of_a_run_is_made_again(store):
    go(store)
    taken = []

    def thief(update: Update) -> None:
        if update.node == "item" and not taken:  # the squares were requested just before or after
            for ref in list(first.values["square"]):
                store.path(ref).unlink(missing_ok=True)
            taken.append(True)

    first = go(store, "square")
    outcome = run(
        "total",
        graph=GRAPH,
        store=store,
        executor="serial",
        length=4,
        scale=Scale(),
        views=VIEWS,
        wait=0.1,
        progress=thief,
    )
    assert answer(outcome) == expected(4, 2.0, VIEWS)
    assert taken


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"target": "totl"}, ["totl", "total"]),
        ({"lenght": 3}, ["lenght", "length"]),
        ({"start": "cells"}, ["cells", "cell"]),
        ({"overrides": {"basis": 1}}, ["basis", "base"]),
        ({"executor": "slurm"}, ["slurm", "local"]),
        ({"workers": 0, "executor": "local"}, ["workers", "0"]),
    ],
)
def test_unknown_names_are_rejected_and_the_nearest_named(store, options, words):
    with pytest.raises(InputError) as caught:
        go(store, options.pop("target", "total"), **options)
    assert all(word in str(caught.value) for word in words)


def test_a_missing_parameter_is_named(store):
    with pytest.raises(InputError, match="scale"):
        run("base", graph=GRAPH, store=store, length=3)


def test_an_edge_between_other_types_fails_before_anything_runs(store):
    @memo()
    def wrong(base: Ref[Words]) -> Ref[Words]:
        raise RuntimeError("must not run")

    graph = (GRAPH[0], Step(wrong, "wrong"))
    with pytest.raises(TypeError, match="base"):
        build(graph, store=store)


def test_an_error_in_a_frame_reaches_the_caller(store):
    @memo()
    def broken(item: Ref[Numbers]) -> Ref[Numbers]:
        if get(item, Numbers).values[0] == 4.0:
            raise InputError("frame 2 is bad")
        return item

    graph = (*GRAPH[:2], Step(broken, "broken", "item[t] -> broken[t]"))
    with pytest.raises(InputError) as caught:
        run("broken", graph=graph, store=store, executor="serial", length=4, scale=Scale())
    assert str(caught.value) == "frame 2 is bad"
    assert not getattr(caught.value, "__notes__", [])  # such as the arguments of the node


def test_progress_counts_to_the_end_and_notes_are_kept(store):
    seen: list[Update] = []
    outcome = go(store, progress=seen.append)
    cells = [update for update in seen if update.node == "cell"]
    assert cells[-1].done == cells[-1].total == 12
    assert [update.done for update in cells] == sorted(update.done for update in cells)
    assert outcome.notes == ("numbers are fine",)
    assert go(store).notes == ("numbers are fine",)
    assert (
        go(store).nodes["base"].measures
        == outcome.nodes["base"].measures
        == {"length": 4, "parts": {"factor": 2.0}}
    )
    assert all(stats.peak_memory > 1 << 20 for stats in outcome.nodes.values())
    assert outcome.peak_memory > 1 << 20
    assert not list((store.folder / "runs").iterdir())


def test_graph_helpers():
    assert inputs_of(GRAPH) == ("length", "scale", "views", "wait")
    assert [step.node.name for step in needed_for(GRAPH, ["square"])] == ["base", "item", "square"]
    assert [step.node.name for step in needed_for(GRAPH, ["total"], ["cell"])] == [
        "column",
        "total",
    ]
    assert downstream_of(GRAPH, "shift") == {"shift", "cell", "column", "total"}
    assert topological(GRAPH[::-1])[0].node.name == "base"


# --- keys


def test_keys_see_values_and_not_objects():
    shared = (1.0, 2.0)
    key = numbers.base.key
    assert key("c", (shared, shared), {}) == key("c", ((1.0, 2.0), (1.0, 2.0)), {})
    assert key("c", (3, Scale(1.0)), {}) == key("c", (), {"scale": Scale(1.0), "length": 3})
    assert key("c", (3, Scale(1.0)), {}) != key("c", (3, Scale(1.5)), {})
    assert key("c", (3, Scale(1.0)), {}) != key("d", (3, Scale(1.0)), {})
    array = np.arange(4)
    keys = {
        key("c", (value, 0), {})
        for value in (
            array,
            array.astype(np.float32),
            array.reshape(2, 2),
            array[::-1],
            4,
            "4",
            None,
            True,
            1.0,
        )
    }
    assert len(keys) == 9


def test_keys_refuse_what_has_no_content():
    with pytest.raises(TypeError, match="File"):
        plain(Path("x"))
    with pytest.raises(TypeError, match="generator"):
        plain(i for i in range(3))


def test_files_count_by_their_content(tmp_path):
    from pipelines.engine.refs import File

    for name, text in [("a", "x"), ("b", "x"), ("c", "y")]:
        (tmp_path / name).write_text(text)
    a, b, c = (File.of(tmp_path / name) for name in "abc")
    assert a == b != c
    assert (
        numbers.base.key("c", (a, 0), {})
        == numbers.base.key("c", (b, 0), {})
        != numbers.base.key("c", (c, 0), {})
    )
    (tmp_path / "d").touch()
    with pytest.raises(InputError, match="empty"):
        File.of(tmp_path / "d")
    with pytest.raises(InputError, match="folder"):
        File.of(tmp_path)
    with pytest.raises(InputError, match="larger"):
        File.of(tmp_path / "a", limit=0)


# --- the store


def test_put_names_by_content_and_writes_once(store):
    ref = store.put(Numbers(values=np.arange(3)))
    stamp = store.path(ref).stat().st_ino
    assert store.put(Numbers(values=np.arange(3))) == ref
    assert store.path(ref).stat().st_ino == stamp
    assert store.put(Numbers(values=np.arange(4))) != ref
    assert np.array_equal(store.get(ref, Numbers).values, np.arange(3))
    assert len(ref.digest) == 40
    assert not [path for path in store.folder.rglob("*") if path.name.startswith(".")]


def test_trim_removes_what_was_used_longest_ago(store):
    refs = [store.put(Numbers(values=np.full(1000, i))) for i in range(4)]
    for age, ref in zip((4000, 1000, 3000, 2000), refs, strict=True):
        then = time.time() - age
        os.utime(store.path(ref), (then, then))
    size = store.path(refs[0]).stat().st_size
    assert store.trim(2 * size) == 2 * size
    assert [store.has(ref) for ref in refs] == [False, True, False, True]
    assert store.trim(0) == 0  # `has` has just used the others
    assert store.trim(0, everything=True) == 2 * size


def test_a_read_only_store_is_one_clear_error(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(InputError, match=r"cannot write .*--cache"):
        go(Store(blocked / "store"))


# --- processes


def script(tmp_path: Path, body: str) -> list[str]:
    file = tmp_path / f"job{len(list(tmp_path.glob('job*')))}.py"
    file.write_text("if __name__ == '__main__':\n" + textwrap.indent(textwrap.dedent(body), "    "))
    return [sys.executable, str(file)]


JOB = """
import sys
from pipelines.engine.run import run
from pipelines.engine.store import Store
from tests.support.numbers import *
outcome = run("total", graph=GRAPH, store=Store({store!r}), executor={executor!r}, workers=2, length={length}, scale=Scale(), views=(10, 20, 30), wait={wait})
print(outcome.get("total", Numbers).values[0])
"""


def environment(log: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "A2V_TEST_LOG": str(log)}


def logged(log: Path) -> Counter:
    file = log / "log"
    return Counter(file.read_text().split()) if file.exists() else Counter()


def children(pid: int) -> list[int]:
    import psutil

    return [child.pid for child in psutil.Process(pid).children(recursive=True)]


def test_a_killed_run_keeps_its_finished_frames_and_leaves_no_worker(store, tmp_path):
    command = script(
        tmp_path, JOB.format(store=str(store.folder), executor="local", length=8, wait=0.15)
    )
    process = subprocess.Popen(command, env=environment(tmp_path), stdout=subprocess.PIPE)
    deadline = time.monotonic() + 60
    while logged(tmp_path)["cell"] < 6:
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.02)
    workers = children(process.pid)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert workers
    while any(
        Path(f"/proc/{pid}").exists()
        and "Z" not in Path(f"/proc/{pid}/stat").read_text().split()[2]
        for pid in workers
    ):
        assert time.monotonic() < deadline, "workers outlive the killed run"
        time.sleep(0.05)
    done = logged(tmp_path)["cell"]
    assert done < 24
    quick = script(
        tmp_path, JOB.format(store=str(store.folder), executor="local", length=8, wait=0.15)
    )
    result = subprocess.run(
        quick, env=environment(tmp_path), capture_output=True, text=True, timeout=120, check=True
    )
    assert float(result.stdout) == expected(8, 2.0, VIEWS)
    after = logged(tmp_path)
    assert after["base"] == after["item"] == after["shift"] == 1
    assert after["square"] == 8
    assert 24 <= after["cell"] <= 24 + 2  # at most the frame that each of two workers held


def test_folders_of_killed_runs_are_removed_and_those_of_others_stay(store):
    runs = store.folder / "runs"
    killed, living = runs / "tmpkilled", runs / "tmpliving"
    for folder in (killed, living):
        folder.mkdir(parents=True)
        (folder / "events").touch()
        os.utime(folder, (time.time() - 100,) * 2)
    handle = os.open(living, os.O_RDONLY)
    assert lock(handle)
    go(store)
    assert [path.name for path in runs.iterdir()] == ["tmpliving"]
    os.close(handle)


def test_two_runs_at_once_share_a_store(store, tmp_path):
    commands = [
        script(
            tmp_path, JOB.format(store=str(store.folder), executor="serial", length=6, wait=0.01)
        )
        for _ in range(2)
    ]
    processes = [
        subprocess.Popen(command, env=environment(tmp_path), stdout=subprocess.PIPE, text=True)
        for command in commands
    ]
    results = [process.communicate(timeout=120)[0] for process in processes]
    assert [process.returncode for process in processes] == [0, 0]
    assert [float(result) for result in results] == [expected(6, 2.0, VIEWS)] * 2
    assert computed(go(store, length=6)) == {"cell": 18}  # `wait` is part of the cell's key


NODES = """
from a2v.types import Record
from dataclasses import dataclass
from pathlib import Path
import numpy as np
from pipelines.engine.memo import memo
from pipelines.engine.refs import Ref
from pipelines.engine.store import put, get
from tests.support.numbers import Numbers, _log

@memo()
def {name}({inputs}) -> Ref[Numbers]:
    _log("{name}")
    return {body}
"""


def test_an_edit_of_the_code_runs_that_node_again(store, tmp_path):
    (tmp_path / "first.py").write_text(
        NODES.format(name="first", inputs="n: int", body="put(Numbers(values=np.arange(n)))")
    )
    second = NODES.format(
        name="second",
        inputs="first: Ref[Numbers]",
        body="put(Numbers(values=get(first, Numbers).values + {}))",
    )
    (tmp_path / "second.py").write_text(second.format(1))
    command = script(
        tmp_path,
        f"""
        import sys
        sys.dont_write_bytecode = True
        from first import *
        from second import *
        from pipelines.engine.graph import Step
        from pipelines.engine.run import run
        from pipelines.engine.store import Store
        outcome = run("second", graph=(Step(first, "first"), Step(second, "second")), store=Store({str(store.folder)!r}), executor="serial", n=3)
        print(outcome.get("second", Numbers).values.sum())
        """,
    )

    def once() -> float:
        return float(
            subprocess.run(
                command, env=environment(tmp_path), capture_output=True, text=True, check=True
            ).stdout
        )

    assert once() == once() == 6.0
    assert logged(tmp_path) == {"first": 1, "second": 1}
    (tmp_path / "second.py").write_text(second.format(2))
    assert once() == 9.0
    assert logged(tmp_path) == {"first": 1, "second": 2}
    first = tmp_path / "first.py"
    first.write_text(first.read_text() + "\nUNUSED = 1\n")
    assert once() == 9.0
    assert logged(tmp_path) == {"first": 1, "second": 2}
    first.write_text(
        first.read_text().replace(
            "    _log",
            "    # a comment: the node runs, its value is as before, so nothing after it runs\n    "
            "_log",
        )
    )
    assert once() == 9.0
    assert logged(tmp_path) == {"first": 2, "second": 2}


@memo()
def fragile(item: Ref[Numbers], folder: str) -> Ref[Numbers]:
    value = get(item, Numbers).values[0]
    mark = Path(folder) / str(value)
    if value == 4.0 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return put(Numbers(values=np.array([value + 1])))


FRAGILE = (*GRAPH[:2], Step(fragile, "fragile", "item[t] -> fragile[t]"))


def test_a_dying_worker_is_replaced(store, tmp_path):
    outcome = run(
        "fragile",
        graph=FRAGILE,
        store=store,
        executor="local",
        workers=2,
        length=5,
        scale=Scale(),
        folder=str(tmp_path),
    )
    assert [store.get(ref, Numbers).values[0] for ref in outcome.values["fragile"]] == [
        1.0,
        3.0,
        5.0,
        7.0,
        9.0,
    ]


def test_dask_gives_the_same(store, tmp_path):
    pytest.importorskip("distributed", reason="Dask is an extra: pip install 'a2v[dask]'")
    with open_executor("dask", workers=2) as executor:
        assert answer(go(store, executor=executor)) == expected(4, 2.0, VIEWS)
        outcome = run(
            "fragile",
            graph=FRAGILE,
            store=store,
            executor=executor,
            length=5,
            scale=Scale(),
            folder=str(tmp_path),
        )
    assert [store.get(ref, Numbers).values[0] for ref in outcome.values["fragile"]] == [
        1.0,
        3.0,
        5.0,
        7.0,
        9.0,
    ]


def test_ray_gives_the_same_or_says_what_to_install(store):
    try:
        import ray  # noqa: F401
    except ImportError:
        with pytest.raises(MissingDependencyError, match="a2v\\[ray"), open_executor("ray"):
            pass
        return
    with open_executor("ray", workers=2) as executor:
        assert answer(go(store, executor=executor)) == expected(4, 2.0, VIEWS)


def test_an_executor_of_your_own_is_left_open(store):
    with ThreadPoolExecutor(2) as pool:
        assert answer(go(store, executor=pool)) == expected(4, 2.0, VIEWS)
        assert pool.submit(lambda: 1).result() == 1


def test_an_error_ends_the_workers(tmp_path):
    with contextlib.suppress(InputError), open_executor("local", workers=1) as pool:
        process = pool.submit(os.getpid).result()
        raise InputError("stop")
    assert (
        not Path(f"/proc/{process}").exists()
        or "Z" in Path(f"/proc/{process}/stat").read_text().split()[2]
    )


def test_early_outputs_are_told_before_the_others_and_computed_once(store):
    told = []

    def tell(name):
        return lambda outcome: told.append((name, answer_of(outcome, name), computed(outcome)))

    def answer_of(outcome, name):
        return (
            outcome.get(name, Numbers).values.tolist()
            if name == "base"
            else len(outcome.values[name])
        )

    outcome = go(store, early={"base": tell("base"), "square": tell("square")})
    assert [name for name, _, _ in told] == ["base", "square"]
    assert told[1][1] == 4
    assert told[0][2] == {"base": 1}
    assert told[1][2] == {"base": 1, "item": 1, "square": 4}
    assert answer(outcome) == expected(4, 2.0, VIEWS)
    assert computed(outcome) == {
        "base": 1,
        "item": 1,
        "square": 4,
        "shift": 1,
        "cell": 12,
        "column": 3,
        "total": 1,
    }
    assert all(
        stats.calls == 1 or name in ("square", "cell", "column")
        for name, stats in outcome.nodes.items()
    )
    again = go(store, early={"base": tell("base")}, start="square")
    assert "base" not in computed(again)
    assert computed(again)["square"] == 4
