"""A store trusts only folders of this user and matching records of valid shape."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from a2v.errors import InputError
from pipelines.engine.run import run
from pipelines.engine.store import Store
from tests.support.numbers import GRAPH, Numbers, Scale, expected

VIEWS = (10, 20)
ROOT = Path(__file__).resolve().parents[2]


def go(store: Store):
    return run(
        "total",
        graph=GRAPH,
        store=store,
        executor="serial",
        length=2,
        scale=Scale(2.0),
        views=VIEWS,
        wait=0.0,
    )


def answer(store: Store) -> float:
    return float(go(store).get("total", Numbers).values[0])


@pytest.fixture
def store(tmp_path, monkeypatch) -> Store:
    monkeypatch.delenv("A2V_SHARED_STORE", raising=False)
    return Store(tmp_path / "deep" / "store")


def test_a_new_store_is_its_users_alone(store):
    go(store)
    assert store.folder.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("part", ["", "calls", "objects"])
def test_a_store_that_others_can_write_is_refused(store, part):
    go(store)
    (store.folder / part).chmod(0o777)
    with pytest.raises(InputError, match=r"can be written by every user.*A2V_SHARED_STORE=1"):
        go(store)


@pytest.mark.parametrize("mode", [0o700, 0o755])
def test_folders_deep_in_a_store_are_looked_at_where_others_may_enter_it(store, mode):
    go(store)
    (store.folder / "objects").chmod(0o755)
    next((store.folder / "objects").iterdir()).chmod(0o777)
    store.folder.chmod(mode)
    if mode == 0o700:
        go(store)
        return
    with pytest.raises(InputError, match=r"objects/.. can be written by every user"):
        go(store)


def test_a_store_of_another_user_is_refused_and_may_be_trusted(store, monkeypatch):
    if os.geteuid():
        pytest.skip("only root can give a folder away")
    go(store)
    os.chown(store.folder, 54321, -1)
    with pytest.raises(InputError, match=r"belongs to another user \(number 54321\)"):
        go(store)
    monkeypatch.setenv("A2V_SHARED_STORE", "1")
    assert answer(store) == expected(2, 2.0, VIEWS)


def test_a_store_of_a_group_is_refused_and_a_private_group_is_not(store):
    if os.geteuid():
        pytest.skip("only root can give a folder away")
    go(store)
    store.folder.chmod(0o770)
    assert answer(store) == expected(2, 2.0, VIEWS)  # root's own group
    os.chown(store.folder, -1, 54321)
    with pytest.raises(InputError, match="by a group"):
        go(store)


def test_exchanged_records_of_calls_are_unknown(store):
    """Two results of one node that are exchanged are both computed again."""
    right = answer(store)
    first, second = sorted((store.folder / "calls" / "cell").rglob("*.json"))[:2]
    one, other = first.read_bytes(), second.read_bytes()
    first.write_bytes(other)
    second.write_bytes(one)
    for total in (store.folder / "calls").glob(
        "[ct]o*/*/*.json"
    ):  # column and total, whose records have the right sum
        total.unlink()
    again = go(store)
    assert float(again.get("total", Numbers).values[0]) == right
    assert again.nodes["cell"].calls - again.nodes["cell"].cached == 2


@pytest.mark.parametrize(
    "change",
    [
        lambda record: [record],
        lambda record: "text",
        lambda record: {**record, "result": 3},
        lambda record: {**record, "result": {"array": 3, "shape": [1]}},
        lambda record: {**record, "result": {"list": [[[]]]}},
        lambda record: {**record, "notes": "\x1b[2J"},
        lambda record: {**record, "notes": [3]},
        lambda record: {**record, "measures": [1]},
        lambda record: {**record, "peak": "much"},
        lambda record: {name: value for name, value in record.items() if name != "call"},
    ],
)
def test_records_of_another_shape_are_unknown(store, change):
    right = answer(store)
    for file in (store.folder / "calls").rglob("*.json"):
        file.write_text(json.dumps(change(json.loads(file.read_text()))))
    assert answer(store) == right


def test_deep_records_are_unknown(store):
    right = answer(store)
    for file in (store.folder / "calls").rglob("*.json"):
        file.write_text('{"call": ' + "[" * 100_000)
    assert answer(store) == right


def test_notes_cannot_steer_a_terminal(store):
    go(store)
    for file in (store.folder / "calls").rglob("*.json"):
        file.write_text(json.dumps({**json.loads(file.read_text()), "notes": ["\x1b[2Jgone"]}))
    assert go(store).notes == ("\\x1b[2Jgone",)


def test_names_from_a_file_reach_standard_output_escaped(tmp_path):
    folder = tmp_path / "a\x1b[2Jb"
    done = subprocess.run(
        [sys.executable, "-m", "pipelines", "cache", "--cache", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "\\x1b[2Jb" in done.stdout
    assert "\x1b" not in done.stdout
